"""Landings and contacts found from the motion alone: exact on generated walks, whatever the body's size."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.labels import footfall
from hobble.labels.footfall import find_stance_contacts
from hobble.labels.phase import find_cycles, rows_of_landings


def landings(clip):
    return footfall.find_landings(footfall.find_swings(clip), len(clip))


@pytest.mark.parametrize("limp", [0.5, 0.3, 0.7])
@pytest.mark.parametrize(("half", "swing", "stride"), [(30, 24, 120.0), (20, 16, 200.0), (45, 40, 50.0)])
def test_every_landing_is_found_once(walker, limp, half, swing, stride):
    clip = walker(limp=limp, half=half, swing=swing, stride=stride)
    events = landings(clip)
    rights = np.arange(40, 590, 2 * half, dtype=float)
    truth = sorted([(r, 0) for r in rights] + [(r + 2 * half * limp, 1) for r in rights])
    truth = [(when, foot) for when, foot in truth if when < 590]
    assert [foot for _, foot in events] == [foot for _, foot in truth]
    late = np.array([when - true for (when, _), (true, _) in zip(events, truth, strict=True)])
    assert np.abs(late - late.mean()).max() <= 1.0
    assert -0.15 * swing < late.mean() < footfall.SETTLING_CM / 1.5


@pytest.mark.parametrize(("pause", "bouts"), [(30, 1), (90, 2)])
def test_only_a_long_pause_separates_two_bouts_of_walking(walker, pause, bouts):
    clip = walker(frames=400)
    both_down = 163
    order = np.repeat(np.arange(400), np.where(np.arange(400) == both_down, pause, 1))
    paused = clip.part(order)
    events = landings(paused)
    assert [foot for _, foot in events].count(-1) == bouts - 1
    assert len(events) - (bouts - 1) == len(landings(clip))
    cycles, _ = find_cycles(rows_of_landings(events), len(paused), "right", "drop")
    assert any(a < both_down < b for a, b in cycles) == (bouts == 1)


def test_a_sliding_foot_keeps_its_contact(walker):
    """As on a treadmill, the foot moves half a centimetre a frame; the original's rule calls that a swing."""
    clip = walker()
    sliding = replace(clip, root=clip.root + np.outer(np.arange(len(clip)), [0.0, 0.0, 0.5]))
    assert (find_stance_contacts(sliding) == find_stance_contacts(clip))[:, [0, 2]].mean() > 0.95
    assert not footfall.find_still_joints(sliding)[100:500].any()


def test_a_foot_held_in_the_air_has_no_contact(walker):
    clip = walker(start=700)
    heel = clip.skeleton.role("right_heel")
    translations = clip.translations.copy()
    up = 50.0 * np.clip((np.arange(len(clip)) - 100) / 30, 0, 1)
    translations[:, heel, 1] += up
    found = find_stance_contacts(replace(clip, translations=translations))
    assert found[:90].all()
    assert not found[150:, 2:].any()
    assert found[150:, :2].all()
