"""A hurt clip has the same body and its feet on the ground. Without an injury nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.core.skeleton import other_side
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels.clip_labels import LabelReport
from hobble.labels.label import mirror_labels
from hobble.motion.edit import mirror_clip
from tests.hurt.gait import SIDES, fastest, knee, slide, toe_heights

MADE = ("straight", "turning", "jog", "starting", "uneven")
CAPTURED = ("07_01", "105_29", "09_01", "03_01")
HURT = (
    {"RightUpLeg-RightLeg": 10.0},
    {"LeftLeg-LeftFoot": 10.0},
    {"RightFoot-RightToeBase": 10.0},
    {"LHipJoint-LeftUpLeg": 10.0, "LowerBack-Spine": 7.0},
    {"RightForeArm-RightHand": 10.0, "Neck-Neck1": 5.0},
)


def test_severity_zero_is_the_clip_bit_for_bit(made, hurting) -> None:
    clip, labels, flat = made("turning")
    same = hurt_clip(clip, labels, hurting(len(clip), {}), flat=flat)
    assert same.clip.rotations.tobytes() == clip.rotations.tobytes()
    assert same.clip.root.tobytes() == clip.root.tobytes()
    assert same.labels is labels
    assert not same.severity.any()


def test_frames_before_an_injury_are_unchanged(made, hurting) -> None:
    clip, labels, flat = made("straight")
    severity = hurting(len(clip), {"RightUpLeg-RightLeg": 10.0})
    severity[:600] = 0.0
    hurt = hurt_clip(clip, labels, severity, flat=flat)
    np.testing.assert_allclose(hurt.clip.positions[:480], clip.positions[:480], atol=0.02)
    assert np.abs(hurt.clip.positions[600:900] - clip.positions[600:900]).max() > 20


@pytest.mark.parametrize("links", HURT, ids=lambda links: next(iter(links)))
@pytest.mark.parametrize("name", MADE)
def test_generated_clips_keep_to_the_ground_when_hurt(made, hurting, name, links) -> None:
    _keeps_to_the_ground(made(name), hurting, links)


@pytest.mark.shared
@pytest.mark.parametrize("links", HURT, ids=lambda links: next(iter(links)))
@pytest.mark.parametrize("name", CAPTURED)
def test_captured_clips_keep_to_the_ground_when_hurt(captured, hurting, name, links) -> None:
    _keeps_to_the_ground(captured(name), hurting, links)


def _keeps_to_the_ground(healthy, hurting, links) -> None:
    clip, labels, flat = healthy
    hurt = hurt_clip(clip, labels, hurting(len(clip), links), flat=flat)
    assert np.isfinite(hurt.clip.rotations).all()
    assert np.isfinite(hurt.clip.root).all()
    # A shorter stance gives more weight to the frames in which a foot lands and leaves. A generated walk has
    # no slide, so its hurt version may have .3 mm a frame, a fifth of the limit for contact.
    assert slide(hurt.clip, hurt.labels) <= max(1.25 * slide(clip, labels), 0.03)
    assert fastest(hurt.clip) <= 1.5 * fastest(clip)
    for side in SIDES:
        assert knee(hurt.clip, side).min() > min(-1.0, knee(clip, side).min() - 1.0)
    if flat:
        before, after = toe_heights(clip, labels), toe_heights(hurt.clip, hurt.labels)
        if len(before) and len(after):
            assert after.min() > before.min() - 1.0
            assert np.percentile(after, 99) < np.percentile(before, 99) + 1.0
            assert abs(np.median(after) - np.median(before)) < 0.5
    lengths = np.linalg.norm(
        hurt.clip.positions[:, 1:] - hurt.clip.positions[:, list(clip.skeleton.parents[1:])], axis=2
    )
    assert np.ptp(lengths, axis=0).max() < 1e-6


@pytest.mark.parametrize("links", HURT, ids=lambda links: next(iter(links)))
def test_hurting_the_mirrored_clip_on_the_other_side_is_the_mirror_of_the_hurt_clip(
    made, hurting, links
) -> None:
    clip, labels, _ = made("turning")
    across = {"-".join(other_side(joint) for joint in link.split("-")): s for link, s in links.items()}
    report = LabelReport("turning", "automatic", "automatic", "right", "extend", 0)
    image = mirror_clip(clip, "image")
    image_labels, _ = mirror_labels(labels, report, image)
    one = mirror_clip(hurt_clip(clip, labels, hurting(len(clip), links)).clip, "image")
    two = hurt_clip(image, image_labels, hurting(len(clip), across)).clip
    assert len(one) == len(two)
    # A half cycle is no whole number of frames, so that the phase of the mirrored labels is a frame's share
    # off.
    np.testing.assert_allclose(two.root, one.root, atol=0.05)
    assert np.degrees(quat.angle(one.rotations, two.rotations)).max() < 0.5


@pytest.mark.parametrize("bad", [-1.0, 10.5, np.nan])
def test_severities_out_of_range_are_refused(made, hurting, bad) -> None:
    clip, labels, _ = made("turning")
    with pytest.raises(HobbleError, match="turning: every severity should be a number from 0 to 10"):
        hurt_clip(clip, labels, hurting(len(clip), {"RightUpLeg-RightLeg": bad}))
    with pytest.raises(HobbleError, match="turning: the severities"):
        hurt_clip(clip, labels, np.zeros((3, 30)))
