"""Files whose numbers contradict each other: units, radians, no rotations, walking in place."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion import ClipMotion
from hobble.motion.look import summarise_clips


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


@pytest.mark.shared
@pytest.mark.parametrize("clip", ["07_01", "16_21"])
@pytest.mark.parametrize(("rate", "times"), [(60, 0.5), (120, 1.0), (240, 2.0)])
def test_a_rate_that_is_wrong_by_two_is_noted_with_the_true_rate(shared, root, clip, rate, times):
    file, maps = shared / f"mocap/cmu/{clip}.bvh", root / "config/skeletons"
    (seen,), _ = summarise_clips(file, maps / "holden31.yaml", maps, ClipMotion(source_fps=float(rate)))
    noted = [warning for warning in seen.warnings if "source_fps" in warning]
    assert len(noted) == (times != 1.0)
    assert all(note.endswith("(source_fps: 120).") for note in noted)


def in_radians(text: str) -> str:
    head, _, rows = text.partition("Frame Time: 0.00833333\n")
    values = np.array([[float(x) for x in row.split()] for row in rows.splitlines()])
    values[:, 3:] = np.radians(values[:, 3:])
    lines = "\n".join(" ".join(f"{x:.7f}" for x in row) for row in values)
    return f"{head}Frame Time: 0.00833333\n{lines}\n"


def test_angles_in_radians_are_refused(bvh, walk, make):
    with pytest.raises(InputError, match=r"no angle is larger than .*radians"):
        make(bvh(walk, edit=in_radians))
