"""A hurt clip has the same body and its feet on the ground. Without an injury nothing changes."""

import itertools

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import other_side
from hobble.core.smooth import true_runs
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels.clip_labels import CONTACT_ROLES, LabelReport, Labels
from hobble.labels.label import mirror_labels
from hobble.motion.edit import mirror_clip
from hobble.synthetic.generate_clip import generate_walk
from tests.hurt.conftest import CAPTURED, SEGMENTS, labelled

SIDES = ("left", "right")
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


def knee_ahead(clip: Clip, side: str) -> np.ndarray:
    """(F,) cm by which a knee is ahead of the line from hip to ankle; negative if it is bent backwards."""
    at, role = clip.positions, clip.skeleton.role
    hip, knee, ankle = (at[:, role(f"{side}_{r}")] for r in ("hip", "knee", "heel"))
    leg = (ankle - hip) / np.linalg.norm(ankle - hip, axis=1, keepdims=True)
    out = knee - hip - leg * np.sum((knee - hip) * leg, axis=1, keepdims=True)
    up = quat.rotate(clip.global_rotations[:, role("hips")], np.array([0.0, 1.0, 0.0]))
    ahead = np.cross(at[:, role("left_hip")] - at[:, role("right_hip")], up)
    return np.sum(out * ahead, axis=1) / np.linalg.norm(ahead, axis=1)


def slide(clip: Clip, labels: Labels) -> float:
    """cm a frame that the joints in contact move over the ground, on average."""
    feet = clip.positions[:, [clip.skeleton.role(role) for role in CONTACT_ROLES]]
    moved = np.linalg.norm(np.diff(feet[..., [0, 2]], axis=0), axis=2)
    both = labels.contacts[:-1] & labels.contacts[1:]
    return float(moved[both].mean()) if both.sum() > 20 else 0.0


def toe_heights(clip: Clip, labels: Labels) -> np.ndarray:
    """Heights of the toe joints that are in contact."""
    toes = clip.positions[:, [clip.skeleton.role(f"{side}_toe") for side in SIDES], 1]
    return np.asarray(toes[labels.contacts[:, [1, 3]]])


def fastest(clip: Clip) -> float:
    """Degrees a frame of the fastest turning joint."""
    return float(np.degrees(quat.angle(clip.rotations[:-1], clip.rotations[1:]).max()))


# Each clip with two of the injuries, so that each injury is seen in several kinds of motion.
CASES = [
    pytest.param(name, HURT[(i + k) % 5], marks=[pytest.mark.shared] if name in CAPTURED else [])
    for i, name in enumerate([*SEGMENTS, *list(CAPTURED)[:4]])
    for k in (0, 2)
]


@pytest.mark.parametrize(("name", "links"), CASES)
def test_a_hurt_clip_keeps_to_the_ground_and_to_its_body(made, hurting, name, links) -> None:
    clip, labels, flat = made(name)
    hurt = hurt_clip(clip, labels, hurting(len(clip), links), flat=flat)
    # A shorter stance gives more weight to the frames in which a foot lands and leaves. A generated walk has
    # no slide, so its hurt version may have .3 mm a frame, a fifth of the limit for contact.
    assert slide(hurt.clip, hurt.labels) <= max(1.25 * slide(clip, labels), 0.03)
    # Most of all turn the toes of the sound foot beside a hurt shank, as the foot lands: 1.64 times.
    assert fastest(hurt.clip) <= 1.7 * fastest(clip)
    for side in SIDES:
        assert knee_ahead(hurt.clip, side).min() > min(-0.5, knee_ahead(clip, side).min() - 0.5)
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


@pytest.mark.parametrize("links", HURT[1:4], ids=lambda links: next(iter(links)))
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
    # A half cycle is no whole number of frames: the phase of the mirrored labels is off by a frame's share.
    np.testing.assert_allclose(two.root, one.root, atol=0.05)
    assert np.degrees(quat.angle(one.rotations, two.rotations)).max() < 0.5


@pytest.mark.parametrize("recipe", ["steps", "stairs"])
@pytest.mark.parametrize("severity", [0.0, 10.0])
def test_on_stairs_a_badly_hurt_leg_goes_last_up_and_first_down(holden31, hurting, severity, recipe) -> None:
    made = generate_walk("steps", holden31, 1500, recipe, 60, 1).clip
    clip, labels, flat = labelled(made, "walk", False)
    hurt = hurt_clip(clip, labels, hurting(1500, {"RightUpLeg-RightLeg": severity}), flat=flat)
    stands = []  # middle frame, side, height of the ankle, and how far along the path it is, of each stance
    for side, name in enumerate(SIDES):
        _, height, along = hurt.clip.positions[:, clip.skeleton.role(f"{name}_heel")].T
        down = hurt.labels.contacts[:, 2 * side : 2 * side + 2].any(axis=1)
        runs = [slice(a, b) for a, b in true_runs(down) if b - a > 6]
        stands += [(r.start + r.stop, side, np.median(height[r]), np.median(along[r])) for r in runs]
    pairs = [pair for pair in itertools.pairwise(sorted(stands)) if pair[0][1] != pair[1][1]]
    steps = [(there[1], there[2] - here[2], there[3] - here[3]) for here, there in pairs]
    first_up, first_down = ({s for s, rise, _ in steps if sign * rise > 5} for sign in (1, -1))
    if severity:
        assert (first_up, first_down) == ({0}, {1})
        ahead = min(forward for _, rise, forward in steps if abs(rise) > 5)
        assert ahead > {"steps": 33, "stairs": 20}[recipe], "the edge of a step is between the two feet"
    else:
        assert (first_up, first_down & {1}) == ({0, 1}, {1})
