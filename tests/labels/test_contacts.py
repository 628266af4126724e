"""Contacts of generated walks, whose stances are known to the frame, and of bodies of other sizes."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.labels.contacts import find_stance_contacts, find_still_joints
from hobble.labels.options import LabelOptions


def truth(half: int, swing: int, frames: int, start: int) -> np.ndarray:
    """(F,) whether the right foot of `walker` is on the ground."""
    t = np.arange(frames)
    in_the_air = [(t > landing - swing) & (t < landing) for landing in range(start, frames - 10, 2 * half)]
    return ~np.any(in_the_air, axis=0)


@pytest.mark.parametrize(("half", "swing", "stride"), [(30, 24, 120.0), (20, 16, 160.0), (45, 40, 60.0)])
def test_stances_of_a_made_walk_begin_and_end_at_the_right_frames(walker, half, swing, stride):
    """Swings begin and end slowly, so that their first and last frames look like a stance."""
    found = find_stance_contacts(walker(half=half, swing=swing, stride=stride), LabelOptions())
    expected = truth(half, swing, 600, 40)
    assert found[expected][:, 2].all()
    assert (found[:, 2] != expected).mean() < 0.15


@pytest.mark.parametrize("size", [0.5, 0.8, 1.3])
def test_contacts_do_not_depend_on_body_size(walker, size):
    clip = walker()
    skeleton = replace(clip.skeleton, offsets=size * clip.skeleton.offsets)
    other = replace(clip, skeleton=skeleton, root=size * clip.root, translations=size * clip.translations)
    assert (find_stance_contacts(other, LabelOptions()) == find_stance_contacts(clip, LabelOptions())).all()


def test_a_sliding_foot_keeps_its_contact(walker):
    """As on a treadmill, the foot moves half a centimetre a frame; the original's rule calls that a swing."""
    clip = walker()
    sliding = replace(clip, root=clip.root + np.outer(np.arange(len(clip)), [0.0, 0.0, 0.5]))
    assert (find_stance_contacts(sliding, LabelOptions()) == find_stance_contacts(clip, LabelOptions()))[
        :, [0, 2]
    ].mean() > 0.95
    assert not find_still_joints(sliding, 0.02)[100:500].any()


def test_a_foot_held_in_the_air_has_no_contact(walker):
    clip = walker(start=700)
    heel = clip.skeleton.role("right_heel")
    translations = clip.translations.copy()
    up = 50.0 * np.clip((np.arange(len(clip)) - 100) / 30, 0, 1)
    translations[:, heel, 1] += up
    found = find_stance_contacts(replace(clip, translations=translations), LabelOptions())
    assert found[:90].all()
    assert not found[150:, 2:].any()
    assert found[150:, :2].all()
