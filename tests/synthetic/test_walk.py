"""Healthy motion, measured from the BVH: ranges of motion, support, arms, smoothness, the ground."""

from __future__ import annotations

import numpy as np
import pytest

SIDES = ("Left", "Right")


@pytest.fixture(scope="module")
def walking(written):
    return written("walk", recipe="walk-straight", frames=1500)


def brisk(clip, side):
    """Cycles at about 1.3 m/s."""
    return clip.cycles(side, 118, 142)


@pytest.mark.parametrize(
    ("joint", "published", "within"), [("hip", 40, 9), ("knee", 60, 8), ("ankle", 30, 9)]
)
def test_range_of_motion_is_that_of_people_at_1_3_metres_a_second(walking, joint, published, within):
    ranges = []
    for side in SIDES:
        angle = walking.angles(side)[joint]
        ranges += [np.ptp(angle[a : b + 1]) for a, b in brisk(walking, side)]
    assert len(ranges) > 8
    assert abs(np.mean(ranges) - published) < within
    assert np.std(ranges) < 5


def test_both_feet_are_down_for_a_fifth_of_the_cycle(walking):
    both = walking.down("Left") & walking.down("Right")
    shares = [both[a:b].mean() for a, b in brisk(walking, "Right")]
    assert np.mean(shares) == pytest.approx(0.20, abs=0.035)


def test_cadence_and_stride_are_those_of_people(walking):
    seconds = [(b - a) / 60 for a, b in brisk(walking, "Right")]
    assert 0.95 < np.mean(seconds) < 1.15


def test_walking_never_flies_and_jogging_does(walking, written):
    assert (walking.down("Left") | walking.down("Right")).mean() > 0.999
    jog = written("jog", recipe="jog", frames=700)
    for a, b in jog.cycles("Right", slowest=220):
        up = ~(jog.down("Left") | jog.down("Right"))
        assert 0.15 < up[a:b].mean() < 0.6


def test_heel_leaves_before_the_toe(walking):
    heel, toe = walking.contact("RightFoot"), walking.contact("RightToeBase")
    for a, b in brisk(walking, "Right"):
        heel_off = a + np.flatnonzero(heel[a:b])[-1]
        toe_off = a + np.flatnonzero(toe[a:b])[-1]
        assert 8 < toe_off - heel_off < 30
        assert heel[a + 1 : heel_off].all()


def test_arms_swing_against_the_legs(walking):
    for side, other in (SIDES, SIDES[::-1]):
        part = slice(60, -60)
        hand = walking.ahead(walking.joint(f"{side}Hand") - walking.joint(f"{side}Arm"))[part]
        own = walking.ahead(walking.joint(f"{side}Foot") - walking.joint("Hips"))[part]
        across = walking.ahead(walking.joint(f"{other}Foot") - walking.joint("Hips"))[part]
        assert np.corrcoef(hand, own)[0, 1] < -0.8
        assert np.corrcoef(hand, across)[0, 1] > 0.8
        assert 25 < np.ptp(hand) < 60


def test_hips_are_highest_in_mid_stance_and_head_stays_level(walking):
    height = walking.joint("Hips")[:, 1]
    assert 90 < height.mean() < 95
    for a, b in brisk(walking, "Right"):
        cycle = height[a:b]
        assert 2.5 < np.ptp(cycle) < 7
        assert 0.15 < np.argmax(cycle[: len(cycle) // 2]) / len(cycle) < 0.4
    neck = walking.joint("Head") - walking.joint("Neck1")
    assert np.degrees(np.arccos(neck[:, 1] / np.linalg.norm(neck, axis=1))).max() < 15


ALL = ["walk-straight", "walk-turns", "walk-curves", "walk-speeds", "jog", "jog-turns", "crouch", "strafe"]
ALL += ["backward", "stop-and-go", "walk-jog-walk", "slopes", "steps", "uneven"]


@pytest.mark.parametrize("recipe", ALL)
def test_no_leg_is_stretched_and_nothing_jerks(written, recipe):
    clip = written("any", recipe=recipe)
    for side in SIDES:
        knee = clip.angles(side)["knee"]
        assert knee.min() > 4
        hip, ankle = clip.joint(f"{side}UpLeg"), clip.joint(f"{side}Foot")
        assert np.linalg.norm(hip - ankle, axis=1).max() < 0.9985 * 81
        assert np.abs(np.diff(knee)).max() < (27 if recipe == "steps" else 18)  # degrees a frame
    acceleration = np.diff(clip.positions, 2, axis=0) * 36  # m/s2
    assert np.linalg.norm(acceleration, axis=2).max() < (320 if recipe in ("steps", "jog") else 200)


@pytest.mark.parametrize("recipe", ALL)
def test_a_foot_that_is_down_does_not_slide(written, recipe):
    clip = written("any", recipe=recipe)
    for joint in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase"):
        still = clip.contact(joint)
        place = clip.joint(joint)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]])))
        lengths = []
        for a, b in edges.reshape(-1, 2):
            if b - a > 5:
                inner = place[a + 1 : b - 2]
                lengths.append(b - a)
                # A heel may begin to rise slowly; nothing else moves a joint that counts as down.
                assert np.ptp(inner[:, [0, 2]], axis=0).max() < 0.45
        assert len(lengths) >= 3


@pytest.mark.parametrize("recipe", ["crouch", "stop-and-go", "strafe", "backward"])
def test_gaits_look_like_themselves(written, recipe):
    clip = written("any", recipe=recipe, frames=1000)
    head, hips = clip.joint("Head")[:, 1], clip.joint("Hips")
    travel = np.diff(hips, axis=0)
    ahead = np.sum(travel * clip.facing[:-1], axis=1)
    left = np.cross([0.0, 1.0, 0.0], clip.facing[:-1])
    aside = np.sum(travel * left, axis=1)
    if recipe == "crouch":
        assert np.percentile(head, 20) < 95
        assert np.percentile(hips[:, 1], 20) < 65
    if recipe == "stop-and-go":
        assert (np.linalg.norm(travel, axis=1) < 0.1).mean() > 0.15
        assert ahead.max() > 3
    if recipe == "strafe":
        assert np.percentile(aside, 97) > 0.6
        assert np.percentile(aside, 3) < -0.6
        ankles = clip.joint("LeftFoot") - clip.joint("RightFoot")
        assert np.linalg.norm(ankles, axis=1).min() > 7
    if recipe == "backward":
        assert np.percentile(ahead, 10) < -0.7


@pytest.mark.parametrize("recipe", ["slopes", "steps", "uneven"])
def test_rough_ground_goes_up_and_down(written, recipe):
    clip = written("any", recipe=recipe)
    heights = []
    for joint in ("LeftToeBase", "RightToeBase"):
        heights += list(clip.joint(joint)[clip.contact(joint), 1])
    assert np.ptp(heights) > 8
    assert np.ptp(clip.joint("Hips")[:, 1]) > 12


def test_standing_has_slow_cycles_with_both_feet_still(written):
    clip = written("any", recipe="stop-and-go", frames=1500)
    hips = clip.joint("Hips")
    still = 0
    for a, b in clip.cycles("Right"):
        part = slice(a, b)
        if clip.down("Left")[part].all() and clip.down("Right")[part].all():
            still += 1
            assert (b - a) / 60 == pytest.approx(1.5, abs=0.15)
            assert np.ptp(hips[part, 0] + hips[part, 2]) > 0.3  # weight shifts
    assert still >= 2
