"""Every file of shared/wild and shared/mocap comes out right, or is refused for the right reason."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.labels.footfall import find_stance_contacts

SIDES = ("left", "right")
SHARED = Path(os.environ.get("HOBBLE_SHARED", Path(__file__).parents[3] / "shared"))
REFUSED = {
    "ammarkov/head": "219 values, but the joints have 213 channels",
    "ammarkov/tpose": "declares 1352 frames of 498 values, more than the file can hold",
    "dog_mann/D1_007_KAN01_001": "the figure goes on four legs",
    "dog_mann/D1_010_KAN01_002": "the figure goes on four legs",
    "dog_mann/D1_049_KAN01_001": "the figure goes on four legs",
    "fairmotion/pfnn_hierarchy": "there is no motion in it, only one pose",  # its zero pose alone
    "ganimator/Crab-dance-long": "does not show which chains are legs",  # a crab
    "lafan_orig/decompressor_Ygnd": "neither names nor feet and knees show which side is left",  # joint_7
    "video2bvh/cxk": "the ground under .* slopes, .* by [78] degrees",  # from a tilted camera
    "wspr/milad": "shoulders are turned by 126 degrees against its hips",  # it is broken in the file
}
# What is in doubt in a file and must be told.
TOLD = {
    "acrnn/01": "source_fps: 60",
    "ammarkov/102_01cc": "No unit gives this rig a person's size",
    "npybvh/example": "source_fps: 60",
    "makehuman/zombieWalk1": "Its feet stand 14 degrees flatter than in its zero pose",
}
# Contacts of heels that differ from `heel_count`: a file that plays at a fifth of its speed, and a
# kick.
OTHER_HEELS = ("mocapnet/CMU_Sample_05_01", "taeil/124_01_ret_MIXAMO_rest")
KNEES = 5.0  # degrees by which a knee may bend more or less than in the file, on average


def files(*folders: str) -> list[str]:
    """The files of folders of shared, relative to it."""
    found = sorted(file for folder in folders for file in (SHARED / folder).rglob("*.bvh"))
    return [str(file.relative_to(SHARED)) for file in found]


def names(folder: str, every: int) -> list[object]:
    """The files of a folder. One of `every` runs always, the others only with the slow tests."""
    slow = pytest.mark.slow
    return [pytest.param(name, marks=slow) if n % every else name for n, name in enumerate(files(folder))]


@pytest.mark.shared
@pytest.mark.parametrize("name", [*names("wild/rigs", 3), *names("mocap", 16), *names("wild/lafan1", 32)])
def test_a_file_is_right_or_rightly_refused(shared, make, name):
    key = name.removeprefix("wild/rigs/").removesuffix(".bvh")
    if why := REFUSED.get(key):
        with pytest.raises(InputError, match=why):
            make(shared / name)
        return
    clip, report = make(shared / name)
    told = " ".join(report["unsure"])
    assert TOLD.get(key, "") in told
    hips = clip.positions[:, clip.skeleton.role("hips"), 1] - clip.positions[..., 1].min(axis=1)
    assert 70 < np.median(hips) < 105
    for joint, angle in (report["retarget"] or {"angles": {}})["angles"].items():
        if "knee" in joint:
            assert abs(angle["constant"]) < KNEES, joint
    contacts = find_stance_contacts(clip).mean(axis=0)
    for side, column in (("left", 0), ("right", 2)):
        assert key in OTHER_HEELS or abs(contacts[column] - heel_count(clip, side)) < 0.1, side


def heel_count(clip, side):
    """The share of frames in which a heel is slower than 60 cm/s and lower than 3 cm above its own floor.

    Its floor is the median height of its slow frames within a second.
    """
    heel = clip.positions[:, clip.skeleton.role(f"{side}_heel")]
    slow = np.linalg.norm(np.gradient(heel, axis=0), axis=-1) < 1.0
    low = [
        slow[n] and heel[n, 1] < np.median(heel[near, 1][slow[near]]) + 3.0
        for n in range(len(heel))
        for near in [slice(max(0, n - 60), n + 61)]
    ]
    return float(np.mean(low))


@pytest.mark.parametrize("shorter", [0.02, 0.04])
def test_legs_of_unequal_length_bend_no_knee_and_stand_level(walk, bvh, make, shorter):
    """In the file the feet are level, and the pelvis leans to the shorter leg. In the result it is level."""
    offsets, rotations, root = walk.skeleton.offsets.copy(), walk.rotations.copy(), walk.root.copy()
    offsets[[walk.skeleton.role(f"left_{part}") for part in ("knee", "heel")]] *= 1 - shorter
    less = shorter * walk.skeleton.leg_length
    lean = -less / np.abs(np.diff(walk.positions[0, [walk.skeleton.role(f"{s}_hip") for s in SIDES], 0]))
    rotations[:, 0] = quat.mul(quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), lean), rotations[:, 0])
    root[:, 1] -= 0.5 * less
    short = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets), rotations=rotations, root=root)
    made, report = make(bvh(short))
    left, right = (report["retarget"]["angles"][f"{side} knee"]["constant"] for side in SIDES)
    assert max(abs(left), abs(right)) < 3
    lowest = [np.percentile(made.positions[:, made.skeleton.role(f"{side}_toe"), 1], 20) for side in SIDES]
    assert abs(lowest[0] - lowest[1]) < 0.7


@pytest.mark.parametrize(
    ("frames", "words"),
    [(4, "only 7 frames, which are 4 at 60 a second"), (40, "only one pose, held all the time, such as")],
)
def test_a_clip_without_motion_is_refused_or_accepted_as_a_doubt(walk, bvh, make, frames, words):
    clip = walk.part(slice(0, 7))
    if frames == 40:
        identity = 0 * walk.rotations[:80] + [1.0, 0.0, 0.0, 0.0]
        clip = replace(walk, rotations=identity, root=0 * walk.root[:80] + walk.root[0])
    with pytest.raises(InputError, match=f"there is no motion in it, {words}.*--accept-doubt"):
        make(bvh(clip))
    assert "There is no motion" in " ".join(make(bvh(clip), accept_doubt=True)[1]["unsure"])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_a_file_in_utf_16_is_read(walk, bvh, make, encoding):
    path = bvh(walk)
    plain, _ = make(path)
    path.write_bytes(path.read_text().encode(encoding))
    assert (make(path)[0].positions == plain.positions).all()


def test_frames_cut_a_clip_out_of_its_file(walk, bvh, make):
    whole, _ = make(bvh(walk))
    part, report = make(bvh(walk), frames=(61, 181))
    assert (len(part), report["source_frames"]) == (61, 121)
    np.testing.assert_allclose(part.positions, whole.positions[30:91], atol=0.2)
    with pytest.raises(InputError, match="frames 200 to 300 are wanted, but it has 241"):
        make(bvh(walk), frames=(200, 300))
