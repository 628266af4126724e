"""Retargeting: bones point the same way, feet on the ground stay, and known figures are reproduced
exactly.
"""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.motion.edit import resample
from hobble.motion.make import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.retarget import plan, retarget_clip
from hobble.motion.rig import joint_pairs
from hobble.motion.skeleton_file import load_skeleton
from tests.motion.scramble import SKELETONS

NAMES = ("holden31", "ava191", "mixamo55", "rig22")
FEET = [f"{side}_{part}" for side in ("left", "right") for part in ("heel", "toe")]


@pytest.fixture(scope="module")
def rigs():
    return {name: load_skeleton(SKELETONS / f"{name}.yaml") for name in NAMES}


def onto(clip: Clip, source, target) -> Clip:
    return retarget_clip(clip, plan(source.skeleton, target.skeleton, joint_pairs(source, target)))


def sourced(file, target):
    """What a file is, and its clip at 60 Hz."""
    source = load_source(read_bvh(file), target, SKELETONS, ClipMotion())
    return source, resample(source.clip, 60.0)


def slide(clip: Clip, role: str) -> np.ndarray:
    """Centimetres a frame over the ground."""
    step = np.diff(clip.positions[:, clip.skeleton.role(role)], axis=0)
    return np.hypot(step[:, 0], step[:, 2])


def standing(clip: Clip, role: str) -> np.ndarray:
    step = np.diff(clip.positions[:, clip.skeleton.role(role)], axis=0)
    return np.sum(step**2, axis=1) < 0.02


def bone(of: Clip, a: str, b: str) -> np.ndarray:
    """(F, 3) unit vectors from one joint to another."""
    way = of.positions[:, of.skeleton.role(b)] - of.positions[:, of.skeleton.role(a)]
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


@pytest.mark.parametrize("start", NAMES)
@pytest.mark.parametrize("end", NAMES)
def test_standing_feet_do_not_move_and_limbs_point_as_the_source_s_do(walker, rigs, start, end):
    clip = walker(rigs[start].skeleton, 120, 60.0)
    made = onto(clip, rigs[start], rigs[end])
    scale = plan(clip.skeleton, rigs[end].skeleton, joint_pairs(rigs[start], rigs[end])).scale
    for role in FEET:
        frames = standing(clip, role)
        assert frames.sum() > 20
        # What is left are a few frames where the other rig's leg cannot reach, 5 mm over all steps together.
        assert slide(made, role)[frames].sum() <= 1.2 * scale * slide(clip, role)[frames].sum() + 0.5
    for a, b, most in (
        *(("shoulder", "elbow", 1e-4), ("elbow", "wrist", 1e-4)),
        *(("hip", "knee", 12.0), ("knee", "heel", 12.0)),
    ):
        for side in ("left", "right"):
            ours, theirs = (bone(one, f"{side}_{a}", f"{side}_{b}") for one in (made, clip))
            apart = 2 * np.arcsin(np.linalg.norm(ours - theirs, axis=-1) / 2)
            assert np.degrees(apart).max() < most, (side, a)


def test_the_same_proportions_come_out_exactly(walk, rigs):
    again = onto(walk, rigs["holden31"], rigs["holden31"])
    np.testing.assert_allclose(again.positions, walk.positions, atol=1e-4)
    assert quat.angle(again.rotations, walk.rotations).max() < 1e-4


def test_a_leg_of_length_0_is_refused_in_source_and_target(walk, rigs):
    own = rigs["holden31"].skeleton
    offsets = own.offsets.copy()
    offsets[own.index("RightFoot")] = 0.0
    lame, pairs = replace(own, offsets=offsets), {n: n for n in own.joints}
    for source, target in ((lame, own), (own, lame)):
        with pytest.raises(
            HobbleError, match="the bone from RightLeg to RightFoot of holden31 has no length"
        ):
            plan(source, target, pairs)


def test_foreign_rigs_are_recognised_by_their_names(walker, rigs, bvh, make):
    for name, prefix in (("mixamo55", "mixamorig:"), ("rig22", "")):
        clip = walker(rigs[name].skeleton, 60, 30.0)
        path = bvh(
            clip,
            name,
            edit=lambda s, p=prefix: s.replace("ROOT ", f"ROOT {p}").replace("JOINT ", f"JOINT {p}"),
        )
        made, report = make(path)
        assert report["rig"] == name
        assert made.skeleton.name == "holden31"
        assert len(made) == 119
        assert 0.9 < report["scale"] < 1.1
        assert "bone lengths of holden31" in make(path, proportions="clip")[1]["repairs"][-1]
        lowest = made.positions[..., 1].min(axis=1)
        assert -3 < lowest.min() < lowest.max() < 6


# The clips on which standing heels are hardest to keep, by every performer, and each of the injured ones.
SLIDING = ["cmu/02_01", "pfnn/LocomotionFlat09_000", "ferre/Injured_Walk_LLL", "ferre/Injured_LUL_Backwards"]


@pytest.mark.shared
@pytest.mark.parametrize("file", SLIDING)
def test_feet_of_real_clips_slide_no_more_than_before_in_every_direction(shared, rigs, file):
    source, clip = sourced(shared / f"mocap/{file}.bvh", rigs["holden31"])
    for end in NAMES:
        pairs = joint_pairs(rigs[source.match.rig], rigs[end])
        pairs = {mine: theirs for mine, theirs in pairs.items() if theirs in clip.skeleton.joints}
        how = plan(clip.skeleton, rigs[end].skeleton, pairs)
        made = retarget_clip(clip, how)
        for role in FEET:
            frames = standing(clip, role)
            before = slide(clip, role)[frames].sum() * how.scale
            assert slide(made, role)[frames].sum() <= 1.2 * before, (end, role)
