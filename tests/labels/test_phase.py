"""Phase, footsteps and cycles: exact if given, and the same in both directions of conversion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.labels.phase import (
    dropped_frames,
    find_cycles,
    footsteps_of_phase,
    mirrored_footsteps,
    phase_of_footsteps,
    rows_of_landings,
)

STEPS = np.array([[70.0, 95.0, 0], [120.0, 150.0, 0], [175.0, 200.0, 0], [230.0, np.nan, 0]])


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs((a - b + 0.5) % 1.0 - 0.5)


MARGINS = [("extend", 1, 164, 3), ("extend", 0.5, 164, 3), ("extend", 0, 164, 2), ("extend", 1, 163, 2)]
MARGINS += [("drop", 70, 291, 2), ("drop", 70, 292, 3), ("drop", 59.5, 300, 3), ("drop", 59, 300, 2)]


@pytest.mark.parametrize(("margins", "first", "frames", "kept"), MARGINS)
def test_a_cycle_near_an_end_of_the_clip_is_left_out(margins, first, frames, kept):
    """With `extend` it needs one frame before and two after it, with `drop` 60 and 61."""
    steps = STEPS - [0, 0, 0] if margins == "drop" else STEPS - [69, 69, 0]
    steps[0, 0] = first
    cycles, dropped = find_cycles(steps, frames, "right", margins)
    assert (len(cycles), dropped) == (kept, 3 - kept)


@pytest.mark.parametrize(("line", "kept"), [(0, [1, 2]), (1, [2]), (2, [0]), (3, [0, 1])])
def test_a_marked_line_drops_the_cycles_on_both_sides_of_it(line, kept):
    steps = STEPS.copy()
    steps[line, 2] = 1
    whole = find_cycles(STEPS, 300, "right", "drop")[0]
    assert find_cycles(steps, 300, "right", "drop")[0].tolist() == whole[kept].tolist()
    assert dropped_frames(steps, 300).sum() == (0 if line == 3 else whole[line, 1] - whole[line, 0])


def test_landings_become_rows_that_end_where_a_foot_lands_twice():
    rows = rows_of_landings([(1, 1), (5, 0), (9, 1), (13, 1), (20, 0), (np.nan, -1), (40, 0)])
    expected = [[np.nan, 1, 0], [5, 9, 0], [np.nan, np.nan, 1], [np.nan, 13, 0], [20, np.nan, 0]]
    expected += [[np.nan, np.nan, 1], [40, np.nan, 0]]
    np.testing.assert_equal(rows, np.array(expected, float))
    assert rows_of_landings([(np.nan, -1)]).shape == (0, 3)


@st.composite
def bouts(draw):
    """Footsteps of one to three bouts of walking with uneven steps."""
    events, when = [], float(draw(st.integers(0, 30)))
    for bout in range(draw(st.integers(1, 3))):
        foot = draw(st.integers(0, 1))
        if bout:
            events.append((np.nan, -1))
            when += draw(st.integers(80, 200))
        for _ in range(draw(st.integers(2, 9))):
            events.append((when, foot))
            when += draw(st.integers(4, 60))
            foot = 1 - foot
    return rows_of_landings(events), int(when) + 70


@given(bouts())
@settings(max_examples=60, deadline=None)
def test_phase_always_advances_and_gives_back_its_footsteps(case):
    steps, frames = case
    phase, known = phase_of_footsteps(steps, frames)
    assert ((phase >= 0) & (phase < 1)).all()
    assert ((np.diff(phase) % 1.0) <= 0.5).all()
    still = np.where(known, phase, 0.0)
    back, moving = footsteps_of_phase(still)
    landed = np.sort(steps[:, :2][np.isfinite(steps[:, :2])])
    found = np.sort(back[:, :2][np.isfinite(back[:, :2])])
    for when in landed:
        assert np.abs(found - when).min() < 1.0
    assert len(find_cycles(steps, frames, "right", "drop")[0]) <= len(steps)
    assert not (moving & ~known)[:-1].sum() > len(landed)


@given(bouts())
@settings(max_examples=60, deadline=None)
def test_mirroring_footsteps_shifts_phase_by_half_a_cycle(case):
    steps, frames = case
    phase, known = phase_of_footsteps(steps, frames)
    other, known_other = phase_of_footsteps(mirrored_footsteps(steps), frames)
    assert (known == known_other).all()
    assert apart(other[known], phase[known] + 0.5) == pytest.approx(0, abs=1e-9)
    twice = mirrored_footsteps(mirrored_footsteps(steps))
    np.testing.assert_equal(twice, steps)
    left = find_cycles(steps, frames, "left", "drop")[0]
    assert find_cycles(mirrored_footsteps(steps), frames, "right", "drop")[0].tolist() == left.tolist()
