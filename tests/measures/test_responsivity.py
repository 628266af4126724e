"""Laps end at the last waypoint or after `lap_seconds`. Only the measured times differ from run to run."""

from typing import Any

import numpy as np
import pytest

from hobble.measures import responsivity_run as module
from hobble.measures.measure import flat_rows
from hobble.measures.responsivity import Options
from hobble.measures.responsivity_run import lap_starts, measure_responsivity, walk_laps
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import Waypoint

RUNTIME = Runtime(steering=1.0)


def track(*places: tuple[float, float]) -> tuple[Waypoint, ...]:
    return tuple(Waypoint(place, "walk", 1.5) for place in places)


def run(network, track, laps=2, seconds=10.0, mode="cubic", modes=("constant", "linear")) -> dict[str, Any]:
    options = Options(laps=laps, lap_seconds=seconds, modes=modes)
    runtime = Runtime(steering=1.0, mode=mode)
    return measure_responsivity(network, options, configuration="x", runtime=runtime, track=track)


def test_finished_laps_are_counted_and_timed(steady) -> None:
    """The waypoints are so near to each other that standing in their midst is arriving at each."""
    result = run(steady, track((0.0, 0.0), (30.0, 0.0), (60.0, 0.0)))
    rows = flat_rows(result["modes"], "laps", "mode")
    assert list(rows[0])[:4] == ["mode", "lap", "finished", "frames"]
    assert {"milliseconds_predict", "milliseconds_spread_p99"} <= set(rows[0])
    modes = ("constant", "linear", "cubic")
    assert [(row["mode"], row["lap"]) for row in rows] == [(mode, lap) for mode in modes for lap in (1, 2)]
    assert (result["laps_finished"], [lap["waypoints_reached"] for lap in result["laps"]]) == (2, [3, 3])
    assert all(lap["finished"] and lap["frames"] < 20 for lap in result["laps"])
    assert result["track"]["x"] == [0.0, 0.3, 0.6]


def test_a_lap_that_is_never_finished_ends_after_its_time(steady) -> None:
    """Figures glide straight on. The first passes the waypoint 4 m ahead, and never reaches the next, aside;
    the second starts at the first waypoint and glides straight towards the next."""
    result = run(steady, track((0.0, 400.0), (3000.0, 1400.0), (0.0, 0.0)), seconds=8.0)
    first, second = result["laps"]
    for lap in (first, second):
        assert (lap["frames"], lap["seconds"], lap["finished"]) == (480, 8.0, False)
    assert (first["waypoints_reached"], second["waypoints_reached"]) == (1, 0)
    past = 480 * 1.5 - 400
    assert first["path_overshoot_cm"] == pytest.approx(past * 3 / np.sqrt(3**2 + 1), abs=30)
    assert second["path_overshoot_cm"] == pytest.approx(0, abs=1e-3)
    assert (result["waypoints_reached"], result["waypoints"]) == (1, 6)
    path = result["runs"][0]  # along z from the third waypoint, a quarter of a second from place to place
    np.testing.assert_allclose(path["x"], np.zeros(480 // 15), atol=0.02)
    np.testing.assert_allclose(np.diff(path["z"])[2:], 15 * 0.015, atol=0.02)


def test_laps_begin_at_one_waypoint_after_another_and_in_later_rounds_further_ahead() -> None:
    """A square of 30 m: with ten laps there are three rounds, which start 0, 10/3 and 20/3 m ahead."""
    corners = ((0.0, 3000.0), (3000.0, 3000.0), (3000.0, 0.0), (0.0, 0.0))
    places, facing, waypoints = zip(*lap_starts(track(*corners), 10), strict=True)
    assert waypoints == (3, 0, 1, 2, 3, 0, 1, 2, 3, 0)
    np.testing.assert_allclose(places[:4], [corners[n] for n in (3, 0, 1, 2)])
    np.testing.assert_allclose(places[4:6], [[1000 / 3, 0], [0, 3000 - 1000 / 3]])
    np.testing.assert_allclose(places[8:], [[2000 / 3, 0], [0, 3000 - 2000 / 3]])
    # The first faces the waypoint after its own, the fifth its own.
    np.testing.assert_allclose([facing[0], facing[4]], [[0, 3000], [-3000, 0]])


def test_the_way_to_the_waypoint_where_a_lap_begins_does_not_belong_to_it(steady) -> None:
    """Of three laps on a line of 40 m, the third starts 5 m ahead of its waypoint. It glides by, so it counts
    from within a metre of it. The next waypoint is behind it, so it glides on at half the speed."""
    *_, (lap, path, seconds) = walk_laps(steady, RUNTIME, 3, 300, track((0.0, 4000.0), (0.0, 0.0)))
    assert (lap["frames"], lap["waypoints_reached"]) == (300, 0)
    assert (path["z"][0], path["z"][-1]) == pytest.approx((1.0, 1.0 - 0.5 * 0.015 * 285), abs=0.03)
    assert seconds.shape == (300, len(STEPS))


def test_each_mode_runs_its_own_laps(network) -> None:
    ahead = track((0.0, 400.0), (0.0, 0.0))
    result = run(network, ahead, laps=1, seconds=3.0)
    modes = {entry["mode"]: entry for entry in result["modes"]}
    assert list(modes) == ["constant", "linear", "cubic"]
    assert result["mode"] == "cubic"
    assert all(result[key] == value for key, value in modes["cubic"].items())
    # Weights looked up otherwise move the figure a little otherwise.
    ways = {mode: entry["laps"][0]["path_distance_cm"] for mode, entry in modes.items()}
    assert len(set(ways.values())) == 3
    (alone,) = run(network, ahead, laps=1, seconds=3.0, mode="linear", modes=())["modes"]
    assert (alone["mode"], alone["laps"][0]["path_distance_cm"]) == ("linear", ways["linear"])


def test_known_times_of_steps_give_known_medians() -> None:
    """Two frames: steps of 1 to 6 ms, and of twice that."""
    steps = np.arange(1.0, 7.0)
    found = module.milliseconds(np.array([steps, 2 * steps]) / 1000)
    assert [found[step] for step in STEPS] == pytest.approx(1.5 * steps)
    assert found["total"] == pytest.approx(31.5)
    assert found["spread"] == pytest.approx({"median": 31.5, "p99": 41.79})
