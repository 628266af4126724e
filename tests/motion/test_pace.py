"""Files whose numbers contradict each other: units, radians, no rotations, walking in place."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.look import summarise_clips
from hobble.motion.options import ClipMotion


def with_values(text: str, change) -> str:
    """A file with a changed table of values; the first three columns are the root's position."""
    head, body = text.split("Frame Time:")
    first, _, rows = body.partition("\n")
    values = change(np.array([[float(x) for x in row.split()] for row in rows.splitlines()]))
    lines = "\n".join(" ".join(f"{x:.7f}" for x in row) for row in values)
    return f"{head}Frame Time:{first}\n{lines}\n"


def on_a_curve(walk: Clip) -> Clip:
    """The walk on a circle with a radius of 3 m."""
    turn = quat.yaw(walk.root[:, 2] / 300.0)
    rotations = walk.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    centre = np.array([300.0, 0.0, 0.0])
    out = quat.rotate(turn, walk.root * [1, 0, 0] - centre) + centre
    return replace(walk, rotations=rotations, root=out + walk.root * [0, 1, 0])


@pytest.mark.parametrize(
    ("factor", "said"),
    [(2.54, r"2\.\d+"), (1 / 2.54, r"0\.\d+"), (100, "1.."), (0.7, r"0\.[67]\d"), (1.3, r"1\.[234]\d")],
)
def test_a_root_in_another_unit_than_the_bones_is_refused(bvh, walk, make, factor, said):
    path = bvh(replace(walk, root=walk.root * factor), "other")
    with pytest.raises(InputError, match=rf"other.bvh: the hips go .*{said} times as fast .*OFFSETs"):
        make(path)
    make(path, defects="leave")


@pytest.mark.parametrize(
    ("order", "said"), [("XYZ", "knee points 8. degrees away"), ("XZY", "the hips go 3.11 times")]
)
def test_rotation_channels_in_a_wrong_order_are_refused(bvh, walk, make, order, said):
    """Files of `bvh` are written in the order ZXY."""
    wrong = " ".join(f"{axis}rotation" for axis in order)
    path = bvh(on_a_curve(walk), "order", edit=lambda text: re.sub(r"[XYZ]rotation .*rotation", wrong, text))
    with pytest.raises(InputError, match=said):
        make(path)
    make(path, defects="leave")


def test_who_sits_with_the_knees_apart_is_not_refused(bvh, walk, make):
    rotations, name = walk.rotations.copy(), walk.skeleton.joints.index
    rotations[:, 0] = [1, 0, 0, 0]
    for side, aside in (("Left", 1), ("Right", -1)):
        thigh, shank = name(f"{side}UpLeg"), name(f"{side}Leg")
        lift, spread = np.radians(-85), np.radians(75 * aside)
        rotations[:, thigh] = quat.mul(quat.yaw(spread), [np.cos(lift / 2), np.sin(lift / 2), 0, 0])
        rotations[:, shank] = [np.cos(lift / 2), -np.sin(lift / 2), 0, 0]
    sitting = replace(walk, rotations=rotations, root=walk.root * [0, 0, 0] + [0, 48, 0])
    assert not any("knee" in doubt for doubt in make(bvh(sitting))[1]["unsure"])


def shaking(walk: Clip) -> Clip:
    rng = np.random.default_rng(1)
    noise = gaussian_filter1d(rng.normal(size=walk.rotations.shape), 3, axis=0) * 0.03
    return replace(walk, rotations=quat.normalize(walk.rotations + noise))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (shaking, "of the frames. Noise"),
        (lambda walk: replace(walk, root=walk.root * [0, 1, 0]), "hardly moves the hips"),
        (lambda walk: replace(walk, root=walk.root * [1, 1, 0.82]), "the hips go 0.89 times"),
    ],
)
def test_feet_that_seldom_stand_or_slide_and_a_walk_in_place_are_noted(bvh, walk, make, change, said):
    assert said in " ".join(make(bvh(change(walk)))[1]["unsure"])


def in_radians(text: str) -> str:
    return with_values(text, lambda rows: np.concatenate([rows[:, :3], np.radians(rows[:, 3:])], axis=1))


def positions_alone(text: str) -> str:
    text = with_values(text, lambda rows: np.tile(rows[:, :3], 31))
    return re.sub(r"CHANNELS .*", "CHANNELS 3 Xposition Yposition Zposition", text)


@pytest.mark.parametrize(
    ("edit", "said"),
    [(in_radians, "no angle is larger than .*radians"), (positions_alone, "no joint has rotations")],
)
def test_channels_without_angles_in_degrees_are_refused(bvh, walk, make, edit, said):
    with pytest.raises(InputError, match=said):
        make(bvh(walk, edit=edit))


@pytest.mark.shared
@pytest.mark.parametrize("clip", ["07_01", "16_21"])
@pytest.mark.parametrize(("rate", "times"), [(60, 0.5), (120, 1.0), (240, 2.0)])
def test_a_rate_that_is_wrong_by_two_is_noted_with_the_true_rate(shared, root, clip, rate, times):
    file, maps = shared / f"mocap/cmu/{clip}.bvh", root / "config/skeletons"
    (seen,), _ = summarise_clips(file, maps / "holden31.yaml", maps, ClipMotion(source_fps=float(rate)))
    noted = [warning for warning in seen.warnings if "source_fps" in warning]
    assert len(noted) == (times != 1.0)
    assert all(note.endswith("(source_fps: 120).") for note in noted)
