"""Clips on rigs of other programs give the same result as the original clip, or are refused."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from tests.motion import other_rigs as rigs
from tests.motion.other_rigs import PLAIN, both, nameless, rigged
from tests.motion.scramble import X, compare, outcome, source_of

SLOW = pytest.mark.slow
RIGS = {
    "KIT, a joint for each axis": (rigs.KIT, {}),
    "game with targets for feet, Z up": (
        "root|-|ground\n" + PLAIN.replace("hips|-|", "hips|root|") + rigs.GAME,
        {"z_up": True},
    ),
    "skirt, hair, wings and tail, without names": (nameless(PLAIN + rigs.CLOTHES), {"rest": "one axis"}),
}


@pytest.fixture(scope="module")
def clip(shared):
    """Five seconds of a CMU walk on its own rig."""
    return source_of(shared / "mocap/cmu/07_01.bvh", 600)


@pytest.mark.shared
@pytest.mark.parametrize("name", RIGS)
def test_a_clip_on_another_rig_is_retargeted_within_a_centimetre(clip, tmp_path, make, name):
    rig, how = RIGS[name]
    first, second, report, names = both(clip, rig, tmp_path, make, **how)
    off = compare(first, second, names)
    assert off.mean() < 1.0, (name, report["roles"])
    assert off.max() < 1.5, dict(zip(names, off.round(1), strict=True))


def without(*joints: str) -> str:
    return "\n".join(line for line in PLAIN.splitlines() if not line.startswith(joints))


def two_figures() -> str:
    one = PLAIN.replace("hips|-|", "hips|scene|")
    other = re.sub(r"^(\w+)\|(?!scene)", r"other_\1|other_", one, flags=re.M)
    return f"scene|-|ground\n{one}\n{other.replace('hips|scene', 'other_hips|scene', 1)}"


PAIRS = r"in doubt .*two equal legs and two equal arms\. .* cannot be used"


@pytest.mark.shared
@pytest.mark.parametrize(
    ("rig", "why"),
    [
        (without("shoulder", "upper_arm", "forearm", "hand"), PAIRS),
        (without("thigh", "shin", "foot", "toe"), PAIRS),
        (without("neck", "head"), r"in doubt .*no joint for the head"),
        (two_figures(), r"two figures, \w*hips and \w*hips. Export each figure on its own"),
    ],
)
def test_no_body_or_two_are_refused(clip, tmp_path, make, rig, why):
    with pytest.raises(InputError, match=why):
        both(clip, rig, tmp_path, make)


@pytest.mark.shared
@pytest.mark.parametrize(
    "seed", [*range(0, 24, 4), *(pytest.param(k, marks=SLOW) for k in range(24) if k % 4)]
)
def test_a_clip_on_a_scrambled_rig_is_recovered(shared, tmp_path, seed):
    """`python -m tests.motion.scramble` tests more."""
    name = ("02_01", "16_11", "07_04", "105_16", "09_03", "08_03")[seed % 6]
    one = outcome(shared / f"mocap/cmu/{name}.bvh", seed, tmp_path, 420)
    assert one.right, one


@pytest.mark.shared
def test_a_rig_whose_names_tell_no_sides_is_refused_until_handedness_is_set(shared, tmp_path, make):
    clip, path = source_of(shared / "mocap/cmu/02_01.bvh", 180), tmp_path / "renamed.bvh"
    write_bvh(
        path, rigged(clip, re.sub("_[lr]\\b", lambda m: {"_l": "Q", "_r": "V"}[m[0]], nameless(PLAIN)))[0]
    )
    write_bvh(tmp_path / "known.bvh", clip)
    with pytest.raises(InputError, match=r"its joint names do not tell left.*Set motion.handedness"):
        make(path)
    right, report = make(path, handedness="right")
    left, known = make(path, handedness="left")[0], make(tmp_path / "known.bvh")[0]
    assert any("motion.handedness: right was used" in note for note in report["notes"])
    for side, other in (("left", "right"), ("right", "left")):
        here, there, mirrored = (
            clip.at_roles()[f"{s}_wrist"] for clip, s in ((right, side), (known, side), (left, other))
        )
        assert np.linalg.norm(here - there[: len(here)], axis=-1).mean() < 2
        assert np.linalg.norm(mirrored * [-1, 1, 1] - here, axis=-1).mean() < 2


@pytest.mark.shared
def test_a_clip_too_short_to_show_its_feet_is_refused_or_accepted(shared, tmp_path, make):
    """A third of a second of a walk on a rig whose zero pose is a heap."""
    clip = source_of(shared / "mocap/cmu/07_01.bvh", 40)
    write_bvh(tmp_path / "short.bvh", rigged(clip, PLAIN, rest="heap")[0], decimals=8)
    with pytest.raises(InputError, match=r"short.bvh: The height of the ankles is uncertain.*accept_doubt"):
        make(tmp_path / "short.bvh")
    assert make(tmp_path / "short.bvh", accept_doubt=True)[1]["unsure"]
    write_bvh(tmp_path / "stands.bvh", rigged(clip, PLAIN)[0], decimals=8)
    assert "uncertain" not in " ".join(make(tmp_path / "stands.bvh")[1]["unsure"])


@pytest.fixture(scope="module")
def standing(holden31) -> Clip:
    """Five seconds on both feet."""
    still = np.tile(quat.IDENTITY, (300, len(holden31.joints), 1))
    return Clip("stands", holden31, 60.0, still, np.tile([0.0, 95.5, 0.0], (300, 1)))


def bent(clip: Clip, joints: tuple[str, ...], angles: np.ndarray) -> Clip:
    """The clip with joints bent forward by angles (F,), radians."""
    rotations = clip.rotations.copy()
    for name in joints:
        rotations[:, clip.skeleton.index(name)] = quat.from_axis_angle(X, angles)
    return replace(clip, rotations=rotations)


def without_toes(clip: Clip) -> Clip:
    """The clip on a rig without balls of the feet."""
    rig = clip.skeleton
    keep = [j for j, name in enumerate(rig.joints) if "Toe" not in name]
    parents = (-1, *(keep.index(rig.parents[j]) for j in keep[1:]))
    legs = Skeleton("legs", tuple(rig.joints[j] for j in keep), parents, rig.offsets[keep])
    return replace(clip, skeleton=legs, rotations=clip.rotations[:, keep])


def test_straight_knees_that_bend_backward_make_no_mirror_image(standing, bvh, make):
    """As cameras capture people who mostly stand."""
    raised = np.maximum(np.sin(np.arange(300) / 20), 0.0) ** 8
    clip = bent(standing, ("LeftUpLeg", "RightUpLeg"), 0.08 - 1.3 * raised)
    clip = bent(clip, ("LeftLeg", "RightLeg"), 2.2 * raised - 0.16)
    assert make(bvh(without_toes(clip)), accept_doubt=True)[1]["handedness"] == "right"
