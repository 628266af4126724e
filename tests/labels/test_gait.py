"""Gaits of clips without gait files, and crouching in flat clips."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.labels import gait as g
from hobble.labels.clip_labels import GAITS
from hobble.labels.footfall import find_stance_contacts


def automatic(clip, dominant=None):
    return g.automatic_gait(clip, find_stance_contacts(clip), dominant)


def bouncing(clip, height):
    """The clip with hips that move up and down by `height` cm over feet that stay."""
    root, feet = clip.root.copy(), clip.translations.copy()
    root[:, 1] += height * np.cos(2 * np.pi * np.arange(len(clip)) / 20)
    for role in ("left_heel", "right_heel"):
        feet[:, clip.skeleton.role(role), 1] -= root[:, 1] - clip.root[:, 1]
    return replace(clip, root=root, translations=feet)


def test_bouncing_hips_and_feet_in_the_air_are_a_jog(walker):
    jog = bouncing(walker(half=20, swing=34, stride=160.0), 4.0)
    assert (automatic(jog)[60:-60].argmax(axis=1) == g.JOG).all()


def test_the_stated_gait_decides_doubtful_motion(walker):
    between = bouncing(walker(half=20, swing=32, stride=160.0), 0.5)
    assert (automatic(between, "walk")[60:-60].argmax(axis=1) == g.WALK).all()
    assert (automatic(between, "jog")[60:-60].argmax(axis=1) == g.JOG).all()


def test_low_head_and_hips_are_a_crouch_and_a_bow_is_not(walker):
    clip = walker()
    low = clip.root - np.array([0.0, 38.0, 0.0])
    feet = clip.translations.copy()
    for role in ("left_heel", "right_heel"):
        feet[:, clip.skeleton.role(role), 1] += 38.0
    crouch = replace(clip, root=low, translations=feet)
    assert (automatic(crouch)[60:-60].argmax(axis=1) == g.CROUCH).all()
    bow = clip.translations.copy()
    bow[:, clip.skeleton.role("chest"), 1] -= 40.0
    assert (automatic(replace(clip, translations=bow))[60:-60].argmax(axis=1) == g.WALK).all()


@pytest.mark.parametrize("dominant", ["jump", "bump"])
def test_only_the_data_set_marks_jumps(walker, dominant):
    shares = automatic(walker(frames=500, start=200), dominant)
    assert (shares[:150].argmax(axis=1) == g.STAND).all()
    assert (shares[230:].argmax(axis=1) == GAITS.index(dominant)).all()
    assert shares.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize(
    ("head", "crouch"), [(150.0, 0.0), (130.0, 0.0), (105.0, 0.5), (80.0, 1.0), (60.0, 1.0)]
)
def test_flat_ground_overwrites_crouch_alone(walker, head, crouch):
    clip = walker(frames=5)
    rest = clip.positions[0, clip.skeleton.role("head"), 1]
    moved = replace(clip, root=clip.root + np.array([0.0, head - rest, 0.0]))
    before = np.full((5, 6), 0.25)
    after = g.overwrite_crouch(before, moved)
    assert after[:, g.CROUCH] == pytest.approx(crouch)
    assert (np.delete(after, g.CROUCH, axis=1) == 0.25).all()
    assert (before == 0.25).all()
