"""Laps end at the last waypoint or after `lap_seconds`. Only the measured times differ from run to run."""

from typing import Any

import numpy as np
import pytest

from hobble.measures.measure import flat_rows
from hobble.measures.responsivity import Options
from hobble.measures.responsivity_run import lap_starts, measure_responsivity
from hobble.runtime import Runtime
from hobble.runtime.waypoints import Waypoint

RUNTIME = Runtime(steering=0.0, mode="cubic")


def track(*places: tuple[float, float]) -> tuple[Waypoint, ...]:
    return tuple(Waypoint(place, "walk", 1.5) for place in places)


def run(network, track, seconds: float) -> dict[str, Any]:
    options = Options(laps=2, lap_seconds=seconds, modes=("constant", "linear"))
    return measure_responsivity(network, options, configuration="x", runtime=RUNTIME, track=track)


def test_finished_laps_are_counted_and_timed(steady) -> None:
    """The waypoints are so near to each other that standing in their midst is arriving at each."""
    result = run(steady, track((0.0, 0.0), (30.0, 0.0), (60.0, 0.0)), 10.0)
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
    result = run(steady, track((0.0, 400.0), (3000.0, 1400.0), (0.0, 0.0)), 8.0)
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
