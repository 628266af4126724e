"""Landings found from the motion alone: exact on generated walks, and no extra ones on limps and pauses."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.labels.footfall import SETTLING_CM, find_landings, find_swings
from hobble.labels.options import LabelOptions
from hobble.labels.phase import find_cycles, rows_of_landings


def found(clip):
    swings = find_swings(clip, LabelOptions())
    return swings, find_landings(swings, len(clip), 5)


@pytest.mark.parametrize("limp", [0.5, 0.3, 0.7])
@pytest.mark.parametrize(("half", "swing", "stride"), [(30, 24, 120.0), (20, 16, 200.0), (45, 40, 50.0)])
def test_every_landing_is_found_once(walker, limp, half, swing, stride):
    clip = walker(limp=limp, half=half, swing=swing, stride=stride)
    _, events = found(clip)
    rights = np.arange(40, 590, 2 * half, dtype=float)
    truth = sorted([(r, 0) for r in rights] + [(r + 2 * half * limp, 1) for r in rights])
    truth = [(when, foot) for when, foot in truth if when < 590]
    assert [foot for _, foot in events] == [foot for _, foot in truth]
    late = np.array([when - true for (when, _), (true, _) in zip(events, truth, strict=True)])
    assert np.abs(late - late.mean()).max() <= 1.0
    assert -0.15 * swing < late.mean() < SETTLING_CM / 1.5


@pytest.mark.parametrize(("pause", "bouts"), [(30, 1), (90, 2)])
def test_only_a_long_pause_separates_two_bouts_of_walking(walker, pause, bouts):
    clip = walker(frames=400)
    both_down = 163
    order = np.repeat(np.arange(400), np.where(np.arange(400) == both_down, pause, 1))
    paused = replace(
        clip,
        rotations=clip.rotations[order],
        root=clip.root[order],
        translations=clip.translations[order],
    )
    _, events = found(paused)
    assert [foot for _, foot in events].count(-1) == bouts - 1
    assert len(events) - (bouts - 1) == len(found(clip)[1])
    cycles, _ = find_cycles(rows_of_landings(events), len(paused), "right", "drop")
    assert any(a < both_down < b for a, b in cycles) == (bouts == 1)
