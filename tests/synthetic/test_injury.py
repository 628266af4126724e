"""Every injury grows with its severity, and one can be told from another."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core.skeleton import other_side
from hobble.synthetic.clip import walk
from hobble.synthetic.gait import healthy_style
from hobble.synthetic.injury import SEVERITIES, at_footsteps, hurt, schedule, slowing
from hobble.synthetic.links import LEFT, LINKS, RIGHT
from hobble.synthetic.path import walk_path
from hobble.synthetic.recipes import Segment

LEGS = [link for link, (part, _) in LINKS.items() if part in ("thigh", "shank", "foot")]
ARMS = [link for link, (part, _) in LINKS.items() if part.endswith("arm")]


@pytest.fixture(scope="module")
def measured(holden31):
    """link -> measurement -> its values at severities 0, 3, 5, 7, 10, in forty seconds of walking."""
    cache = {}

    def measure(link):
        if link not in cache:
            cache[link] = _measure(
                walk("m", holden31, [Segment("walk", 130, seconds=40)], 2400, link, "flat", 60, 1)
            )
        return cache[link]

    return measure


def _measure(result):
    places = dict(zip(result.clip.skeleton.joints, np.moveaxis(result.clip.positions, 1, 0), strict=True))
    side = "Left" if LINKS[result.link][1] == LEFT else "Right"
    other = other_side(side)
    down = {}
    for s in (side, other):
        moved = [np.sum(np.diff(places[f"{s}{j}"], axis=0) ** 2, axis=1) for j in ("Foot", "ToeBase")]
        down[s] = np.append(np.min(moved, axis=0) < 0.02, False)
    lands = result.left if side == "Left" else result.right
    out = {}
    ends = [start for start, _ in result.status[1:]] + [len(result.clip)]
    for (start, _), end in zip(result.status, ends, strict=True):
        inside = [f for f in lands if start + 90 <= f < end - 70]
        part = slice(inside[0], inside[-1])
        for name, value in _values(places, down, side, other, inside, part).items():
            out.setdefault(name, []).append(value)
    return out


def _values(places, down, side, other, lands, part):
    left = np.array([1.0, 0.0, 0.0])  # the walk goes along +Z
    outward = left if side == "Left" else -left
    trunk = places["Neck1"] - places["Hips"]
    hand = places[f"{side}Hand"] - places[f"{side}Arm"]
    upper, lower = (
        places[f"{side}{a}"] - places[f"{side}{b}"] for a, b in (("ForeArm", "Arm"), ("Hand", "ForeArm"))
    )
    thigh, shank = (
        places[f"{side}{a}"] - places[f"{side}{b}"] for a, b in (("Leg", "UpLeg"), ("Foot", "Leg"))
    )
    foot = places[f"{side}ToeBase"] - places[f"{side}Foot"]
    alone = (down[side] & ~down[other])[part]
    seconds = (part.stop - part.start) / 60
    cycles = len(lands) - 1
    step = [(places[f"{side}Foot"][f] - places[f"{other}Foot"][f])[2] for f in lands[:-1]]
    return {
        "speed": np.ptp(places["Hips"][[part.start, part.stop], 2]) / seconds,
        "stance": down[side][part].sum() / 60 / cycles,
        "stance share": down[side][part].mean(),
        "asymmetry": down[other][part].sum() / down[side][part].sum(),
        "step": np.mean(step),
        "knee": np.ptp(_angle(thigh, shank)[part]),
        "lean": np.degrees(np.mean(np.arctan2(trunk @ outward, trunk[:, 1])[part][alone])),
        "bow": np.degrees(np.mean(np.arctan2(trunk[:, 2], trunk[:, 1])[part])),
        "hand swing": np.ptp(hand[part, 2]),
        "elbow": np.mean(_angle(upper, lower)[part]),
        "toe out": np.mean(foot[part] @ outward),
        "heel": np.percentile(places[f"{side}Foot"][part, 1], 97),
    }


def _angle(a, b):
    cosine = np.sum(a * b, axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def falls(values, by, noise=0.0):
    """Never up by more than a twentieth of the whole change (or `noise`), and down by `by` in all."""
    slack = max(noise, 0.05 * abs(values[0] - values[-1]))
    return all(b < a + slack for a, b in itertools.pairwise(values)) and values[0] - values[-1] > by


def grows(values, by):
    return falls([-v for v in values], by)


@pytest.mark.parametrize("link", LEGS)
def test_a_hurt_leg_stands_and_steps_shorter_bends_less_and_is_leaned_over(measured, link):
    m = measured(link)
    assert falls(m["speed"], 35)
    assert falls(m["stance share"], 0.07)
    assert falls(m["stance"], 0.03, noise=0.01)  # a 60 Hz frame in two cycles
    assert grows(m["asymmetry"], 0.2)
    assert falls(m["step"], 15)
    assert falls(m["knee"], 14)
    assert grows(m["lean"], 2)


@pytest.mark.parametrize("link", ARMS)
def test_a_hurt_arm_is_held_still_and_bent(measured, link):
    m = measured(link)
    assert falls(m["hand swing"], 25)
    assert m["hand swing"][-1] < 6
    assert grows(m["elbow"], 30)
    assert falls(m["speed"], 8)


def test_a_hurt_back_is_bent_forward_and_stiff_on_both_sides(measured):
    m = measured("LowerBack-Spine")
    assert grows(m["bow"], 10)
    assert falls(m["hand swing"], 15)
    assert falls(m["speed"], 35)
    assert falls(m["step"], 8)
    assert max(abs(np.array(m["asymmetry"]) - 1)) < 0.03


def test_injuries_of_one_leg_can_be_told_apart(measured):
    thigh, shank, foot = (measured(f"{link}") for link in LEGS[::2])
    assert thigh["lean"][-1] > shank["lean"][-1] + 2 > foot["lean"][-1] + 3
    assert foot["toe out"][-1] > shank["toe out"][-1] + 2 > thigh["toe out"][-1] + 2.5
    assert thigh["heel"][-1] > shank["heel"][-1] + 1
    upper, fore = measured("LeftArm-LeftForeArm"), measured("LeftForeArm-LeftHand")
    assert fore["elbow"][-1] > upper["elbow"][-1] + 30


@pytest.mark.parametrize("link", LEGS + ARMS)
def test_left_and_right_are_mirror_images(link):
    path = walk_path([Segment("walk", 120)], 240, 60)
    severity = np.full(len(path), 7.0)
    a, b = link.split("-")
    mirrored = f"{other_side(a)}-{other_side(b)}"
    one = hurt(healthy_style(path), severity, link)
    two = hurt(healthy_style(path), severity, mirrored)
    for name, value in dataclasses.asdict(one).items():
        there = getattr(two, name)
        if name == "lag":
            np.testing.assert_allclose(value - 0.5, 0.5 - there, atol=1e-12)
        else:
            np.testing.assert_allclose(value, there[:, [RIGHT, LEFT]] if value.ndim == 2 else there)


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(sorted(LINKS)), st.floats(0, 10), st.floats(0, 10))
def test_effects_are_in_proportion_to_severity(link, low, high):
    path = walk_path([Segment("walk", 120)], 60, 60)
    healthy = healthy_style(path)
    styles = [hurt(healthy, np.full(len(path), s), link) for s in (0.0, low, high, 10.0)]
    for field in dataclasses.fields(healthy):
        none, a, b, full = (getattr(s, field.name) for s in styles)
        np.testing.assert_array_equal(none, getattr(healthy, field.name))
        np.testing.assert_allclose((b - a), (full - none) * (high - low) / 10, atol=1e-9)
    assert slowing(np.array([0.0]), link) == 1
    assert 0.4 < slowing(np.array([10.0]), link) < 1


def test_every_severity_has_its_stretch_and_moves_to_a_footstep():
    stretches = schedule(1000)
    assert tuple(s for _, s in stretches) == SEVERITIES
    assert min(np.diff([start for start, _ in stretches] + [1000])) > 120
    moved = at_footsteps(stretches, range(0, 1000, 37))
    assert moved[0] == stretches[0]
    assert all(frame % 37 == 0 for frame, _ in moved[1:])
    assert max(abs(a - b) for (a, _), (b, _) in zip(moved, stretches, strict=True)) <= 18


def test_stretches_that_would_begin_in_the_same_frame_are_one():
    stretches = [(0, 0), (40, 3), (80, 5), (120, 7), (160, 10)]
    assert at_footsteps(stretches, [50, 130]) == [(0, 0), (50, 5), (130, 10)]
    assert at_footsteps([(0, 0), (10, 3), (80, 10)], [0, 90]) == [(0, 3), (90, 10)]
