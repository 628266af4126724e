"""`hobble score` and the formulas behind it: exact values, planted faults, equal folders."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.cli.__main__ import main
from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.measures import motion_quality as quality
from hobble.motion.skeleton_file import find_skeleton, load_skeleton
from hobble.synthetic.generate_clip import generate_walk


def feet(height: float, step: float, frames: int = 50) -> np.ndarray:
    """(F, 4, 3) four points that glide sideways by `step` cm a frame."""
    out = np.full((frames, 4, 3), height)
    out[..., 0] = step * np.arange(frames)[:, None]
    return out


@pytest.mark.parametrize(("clearance", "share"), [(-1.0, 1.0), (0.0, 1.0), (1.25, 2 - 2**0.5), (2.5, 0.0)])
def test_skating_counts_less_with_height(clearance, share):
    assert quality.skating(feet(3 + clearance, 1.5), 3.0) == pytest.approx(1.5 * share)


def test_a_still_foot_in_the_air_floats_and_a_fast_one_flies():
    standing = np.full(4, 3.0)
    assert quality.floating(feet(7.0, 0.1), standing) == pytest.approx(4.0)
    assert np.isnan(quality.floating(feet(7.0, 3.0), standing))
    assert quality.penetration(feet(1.5, 0.1), standing) == pytest.approx((1.5, 1.0))


def test_jerk_rotation_and_contact_speed_have_their_units():
    t = np.arange(10.0)
    cube = np.stack([t**3, 0 * t, 0 * t], axis=-1)[:, None]  # cm: its third derivative is 6 cm a frame cubed
    assert quality.jerk(cube) == pytest.approx(6 * 60**3 / 100)
    turning = quat.yaw(np.radians(2.0) * t)[:, None]
    rotations = np.concatenate([turning, np.broadcast_to(quat.yaw(0.0), turning.shape)], axis=1)
    assert quality.joint_update(rotations) == pytest.approx(1.0)
    half = feet(3.0, 1.0)
    half[:, 2:, 1], half[:, 2:, 0] = 9.0, 4 * half[:, 2:, 0]
    assert quality.contact_speed(half, np.full(4, 3.0)) == pytest.approx(0.25)


def test_frechet_distance_of_two_known_distributions():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, [1, 2], (200_000, 2)), rng.normal([3, 0], [2, 2], (200_000, 2))
    # |3|^2 + (1 - 2)^2 + 0
    assert quality.frechet_distance(a, b) == pytest.approx(10.0, abs=0.1)
    assert quality.frechet_distance(a, a) == pytest.approx(0.0, abs=1e-9)


def walk(name: str, seed: int) -> Clip:
    file = find_skeleton("holden31")
    skeleton = load_skeleton(file, "holden31").skeleton
    return generate_walk(name, skeleton, 300, "walk", 60.0, seed).clip


def raised(clip: Clip, up: np.ndarray | float) -> Clip:
    return replace(clip, root=clip.root + np.multiply.outer(np.broadcast_to(up, len(clip)), [0.0, 1.0, 0.0]))


def trembling(clip: Clip) -> Clip:
    noise = np.random.default_rng(0).normal(0, 0.02, (*clip.rotations.shape[:2], 3))
    return replace(clip, rotations=quat.mul(clip.rotations, quat.exp(noise)))


def stiff(clip: Clip) -> Clip:
    role, rotations = clip.skeleton.role, clip.rotations.copy()
    arms = [role(f"{side}_{part}") for side in ("left", "right") for part in ("shoulder", "elbow")]
    rotations[:, arms] = rotations[0, arms]
    return replace(clip, rotations=rotations)


# A fault -> what it does to a clip of 300 frames, and by how much it makes its measure worse.
FAULTS = {
    "floor": (lambda clip: raised(clip, 4.0), 3.0),
    "floating": (lambda clip: raised(clip, 6.0 * (np.arange(len(clip)) >= 150)), 2.0),
    "depth": (lambda clip: raised(clip, -4.0 * (np.arange(len(clip)) % 100 < 20)), 0.4),
    "skating": (lambda clip: replace(clip, root=clip.root * [1.3, 1.0, 1.3]), 0.1),
    "jerk": (trembling, 1000.0),
    "frechet": (stiff, 0.02),
}


def write(folder: Path, change=lambda clip: clip) -> Path:
    folder.mkdir()
    for seed in (1, 2):
        write_bvh(folder / f"walk{seed}.bvh", change(walk(f"walk{seed}", seed)))
    return folder


def scores(capsys, folder: Path, *options: str | Path) -> dict:
    assert main(["score", str(folder), "--json", *map(str, options)]) == 0
    return json.loads(capsys.readouterr().out)


def test_equal_folders_score_equal_and_each_planted_fault_is_found(tmp_path, capsys):
    reference, out = write(tmp_path / "reference"), tmp_path / "out"
    same = scores(capsys, write(tmp_path / "same"), "--reference", reference, "--out", out)
    mean, theirs = same["mean"], same["reference"]
    assert mean.pop("frechet") == pytest.approx(0.0, abs=1e-9)
    assert mean == pytest.approx({name: theirs[name] for name in mean})
    assert json.loads((out / "score.json").read_text())["reference"] == theirs
    assert (out / "score.png").read_bytes().startswith(b"\x89PNG")
    for fault, (change, more) in FAULTS.items():
        found = scores(capsys, write(tmp_path / fault, change), "--reference", reference)["mean"]
        assert found[fault] > mean.get(fault, 0.0) + more, found
    assert found["joint_update"] < 0.9 * mean["joint_update"], "of stiff arms"


def test_a_broken_file_is_named_and_the_others_are_scored(tmp_path, capsys):
    folder = write(tmp_path / "clips")
    (folder / "broken.bvh").write_text("HIERARCHY\nROOT Hips\n")
    assert main(["score", str(folder)]) == 1
    said = capsys.readouterr()
    assert "broken.bvh" in said.err
    assert "2 clips scored, 1 left out" in said.out
    assert "foot skating" in said.out
