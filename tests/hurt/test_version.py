"""The severities of a hurt version match its motion. Without `in_between` no cycle has a changing
severity.
"""

from __future__ import annotations

import numpy as np
import pytest

from hobble.hurt.hurt_clip import hurt_clip
from hobble.hurt.options import Hurt
from hobble.hurt.version import SEVERITY_TOLERANCE, hurt_version
from hobble.labels.clip_labels import LabelReport
from hobble.labels.label import mirror_labels
from hobble.motion.edit import mirror_clip

REPORT = LabelReport("straight", "automatic", "automatic", "right", "extend", 0)
THIGH = "RightUpLeg-RightLeg"


@pytest.fixture(scope="module")
def changing(made, hurting):
    """A walk of 20 s whose thigh hurts at 10 from 5 s on and at 3 from 12 s on: the request, the result."""
    clip, labels, flat = made("straight")
    wanted = hurting(len(clip), {THIGH: 10.0})
    wanted[:300] = 0.0
    wanted[720:] *= 0.3
    return wanted, hurt_clip(clip, labels, wanted, flat=flat)


def test_severities_far_from_a_change_are_the_requested_ones(changing, holden31) -> None:
    wanted, hurt = changing
    column = holden31.link_names.index(THIGH)
    when = np.clip(hurt.source_frames.astype(int), 0, len(wanted) - 1)
    calm = np.ptp([wanted[np.clip(when + d, 0, len(wanted) - 1), column] for d in (-80, 0, 80)], axis=0) == 0
    assert calm.mean() > 0.6
    np.testing.assert_allclose(hurt.severity[calm], wanted[when][calm], atol=0.01)
    assert not np.delete(hurt.severity, column, axis=1).any()


def test_frames_with_a_severity_are_as_fast_as_a_clip_with_it_throughout(changing, made, hurting) -> None:
    _, hurt = changing
    clip, labels, flat = made("straight")
    throughout = hurt_clip(clip, labels, hurting(len(clip), {THIGH: 10.0}), flat=flat)
    inside = np.flatnonzero(hurt.severity.max(axis=1) > 9.9)
    other = np.searchsorted(throughout.source_frames, hurt.source_frames[inside])
    hips = clip.skeleton.role("hips")

    def speed(one, frames):
        return np.linalg.norm(np.diff(one.clip.positions[frames, hips][:, ::2], axis=0), axis=1).mean()

    assert speed(hurt, inside) == pytest.approx(speed(throughout, other), rel=0.03)
    assert speed(hurt, inside) < 0.75 * 130 / 60


@pytest.mark.parametrize("mirrored", [False, True])
def test_without_in_between_no_cycle_has_a_severity_in_between(made, mirrored) -> None:
    clip, labels, _ = made("straight")
    options = Hurt(severities=(10.0,), seconds=5, at_once=1, in_between=False, longest=1)
    hurt, report = hurt_version(
        clip, labels, REPORT, options, name="a_hurt1", version_number=0, ground="flat"
    )
    severity, own = hurt.severity, hurt.labels
    if mirrored:
        own, _ = mirror_labels(own, report, mirror_clip(hurt.clip, "image"))
    inside = np.concatenate([np.arange(a, b + 1) for a, b in own.cycles])
    assert len(inside) > 200
    shown = severity[inside]
    assert (np.minimum(shown, np.abs(shown - 10)) <= SEVERITY_TOLERANCE).all()
    assert (shown > 9).any(axis=1).mean() > 0.9
    kept, _ = hurt_version(
        clip, labels, REPORT, options.model_copy(update={"in_between": True}), name="a_hurt1",
        version_number=0, ground="flat",
    )  # fmt: skip
    everything = np.concatenate([np.arange(a, b + 1) for a, b in kept.labels.cycles])
    assert (np.abs(kept.severity[everything] - 5) < 3).any()
