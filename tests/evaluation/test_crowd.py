"""Each figure of a crowd walks as it would alone."""

from __future__ import annotations

import numpy as np

from hobble.evaluation.crowd import CrowdTarget, channel_values, run
from hobble.runtime.options import Runtime


def test_a_figure_walks_the_same_alone_and_among_others(hurtable) -> None:
    links = list(hurtable.channels["injury"][:5])
    hurt = channel_values(hurtable, "injury", [{link: 2.0 * i} for i, link in enumerate(links)])
    gaits = ["walk", "jog", "walk", "jog", "walk"]
    together = run(hurtable, [CrowdTarget(20, gaits, hurt), CrowdTarget(20, gaits, hurt)], Runtime())
    for i, gait in enumerate(gaits):
        own = {"injury": hurt["injury"][i : i + 1]}
        alone = run(hurtable, [CrowdTarget(20, [gait], own), CrowdTarget(20, [gait], own)], Runtime())
        for name in ("local", "contacts", "phase", "root", "acceleration"):
            np.testing.assert_array_equal(getattr(alone, name)[:, 0], getattr(together, name)[:, i], name)
