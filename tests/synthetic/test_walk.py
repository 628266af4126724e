"""Healthy motion, measured from the BVH: ranges of motion, support, arms, smoothness, the ground."""

import numpy as np
import pytest

from hobble.core.smooth import true_runs
from hobble.measures.walks import bend
from hobble.synthetic.generate_clip import generate_walk, walk_from_plan
from hobble.synthetic.plan import RECIPES, Segment

SIDES = ("Left", "Right")
FEET = [(side, joint) for side in SIDES for joint in ("Foot", "ToeBase")]


@pytest.fixture(scope="module")
def walking(written):
    return written("walk", recipe="walk-straight", frames=1500)


def brisk(clip, side):
    """Cycles at about 1.3 m/s."""
    return clip.cycles(side, 118, 142)


@pytest.mark.parametrize(
    ("joint", "captured", "within"),
    # captured walks (CMU), means of four people: hip 47 to 63, knee 58 to 64, ankle 26 to 50
    [("hip", 50, 5), ("knee", 63, 5), ("ankle", 38, 6)],
)
def test_the_ranges_of_motion_at_1_3_m_s_are_those_of_people(walking, joint, captured, within):
    ranges = []
    for side in SIDES:
        angle = walking.angles(side)[joint]
        ranges += [np.ptp(angle[a : b + 1]) for a, b in brisk(walking, side)]
    assert len(ranges) > 8
    assert abs(np.mean(ranges) - captured) < within
    assert np.std(ranges) < 5


def test_a_faster_jog_has_larger_movements(holden31):
    stride, flight = [], []
    for speed in (210, 280, 350, 420):
        made = walk_from_plan("m", holden31, [Segment("jog", speed, seconds=12)], 720, "flat", 60, 1)
        places = dict(zip(holden31.joints, np.moveaxis(made.clip.positions, 1, 0), strict=True))
        part = slice(made.right[2], made.right[-2])
        cycles = len(made.right) - 4
        assert 1.3 < cycles * 60 / (part.stop - part.start) < 1.6
        stride.append(np.ptp(places["Hips"][part, 2]) / cycles)
        still = [np.sum(np.diff(places[f"{s}{j}"], axis=0) ** 2, axis=1) < 0.02 for s, j in FEET]
        flight.append(1 - np.any(still, axis=0)[part].mean())
    assert (np.diff(stride) > 20).all()
    assert (np.diff(flight) > 0.03).all()
    assert flight[0] > 0.15


def test_in_a_turn_the_body_leans_in_and_the_inner_knee_bends_as_far(holden31):
    """People who turn by 50 to 70 degrees a second: inner knee 57 to 71 degrees, feet 10 cm outside (CMU)."""
    plan = [Segment("walk", 120, turn=720, seconds=12)]
    clip = walk_from_plan("t", holden31, plan, 720, "flat", 60, 1).clip.part(slice(180, 540))  # one circle
    joints = (holden31.role(role) for role in ("hips", "left_hip", "left_knee", "left_heel", "right_heel"))
    hips, hip, knee, left, right = (clip.positions[:, joint] for joint in joints)
    assert np.ptp(bend(hip, knee, left)) > 52
    radii = [np.linalg.norm((at - hips.mean(axis=0))[:, ::2], axis=1).mean() for at in (hips, left, right)]
    assert 6 < (radii[1] + radii[2]) / 2 - radii[0] < 14


def test_hips_are_highest_in_mid_stance_and_head_stays_level(walking):
    height = walking.joint("Hips")[:, 1]
    assert 90 < height.mean() < 95
    for a, b in brisk(walking, "Right"):
        cycle = height[a:b]
        assert 2.5 < np.ptp(cycle) < 7
        assert 0.15 < np.argmax(cycle[: len(cycle) // 2]) / len(cycle) < 0.4
    neck = walking.joint("Head") - walking.joint("Neck1")
    assert np.degrees(np.arccos(neck[:, 1] / np.linalg.norm(neck, axis=1))).max() < 15


@pytest.mark.parametrize("recipe", RECIPES)
def test_no_leg_is_fully_stretched_and_no_joint_jerks(written, recipe):
    clip = written("any", recipe=recipe)
    for side in SIDES:
        knee = clip.angles(side)["knee"]
        assert knee.min() > 4
        hip, ankle = clip.joint(f"{side}UpLeg"), clip.joint(f"{side}Foot")
        assert np.linalg.norm(hip - ankle, axis=1).max() < 0.9985 * 81
        assert np.abs(np.diff(knee)).max() < (15 if "jog" in recipe else 12.5)  # degrees a frame
    acceleration = np.diff(clip.positions, 2, axis=0) * 36  # m/s2
    assert np.linalg.norm(acceleration, axis=2).max() < (320 if recipe == "jog" else 200)


@pytest.mark.parametrize("recipe", RECIPES)
def test_a_foot_that_is_down_does_not_slide(written, recipe):
    clip = written("any", recipe=recipe)
    for joint in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"):
        downs = [(a, b) for a, b in true_runs(clip.contact(joint)) if b - a > 5]
        assert len(downs) >= 3
        # A heel may begin to rise slowly, or sink as the figure stands up out of a crouch.
        most = 0.9 if recipe == "crouch" and joint.endswith("Foot") else 0.45
        assert max(np.ptp(clip.joint(joint)[a + 1 : b - 2, [0, 2]], axis=0).max() for a, b in downs) < most


@pytest.mark.parametrize("recipe", ["crouch", "stop-and-go", "sidesteps"])
def test_each_gait_has_its_height_and_direction(written, recipe):
    clip = written("any", recipe=recipe, frames=1200)
    head, hips = clip.joint("Head")[:, 1], clip.joint("Hips")
    travel = np.diff(hips, axis=0)
    left = np.cross([0.0, 1.0, 0.0], clip.facing[:-1])
    ahead, aside = (np.sum(travel * way, axis=1) for way in (clip.facing[:-1], left))
    if recipe == "crouch":
        assert np.percentile(head, 20) < 95
        assert np.percentile(hips[:, 1], 20) < 66
    if recipe == "stop-and-go":
        assert (np.linalg.norm(travel, axis=1) < 0.1).mean() > 0.15
        assert ahead.max() > 3
    if recipe == "sidesteps":
        assert np.percentile(aside, 97) > 0.6
        assert np.percentile(aside, 3) < -0.6
        assert np.linalg.norm(clip.joint("LeftFoot") - clip.joint("RightFoot"), axis=1).min() > 7
        assert np.percentile(ahead, 10) < -0.7


@pytest.mark.parametrize("recipe", ["steps", "stairs"])
def test_no_foot_goes_through_the_edge_of_a_step(holden31, recipe):
    made = generate_walk("steps-1", holden31, 673, recipe, 120, 1)
    places = dict(zip(holden31.joints, np.moveaxis(made.clip.positions, 1, 0), strict=True))
    for side in SIDES:
        toe = places[f"{side}ToeBase"]
        ahead = (toe - places[f"{side}Foot"]) * [1, 0, 1]
        tip = toe + 6 * ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        for point in (toe, tip):
            assert (point[:, 1] - made.ground(point[:, 0], point[:, 2])).min() > -0.5
    landings = sorted(
        (f + 20, s) for s, at in zip(SIDES, (made.left, made.right), strict=True) for f in at[:-1]
    )
    rises = np.abs(np.diff([made.ground(*places[f"{side}Foot"][frame, [0, 2]]) for frame, side in landings]))
    assert 6 < rises.max() < 18.5, "a step goes to the next tread"
