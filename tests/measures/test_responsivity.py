"""Laps end at the last waypoint or after `lap_seconds`. Only the measured times differ from run to run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hobble.measures import responsivity_run as module
from hobble.measures.measure import flat_rows
from hobble.measures.responsivity import Options
from hobble.measures.responsivity_run import (
    lap_starts,
    measure_responsivity,
    parameter_counts,
    turn_was_limited,
    walk_laps,
)
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import Waypoint

RUNTIME = Runtime(steering=1.0)
# So near to each other that standing in their midst is arriving at each.
NEAR = tuple(Waypoint((x, 0.0), "walk", 2.5) for x in (0.0, 30.0, 60.0))
# Straight ahead of the start, 4 m away, where a figure that glides straight on comes by; then the start.
AHEAD = (Waypoint((0.0, 400.0), "walk", 1.5), Waypoint((0.0, 0.0), "walk", 1.5))
# Likewise, and then aside of the way that it glides on.
ASIDE = (
    Waypoint((0.0, 400.0), "walk", 1.5),
    Waypoint((3000.0, 1400.0), "walk", 1.5),
    Waypoint((0.0, 0.0), "walk", 1.5),
)


def without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k != "milliseconds"}
    return [without_times(v) for v in value] if isinstance(value, list) else value


def run(network, track, laps=2, seconds=10.0) -> dict[str, Any]:
    options = Options(laps=laps, lap_seconds=seconds)
    return measure_responsivity(network, options, configuration="x", runtime=RUNTIME, track=track)


def test_finished_laps_are_counted_and_timed(steady) -> None:
    result = run(steady, NEAR)
    rows = flat_rows(result["modes"], "laps", "mode")
    assert list(rows[0])[:4] == ["mode", "lap", "finished", "frames"]
    assert {"milliseconds_predict", "milliseconds_sd_predict", "milliseconds_spread_p99"} <= set(rows[0])
    modes = ("constant", "linear", "cubic")
    assert [(row["mode"], row["lap"]) for row in rows] == [(mode, lap) for mode in modes for lap in (1, 2)]
    assert result["laps_finished"] == 2
    assert [lap["waypoints_reached"] for lap in result["laps"]] == [3, 3]
    assert all(lap["finished"] and lap["frames"] < 20 for lap in result["laps"])
    assert (result["track"]["waypoints"], result["track"]["metres"]) == (3, 1.2)
    assert (result["track"]["x"], result["track"]["z"]) == ([0.0, 0.3, 0.6], [0.0, 0.0, 0.0])


def test_only_turns_that_were_limited_count_as_held_back() -> None:
    rng = np.random.default_rng(3)
    taken = rng.normal(size=(5, 4, 4))
    taken /= np.linalg.norm(taken, axis=-1, keepdims=True)
    predicted = -taken  # the same rotations
    assert not turn_was_limited(predicted, taken).any()
    predicted[2, 1] = predicted[2, 2]
    assert turn_was_limited(predicted, taken).tolist() == [False, False, True, False, False]


def test_a_lap_that_is_never_finished_ends_after_its_time(steady) -> None:
    result = run(steady, ASIDE, laps=2, seconds=8.0)
    for lap in result["laps"]:
        assert lap["frames"] == 480
        assert lap["seconds"] == 8.0
        assert not lap["finished"]
    # The first passes the first waypoint after 200 frames of 1.5 cm. It never reaches the second one, aside.
    # The second starts at the first waypoint, faces the second one and glides straight toward it.
    first, second = result["laps"]
    assert (first["waypoints_reached"], second["waypoints_reached"]) == (1, 0)
    past = 480 * 1.5 - 400
    assert first["path_overshoot_cm"] == pytest.approx(past * 3 / np.sqrt(3**2 + 1), abs=30)
    assert second["path_overshoot_cm"] == pytest.approx(0, abs=1e-3)
    assert (result["waypoints_reached"], result["waypoints"]) == (1, 6)
    run_of = result["runs"][0]
    # It glides along z from the third waypoint, a quarter of a second from place to place.
    assert len(run_of["x"]) == 480 / 15
    np.testing.assert_allclose(run_of["x"], 0, atol=0.02)
    np.testing.assert_allclose(np.diff(run_of["z"])[2:], 15 * 0.015, atol=0.02)
    assert max(run_of["off_cm"]) == pytest.approx(first["path_overshoot_cm"], abs=25)


def test_laps_begin_at_one_waypoint_after_another_and_in_later_rounds_further_ahead() -> None:
    """A square of 30 m: with ten laps there are three rounds, which start 0, 10/3 and 20/3 m ahead."""
    corners = ((0.0, 3000.0), (3000.0, 3000.0), (3000.0, 0.0), (0.0, 0.0))
    square = [Waypoint(place, "walk", 2.5) for place in corners]
    places, facing, waypoints = zip(*lap_starts(square, 10), strict=True)
    assert waypoints == (3, 0, 1, 2, 3, 0, 1, 2, 3, 0)
    np.testing.assert_allclose(places[:4], [corners[n] for n in (3, 0, 1, 2)])
    np.testing.assert_allclose(places[4:6], [[1000 / 3, 0], [0, 3000 - 1000 / 3]])
    np.testing.assert_allclose(places[8:], [[2000 / 3, 0], [0, 3000 - 2000 / 3]])
    # The first faces the waypoint after its own, the fifth its own.
    np.testing.assert_allclose([facing[0], facing[4]], [[0, 3000], [-3000, 0]])


def test_the_way_to_the_waypoint_where_a_lap_begins_does_not_belong_to_it(steady) -> None:
    """Of three laps on a line of 40 m, the third starts 5 m ahead of its waypoint. It glides by, so it counts
    from within a metre of it."""
    line = (Waypoint((0.0, 4000.0), "walk", 1.5), Waypoint((0.0, 0.0), "walk", 1.5))
    (*_, (lap, path, seconds)) = walk_laps(steady, RUNTIME, 3, 300, line)
    assert (lap["frames"], lap["waypoints_reached"]) == (300, 0)
    assert seconds.shape == (300, len(STEPS) + 1)
    assert (seconds > 0).all()
    assert (seconds[:, -1] >= seconds[:, :-1].sum(axis=1)).all()
    assert path["z"][0] == pytest.approx(1.0, abs=0.03)
    # The last place that is kept is 285 frames later. The next waypoint is behind it, so it glides at half
    # the speed.
    assert path["z"][-1] == pytest.approx(1.0 - 0.5 * 0.015 * 285, abs=0.03)


def test_each_mode_runs_its_own_laps(network) -> None:
    result = run(network, AHEAD, laps=1, seconds=3.0)
    modes = {entry["mode"]: entry for entry in result["modes"]}
    assert list(modes) == ["constant", "linear", "cubic"]
    assert result["mode"] == RUNTIME.mode == "cubic"
    assert all(result[key] == value for key, value in modes["cubic"].items())
    # Weights looked up otherwise move the figure a little otherwise.
    ways = {mode: entry["laps"][0]["path_distance_cm"] for mode, entry in modes.items()}
    assert len(set(ways.values())) == 3
    options, runtime = (
        Options(laps=1, lap_seconds=3.0, modes=()),
        RUNTIME.model_copy(update={"mode": "linear"}),
    )
    some = measure_responsivity(network, options, configuration="x", runtime=runtime, track=AHEAD)
    assert [entry["mode"] for entry in some["modes"]] == ["linear"]
    assert without_times(some["laps"]) == without_times(modes["linear"]["laps"])


def test_known_times_of_steps_give_known_medians() -> None:
    """Two frames: steps of 1 to 6 ms, and of twice that. The whole call takes 1 ms more."""
    steps = np.arange(1.0, 7.0)
    seconds = np.array([[*steps, 22.0], [*(2 * steps), 43.0]]) / 1000
    found = module.milliseconds(seconds)
    assert [found[step] for step in STEPS] == pytest.approx(1.5 * steps)
    assert [found["sd"][step] for step in STEPS] == pytest.approx(0.5 * steps)
    assert found["total"] == pytest.approx(31.5)
    assert found["spread"] == pytest.approx({"sd": 10.5, "median": 31.5, "p99": 41.79, "whole_call": 32.5})


def test_published_counts_are_compared_with_ours() -> None:
    published = {
        (342, 512, 512, 311): (597_815, 335_501),
        (342, 512, 512, 512, 311): (860_471, 598_157),
    }
    for sizes, (true, printed) in published.items():
        counts = parameter_counts(sizes)
        assert counts["true"] == true
        assert counts["table_6_1_as_printed"] == printed
    # AVA: 191 joints.
    ava = parameter_counts((1302, 512, 512, 1751))
    assert ava["true"] == 1_828_055
    assert ava["table_6_1_as_printed"] == 1_566_701
