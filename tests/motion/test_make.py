"""From files to clips: units, axes, frame rates, channels, skeletons."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.decode import frame_rate
from hobble.motion.file_motion import load_source
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.resample import sample_positions, sample_rotations, sample_times
from hobble.motion.rig import load_skeleton


def test_a_clip_on_the_target_skeleton_is_unchanged(walk, bvh, make):
    clip, report = make(bvh(walk))
    assert report["repairs"] == []
    assert (report["unit"], report["up"], report["source_fps"], report["source_frames"]) == (
        1.0,
        "+Y",
        120.0,
        241,
    )
    assert (clip.fps, len(clip), report["frames"]) == (60.0, 121, 121)
    assert quat.angle(clip.rotations, walk.rotations[::2]).max() < 1e-6
    np.testing.assert_allclose(clip.root, walk.root[::2], atol=1e-6)
    np.testing.assert_array_equal(clip.skeleton.offsets, walk.skeleton.offsets)


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_every_rotation_order_gives_the_same_clip(walk, bvh, make, order):
    clip, _ = make(bvh(walk, order=order))
    assert quat.angle(clip.rotations, walk.rotations[::2]).max() < 1e-6


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0, 1.0), (1 / 2.54, 2.54), (0.01, 100.0), (10.0, 0.1), (1 / 5.6444, 5.6444), (1 / 30.48, 30.48)],
)
def test_the_unit_is_found_from_the_legs(walk, bvh, make, scaled, factor, unit):
    clip, report = make(bvh(scaled(walk, factor), decimals=12))
    assert report["unit"] == unit
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=2e-3 if factor < 1 else 1e-4)


def test_the_unit_can_be_set(walk, bvh, make):
    clip, report = make(bvh(walk), unit=2.0, proportions="clip")
    assert report["unit"] == 2.0
    np.testing.assert_allclose(clip.positions, 2 * walk.positions[::2], atol=1e-3)


def test_a_rig_of_no_known_size_is_refused(walk, bvh, make, scaled):
    with pytest.raises(
        InputError, match=r"walk.bvh: no unit gives this rig a person's size.*Set motion.unit"
    ):
        make(bvh(scaled(walk, 500.0)))


def z_up(clip):
    """The walk as a program with Z up writes it, with the rest pose along Z, too."""
    turn = quat.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2)
    rotations = quat.mul(quat.mul(turn, clip.rotations), quat.inv(turn))
    skeleton = replace(clip.skeleton, offsets=quat.rotate(turn, clip.skeleton.offsets))
    return replace(clip, skeleton=skeleton, rotations=rotations, root=quat.rotate(turn, clip.root))


def left_handed(clip):
    flip = np.array([-1.0, 1, 1])
    skeleton = replace(clip.skeleton, offsets=clip.skeleton.offsets * flip)
    return replace(clip, skeleton=skeleton, rotations=clip.rotations * [1, 1, -1, -1], root=clip.root * flip)


def facing_x(clip):
    """The same motion on a rig whose rest pose faces +X."""
    turn = quat.yaw(np.pi / 2)
    rotations = quat.mul(quat.mul(turn, clip.rotations), quat.inv(turn))
    rotations[:, 0] = quat.mul(clip.rotations[:, 0], quat.inv(turn))
    skeleton = replace(clip.skeleton, offsets=quat.rotate(turn, clip.skeleton.offsets))
    return replace(clip, skeleton=skeleton, rotations=rotations)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (z_up, {"up": "+Z", "handedness": "right"}),
        (left_handed, {"up": "+Y", "handedness": "left"}),
        (facing_x, {"up": "+Y", "handedness": "right", "rest_facing": "+X"}),
        (lambda clip: left_handed(z_up(clip)), {"up": "+Z", "handedness": "left"}),
    ],
)
def test_other_axes_are_found_reported_and_converted(walk, bvh, make, change, said):
    clip, report = make(bvh(change(walk)))
    assert {key: report[key] for key in said} == said
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)
    assert quat.angle(clip.rotations, walk.rotations[::2]).max() < 1e-5


def crawl(skeleton, heading, seconds=3):
    """A figure that crawls at 36 cm/s, in a direction in degrees from +Z towards +X."""
    time = np.arange(60 * seconds + 1) / 60
    swing = 0.26 * np.sin(2 * np.pi * time)[:, None]
    rotations = np.tile(quat.IDENTITY, (len(time), len(skeleton.joints), 1))
    rotations[:, 0] = quat.mul(quat.yaw(np.radians(heading)), quat.from_euler(np.full_like(swing, 1.31), "X"))
    for side, sign in (("left", 1), ("right", -1)):
        rotations[:, skeleton.role(f"{side}_hip")] = quat.from_euler(sign * swing - 1.31, "X")
        rotations[:, skeleton.role(f"{side}_knee")] = quat.from_euler(1.57 - sign * swing, "X")
    way = np.stack(
        [36 * time * np.sin(np.radians(heading)), 50 + 0 * time, 36 * time * np.cos(np.radians(heading))], 1
    )
    return Clip("crawl", skeleton, 60.0, rotations, way)


@pytest.mark.parametrize("heading", [0.0, 50.0, 90.0, 200.0])
def test_a_figure_that_crawls_is_not_stood_on_end(holden31, bvh, make, heading):
    crawling = crawl(holden31, heading)
    for change, up in ((lambda clip: clip, "+Y"), (z_up, "+Z")):
        clip, report = make(bvh(change(crawling)))
        assert report["up"] == up
        np.testing.assert_allclose(clip.positions, crawling.positions, atol=1e-4)
        (note,) = report["notes"]
        assert f"its rest pose along {up}. {up} was taken for up, because the body crawls" in note
    assert make(bvh(crawling), up="Y")[1]["notes"] == []


def turned_upright(clip):
    """The clip in a world with Z up, on a rig whose rest pose stands along Y."""
    turn = quat.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2)
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    return replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root))


@pytest.mark.parametrize("rise", [0.0, 0.6])
def test_a_lying_rest_pose_gives_an_upright_figure(walk, bvh, make, rise):
    """Even on stairs, or in a jump."""
    time = np.arange(len(walk)) / walk.fps
    up = np.stack([0 * time, rise * walk.root[:, 2] + 40 * np.maximum(np.sin(4 * time), 0), 0 * time], axis=1)
    climbing = replace(walk, root=walk.root + up)
    clip, report = make(bvh(turned_upright(climbing)))
    assert report["up"] == "+Z"
    note = report["notes"][0]
    assert "its rest pose along +Y. +Z was taken for up, because the body moves that way up" in note
    np.testing.assert_allclose(clip.positions, climbing.positions[::2], atol=1e-4)


def test_the_axes_can_be_set(walk, bvh, make):
    clip, report = make(bvh(walk), handedness="left", proportions="clip")
    assert report["handedness"] == "left"
    np.testing.assert_allclose(clip.positions * [-1, 1, 1], walk.positions[::2], atol=1e-4)
    clip, report = make(bvh(walk), up="Z", proportions="clip")
    np.testing.assert_allclose(clip.positions[..., 1], walk.positions[::2, :, 2], atol=1e-4)


def raised(clip, height):
    return replace(clip, root=clip.root + np.multiply.outer(height, [0.0, 1.0, 0.0]))


@pytest.mark.parametrize("height", [-93.0, -20.0, 20.0, 120.0])
@pytest.mark.parametrize("rig", ["holden31", "rig22"])
def test_a_floor_at_another_height_is_moved_to_0_and_reported(walker, bvh, make, root, height, rig):
    clip = walker(load_skeleton(root / f"config/skeletons/{rig}.yaml").skeleton, 121, 60.0)
    path = bvh(raised(clip, height))
    moved, report = make(path)
    np.testing.assert_allclose(moved.positions, make(bvh(clip, name="level"))[0].positions, atol=1.5)
    assert [s for s in report["repairs"] if "The floor lies at" in s and s.endswith("so that it lies at 0.")]
    with pytest.raises(InputError, match=r"walk.bvh: The floor lies at -?[\d.]+ cm.*defects: repair"):
        make(path, defects="refuse")


@pytest.mark.shared
@pytest.mark.parametrize("every", [1, 4, 5])
def test_the_floor_of_a_short_run_is_found_at_any_rate(shared, bvh, make, root, every):
    """In one second of a run at 120, 30 and 24 frames a second a foot stands in few frames."""
    source = load_source(
        read_bvh(shared / "mocap/cmu/09_08.bvh"),
        load_skeleton(root / "config/skeletons/holden31.yaml"),
        root / "config/skeletons",
        ClipMotion(),
    ).clip
    part = slice(None, None, every)
    clip = replace(
        source, fps=source.fps / every, rotations=source.rotations[part], root=source.root[part] - [0, 9, 0]
    )
    _, report = make(bvh(clip))
    assert any(said.startswith("The floor lies at -") for said in report["repairs"])


@pytest.mark.parametrize("height", [-1.5, 1.5])
def test_a_floor_near_zero_stays_where_it_is(walk, bvh, make, height):
    clip, report = make(bvh(raised(walk, height)), defects="refuse")
    assert report["repairs"] == report["notes"] == []
    np.testing.assert_allclose(clip.root[:, 1], walk.root[::2, 1] + height, atol=1e-6)


def test_uneven_ground_stays_where_it_is(walk, bvh, make):
    stairs = raised(walk, np.interp(walk.root[:, 2], [80, 120], [20, 60]))
    clip, report = make(bvh(stairs))
    assert "too uneven for flat ground: set `ground: rocky` for this clip" in report["notes"][0]
    assert report["repairs"] == []
    np.testing.assert_allclose(clip.root, stairs.root[::2], atol=1e-6)
    beam = bvh(raised(walk, 40.0), name="beam")
    clip, report = make(beam, ground="beam", defects="refuse")
    assert report["repairs"] == report["notes"] == []
    np.testing.assert_allclose(clip.root[:, 1], walk.root[::2, 1] + 40, atol=1e-6)


def test_the_facing_direction_can_be_set(walk, bvh, make):
    path = bvh(walk)
    as_it_is, report = make(path)
    assert report["facing"] == pytest.approx(0, abs=1)
    clip, report = make(path, facing=90.0)
    assert report["facing"] == pytest.approx(90.0)
    np.testing.assert_allclose(clip.root[0], as_it_is.root[0], atol=1e-9)
    assert clip.root[-1, 0] - clip.root[0, 0] > 190
    np.testing.assert_allclose(clip.positions[..., 1], as_it_is.positions[..., 1], atol=1e-9)


def test_the_frame_rate_can_be_set(walk, bvh, make):
    path = bvh(walk, edit=lambda s: s.replace("0.00833333", "0.06666667"))
    wrong, report = make(path)
    assert report["source_fps"] == 15.0
    assert len(wrong) == 961
    right, report = make(path, source_fps=120.0)
    assert report["source_fps"] == 120.0
    np.testing.assert_allclose(right.root, walk.root[::2], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        ("0.008333", 120), ("0.0083333", 120), ("0.00833333", 120), ("0.0166667", 60), ("0.016667", 60),
        ("0.0333333", 30), ("0.0333", 30), ("0.033333", 30), ("0.04", 25), ("0.0416667", 24),
        ("0.02", 50),
        ("0.01", 100), ("0.0111111", 90), ("0.066667", 15), ("8.33333e-3", 120), ("0.005", 200),
    ],
)  # fmt: skip
def test_rounded_frame_times_mean_standard_rates(text, fps):
    assert frame_rate(float(text), text) == pytest.approx(fps, rel=1e-5)


def test_the_film_rate_23_976_is_not_rounded():
    assert frame_rate(0.0417083, "0.0417083") == pytest.approx(23.976, abs=1e-3)


@pytest.mark.parametrize("rate", [24, 25, 30, 50, 90, 120])
def test_resampling_keeps_time_and_rotates_the_shorter_way(walk, rate):
    times = sample_times(len(walk), 120, rate)
    assert len(times) == int(240 * rate / 120) + 1
    rotations = sample_rotations(walk.rotations, times)
    assert np.abs(np.linalg.norm(rotations, axis=-1) - 1).max() < 1e-12
    assert np.sum(rotations[1:] * rotations[:-1], axis=-1).min() > 0
    np.testing.assert_allclose(sample_positions(walk.root, times)[-1], walk.root[round(times[-1])], atol=1e-9)


def test_halving_the_frame_rate_keeps_frames_exactly(walk):
    times = sample_times(241, 120, 60)
    np.testing.assert_array_equal(times, np.arange(0, 241, 2))
    picked = sample_rotations(walk.rotations, times)
    assert np.abs(np.sum(picked * walk.rotations[::2], axis=-1)).min() > 1 - 1e-15


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 50), st.sampled_from([24, 25, 30, 50, 60, 90, 120]), st.sampled_from([30, 60, 120]))
def test_sample_times_lie_in_the_clip(frames, source, target):
    times = sample_times(frames, source, target)
    assert times[0] == 0
    assert times[-1] <= frames - 1
    assert frames - 1 - times[-1] < source / target + 1e-6
    np.testing.assert_allclose(np.diff(times), source / target, atol=1e-9)


def test_angles_that_wrap_at_180_degrees_give_smooth_rotations(walk, bvh, make):
    """The same angles written as 181 and -179 degrees by turns give the same rotations between the frames."""
    spun = replace(walk, rotations=walk.rotations.copy(), root=walk.root * [0, 1, 0])
    spun.rotations[:, 0] = quat.mul(quat.yaw(np.linspace(0, 4 * np.pi, len(walk))), spun.rotations[:, 0])
    clip, report = make(bvh(spun, decimals=6, order="YXZ"), fps=50.0)
    step = quat.angle(clip.rotations[1:], clip.rotations[:-1])
    assert step.max() < 0.5
    assert "wrap" in report["notes"][0]
    assert "first Hips, frames" in report["notes"][0]
    assert report["repairs"] == []
    assert np.sum(clip.rotations[1:] * clip.rotations[:-1], axis=-1).min() > 0


def test_a_joint_that_turns_suddenly_is_named(walk, bvh, make):
    flipped = replace(walk, rotations=walk.rotations.copy())
    thumb = walk.skeleton.index("LThumb")
    half = quat.from_axis_angle(np.array([0.0, 0, 1.0]), 3.0)
    flipped.rotations[50:60, thumb] = quat.mul(flipped.rotations[50:60, thumb], half)
    _, report = make(bvh(flipped))
    assert any(
        "LThumb spins by up to 172 degrees" in s and "between frames 50 and 51" in s for s in report["notes"]
    )


def test_position_channels_that_repeat_the_offsets_are_dropped_and_reported(walk, bvh, make):
    repeated = replace(walk, translations=np.tile(walk.skeleton.offsets, (len(walk), 1, 1)))
    clip, report = make(bvh(repeated))
    assert clip.translations is None
    assert "only repeat their offsets and were dropped" in report["repairs"][0]
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_that_move_are_kept_and_reported(walk, bvh, make):
    moving = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    moving[:, 3, 1] += np.linspace(0, 5, len(walk))
    clip, report = make(bvh(replace(walk, translations=moving)), proportions="clip")
    assert clip.translations is not None
    np.testing.assert_allclose(clip.translations[:, 3], moving[::2, 3], atol=1e-5)
    assert (
        "1 of 30 joints with position channels really move in their parents (LeftLeg)" in report["repairs"][0]
    )
    assert "kept" in report["repairs"][1]


def test_joint_movement_that_cannot_be_retargeted_is_dropped_and_reported(walk, bvh, make, scaled):
    moving = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    moving[:, 3, 1] += np.linspace(0, 5, len(walk))
    path = bvh(scaled(replace(walk, translations=moving), 1.1), edit=None)
    clip, report = make(path)
    assert clip.translations is None
    assert "dropped" in report["repairs"][-1]


def test_constant_position_channels_replace_a_wrong_offset(walk, bvh, make):
    repeated = replace(walk, translations=np.tile(walk.skeleton.offsets, (len(walk), 1, 1)))
    clip, report = make(
        bvh(repeated, edit=lambda s: s.replace("0.000000 -4.500000 13.500000", "0 -4.5 0", 1))
    )
    assert "OFFSET of LeftToeBase contradicts its position channels" in report["repairs"][0]
    assert clip.translations is None
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_of_zeros_change_nothing(walk, bvh, make):
    zeros = replace(walk, translations=np.zeros((len(walk), 31, 3)))
    clip, report = make(bvh(zeros))
    assert "zero and were dropped" in report["repairs"][0]
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_zero_positions_on_some_joints_are_added_to_their_offsets_and_reported(walk, bvh, make):
    legs = [j for j, name in enumerate(walk.skeleton.joints) if "Leg" in name or "Foot" in name]
    mixed = np.tile(walk.skeleton.offsets, (len(walk), 1, 1))
    mixed[:, legs] = 0.0
    path = bvh(replace(walk, translations=mixed))
    for proportions in ("skeleton", "clip"):
        clip, report = make(path, proportions=proportions)
        assert "The position channels of LeftUpLeg, LeftLeg, LeftFoot," in report["repairs"][0]
        assert "were added to them" in report["repairs"][0]
        assert clip.translations is None
        np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_position_channels_around_0_are_added_to_the_offset(walk, bvh, make):
    added = np.zeros((len(walk), 31, 3))
    arm = walk.skeleton.index("LeftForeArm")
    added[:, arm, 0] = 0.3 + np.sin(np.arange(len(walk)) / 9)
    clip, report = make(bvh(replace(walk, translations=added)), proportions="clip")
    assert (
        "1 of 30 joints with position channels really move in their parents (LeftForeArm)"
        in report["repairs"][1]
    )
    np.testing.assert_allclose(clip.translations, (walk.skeleton.offsets + added)[::2], atol=1e-5)


@pytest.mark.parametrize("proportions", ["skeleton", "clip"])
def test_a_leg_of_length_0_is_refused(walk, bvh, make, proportions):
    path = bvh(walk, edit=lambda s: re.sub(r"(JOINT RightLeg\s*\{\s*OFFSET).*", r"\1 0 0 0", s))
    with pytest.raises(
        InputError, match=r"walk.bvh: the bone from RightUpLeg to RightLeg has no length. Check"
    ):
        make(path, proportions=proportions)


def test_prefixes_of_names_do_not_matter(walk, bvh, make):
    path = bvh(walk, edit=lambda s: s.replace("ROOT ", "ROOT my rig:").replace("JOINT ", "JOINT my rig:"))
    clip, _ = make(path)
    assert clip.skeleton.joints == walk.skeleton.joints


def carried(clip, turn, place):
    """The clip below a joint "Reference" that turns (F, 4) and moves (F, 3) and also carries a camera."""
    own, n = clip.skeleton, len(clip)
    joints, parents = ("Reference", *own.joints, "Camera"), (-1, *(p + 1 for p in own.parents), 0)
    offsets = np.concatenate([np.zeros((1, 3)), own.offsets, [[0, 180, 300]]])
    skeleton = replace(own, joints=joints, parents=parents, offsets=offsets)
    rotations = np.concatenate([turn[:, None], clip.rotations, turn[:, None]], axis=1)
    rotations[:, 1] = quat.mul(quat.inv(turn), clip.rotations[:, 0])
    moved = np.tile(offsets, (n, 1, 1))
    moved[:, 1] = quat.rotate(quat.inv(turn), clip.root - place)
    return replace(clip, skeleton=skeleton, rotations=rotations, root=place, translations=moved)


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("rig", ["holden31", "mixamo55"])
def test_a_joint_above_the_hips_is_merged_into_them_and_reported(walker, bvh, make, root, rig, moves):
    clip = walker(load_skeleton(root / f"config/skeletons/{rig}.yaml").skeleton, 121, 60.0)
    time = moves * np.linspace(0, 1, len(clip))
    turn = quat.mul(quat.yaw(2 * time), quat.from_axis_angle(np.array([1.0, 0, 0]), -np.pi / 2 + 0 * time))
    place = np.stack([50 * time, 20 + 0 * time, 90 * time**2], axis=1)
    made, report = make(bvh(carried(clip, turn, place), name="carried"))
    alone, without = make(bvh(clip))
    np.testing.assert_allclose(made.positions, alone.positions, atol=1e-4)
    assert report["notes"][0] == "The joints above Hips (Reference) were folded into it."
    assert report["rig"] == without["rig"] == rig
    assert without["repairs"] == []
    assert len(report["repairs"]) == 1
    assert "only repeat their offsets and were dropped" in report["repairs"][0]
    assert made.translations is None


def test_joints_in_another_order_are_sorted(walk, bvh, make, holden31):
    order = np.array([0, *range(11, 31), *range(6, 11), *range(1, 6)])
    back = {int(old): new for new, old in enumerate(order)}
    shuffled = replace(
        holden31,
        joints=tuple(holden31.joints[i] for i in order),
        parents=tuple(-1 if holden31.parents[i] < 0 else back[holden31.parents[i]] for i in order),
        offsets=holden31.offsets[order],
    )
    clip, _ = make(bvh(replace(walk, skeleton=shuffled, rotations=walk.rotations[:, order])))
    np.testing.assert_allclose(clip.positions, walk.positions[::2], atol=1e-4)


def test_a_renamed_finger_does_not_change_the_recognised_rig(walk, bvh, make):
    clip, report = make(bvh(walk, edit=lambda s: s.replace("JOINT LThumb", "JOINT LeftPalm")))
    assert report["rig"] == "holden31"
    straight, _ = make(bvh(walk, "straight"))
    np.testing.assert_allclose(clip.positions, straight.positions, atol=0.1)


def test_limbs_are_right_if_a_finger_has_another_parent(walk, bvh, make, holden31):
    parents = list(holden31.parents)
    parents[holden31.index("LThumb")] = holden31.index("LeftForeArm")
    clip, report = make(bvh(replace(walk, skeleton=replace(holden31, parents=tuple(parents)))))
    assert report["rig"] == "found"
    limbs = [holden31.role(role) for role in holden31.roles]
    straight, _ = make(bvh(walk, "straight"))
    assert np.linalg.norm(clip.positions - straight.positions, axis=-1)[:, limbs].mean() < 0.5


@pytest.mark.parametrize("declared", [240, 242])
def test_a_wrong_frame_count_is_repaired_or_refused(walk, bvh, make, declared):
    path = bvh(walk, edit=lambda s: s.replace("Frames: 241", f"Frames: {declared}"))
    clip, report = make(path)
    assert len(clip) == 121
    assert f"declares {declared} frames and has 241" in report["repairs"][0]
    with pytest.raises(InputError, match=f"declares {declared} frames and has 241"):
        make(path, defects="refuse")


def test_making_a_clip_twice_gives_equal_bytes(walk, bvh, make):
    path = bvh(walk)
    a, first = make(path)
    b, second = make(path)
    assert first == second
    assert a.rotations.tobytes() == b.rotations.tobytes()


@pytest.mark.shared
@pytest.mark.parametrize("file", ["cmu/105_16", "cmu/16_21"])
def test_round_trip_120_60_120_stays_within_2_mm(shared, make, file):
    from hobble.motion.make import resample

    source, _ = make(shared / f"mocap/{file}.bvh", fps=120.0, proportions="clip")
    again = resample(resample(source, 60.0), 120.0)
    apart = np.linalg.norm(again.positions - source.positions[: len(again)], axis=-1)
    assert apart.mean() < 0.2


@pytest.mark.shared
def test_every_shared_clip_becomes_a_clip(shared, make):
    for file in sorted((shared / "mocap").glob("*/*.bvh")):
        clip, report = make(file)
        assert np.isfinite(clip.positions).all(), file.name
        assert report["unit_name"] == ("CMU" if report["rig"] == "holden31" else "cm"), file.name
        assert (report["up"], report["handedness"], report["rest_facing"]) == ("+Y", "right", "+Z"), file.name
        height = clip.positions[..., 1].max(axis=1) - clip.positions[..., 1].min(axis=1)
        assert 80 < np.median(height) < 200, file.name


def test_defects_can_be_left_unrepaired(walk, bvh, make):
    broken = raised(walk, np.where(np.arange(len(walk)) >= 200, 80.0, 7.0))
    clip, report = make(bvh(broken), defects="leave")
    assert report["repairs"] == []
    np.testing.assert_allclose(clip.root, broken.root[::2], atol=1e-6)
