"""Each figure of a crowd walks as it would alone."""

import numpy as np

from hobble.measures.walks import CrowdTarget, channel_values, generate_walks
from hobble.runtime.options import Runtime


def test_a_figure_walks_the_same_alone_and_in_a_crowd(hurtable) -> None:
    """A healthy figure, and four that are hurt, hurt more, and healed, some of them faster."""
    links = list(hurtable.channels["injury"][:5])
    gaits, speeds = ["walk", "jog", "walk", "jog", "walk"], [2.5, 6.0, 1.0, 7.0, 2.5]
    hurt = [
        channel_values(hurtable, "injury", [{link: i * share} for i, link in enumerate(links)])
        for share in (0, 1, 2, 0)
    ]
    together = generate_walks(hurtable, [CrowdTarget(20, gaits, one, speeds) for one in hurt], Runtime())
    assert np.ptp(together.local[-1], axis=0).max() > 0
    for i, gait in enumerate(gaits):
        script = [CrowdTarget(20, [gait], {"injury": one["injury"][[i]]}, [speeds[i]]) for one in hurt]
        alone = generate_walks(hurtable, script, Runtime())
        for name in ("local", "contacts", "phase", "root", "acceleration"):
            np.testing.assert_array_equal(getattr(alone, name)[:, 0], getattr(together, name)[:, i], name)
