"""Each figure of a crowd walks as it would alone."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.measures.walks import CrowdTarget, channel_values, generate_walks
from hobble.models.predict import BlendPredictor
from hobble.runtime.options import Runtime


def test_a_figure_walks_the_same_alone_and_in_a_crowd(hurtable) -> None:
    links = list(hurtable.channels["injury"][:5])
    hurt = channel_values(hurtable, "injury", [{link: 2.0 * i} for i, link in enumerate(links)])
    gaits = ["walk", "jog", "walk", "jog", "walk"]
    together = generate_walks(
        hurtable, [CrowdTarget(20, gaits, hurt), CrowdTarget(20, gaits, hurt)], Runtime()
    )
    for i, gait in enumerate(gaits):
        own = {"injury": hurt["injury"][i : i + 1]}
        alone = generate_walks(
            hurtable, [CrowdTarget(20, [gait], own), CrowdTarget(20, [gait], own)], Runtime()
        )
        for name in ("local", "contacts", "phase", "root", "acceleration"):
            np.testing.assert_array_equal(getattr(alone, name)[:, 0], getattr(together, name)[:, i], name)


def test_figures_walk_as_one_until_their_targets_differ(hurtable, monkeypatch: pytest.MonkeyPatch) -> None:
    """One character walks for three healthy figures, two for two severities, three for three targets."""
    rows: list[int] = []
    evaluate = BlendPredictor.evaluate

    def counted(self, z, phase, out):  # type: ignore[no-untyped-def]
        rows.append(len(z))
        evaluate(self, z, phase, out)

    monkeypatch.setattr(BlendPredictor, "evaluate", counted)
    link = hurtable.channels["injury"][3]
    gait = ["walk"] * 3
    healthy, hurt = (
        channel_values(hurtable, "injury", [{link: s} for s in each]) for each in ((0, 0, 0), (0, 8, 8))
    )
    script = [
        CrowdTarget(7, gait, healthy),
        CrowdTarget(6, gait, hurt),
        CrowdTarget(5, gait, hurt, [2.5, 2.5, 1.0]),
    ]
    # Targets that are equal again do not make one walk of two.
    script.append(CrowdTarget(4, gait, healthy))
    walks = generate_walks(hurtable, script, Runtime())
    assert rows == [1] * 7 + [2] * 6 + [3] * 9
    assert np.ptp(walks.local[12], axis=0).max() > 0
    for i in range(3):
        alone = generate_walks(
            hurtable,
            [
                CrowdTarget(
                    s.frames, ["walk"], {"injury": s.channels["injury"][[i]]}, s.speed and [s.speed[i]]
                )
                for s in script
            ],
            Runtime(),
        )
        for name in ("local", "contacts", "phase", "root", "acceleration"):
            np.testing.assert_array_equal(getattr(alone, name)[:, 0], getattr(walks, name)[:, i], name)
