"""The types of responsivity.json.

The character walks laps of a closed track of waypoints. The results say how fast it is and how closely it
follows the track.
"""

from __future__ import annotations

from typing import TypedDict


class Spread(TypedDict):
    """Statistics of the time of a frame, ms. The time of a frame is the sum of its `Steps`.

    sd, median, p99: standard deviation, median and 99th percentile. whole_call: mean time of a call of
    `next_pose`, which also does some work outside the steps.
    """

    sd: float
    median: float
    p99: float
    whole_call: float


class Steps(TypedDict):
    """Milliseconds of each step of a frame. See `hobble.runtime.controller` for what each step does."""

    prepare: float
    input: float
    insert: float
    predict: float
    output: float
    update: float


class Milliseconds(Steps):
    """Mean time of each step, ms.

    total: mean time of a whole frame, ms. sd: standard deviation of the time of each step, ms. spread:
    statistics of the time of a whole frame.
    """

    total: float
    sd: Steps
    spread: Spread


class LapWalk(TypedDict):
    """How one lap of the track went.

    lap: its number, from 1. finished: whether all waypoints were reached. path_overshoot_cm,
    path_distance_cm: the largest and the mean distance from the line between waypoints. foot_slide_cm: mean
    slide of a toe in a stance; None without a stance. steps: number of stances. largest_turn_degrees: largest
    turn of a joint in one frame, as drawn. predicted_turn_degrees: largest turn of a joint in one frame, as
    the network predicts it, before the runtime limits turns. turns_held_back: number of frames in which the
    runtime limited a turn.
    """

    lap: int
    finished: bool
    frames: int
    seconds: float
    waypoints_reached: int
    path_overshoot_cm: float
    path_distance_cm: float
    foot_slide_cm: float | None
    steps: int
    largest_turn_degrees: float
    predicted_turn_degrees: float
    turns_held_back: int


class Lap(LapWalk):
    """How one lap went, and the time of a frame.

    milliseconds: measured while one character alone walks the beginning of the lap again.
    """

    milliseconds: Milliseconds


class LapPath(TypedDict):
    """The path of a lap: a place every `seconds_between` seconds.

    x, z: places, m. off_cm: largest distance from the line between waypoints since the previous stored place.
    """

    lap: int
    seconds_between: float
    x: list[float]
    z: list[float]
    off_cm: list[float]


class ModeResults(TypedDict):
    """All laps of one phase mode: a way to evaluate the network, such as cubic interpolation over the phase.

    waypoints: number of waypoints in all laps together. waypoints_reached, turns_held_back: sums over the
    laps. mean_lap_seconds: mean over the finished laps; None if there are none. foot_slide_cm: mean over the
    laps. path_overshoot_cm, largest_turn_degrees, predicted_turn_degrees: the largest values of all laps, see
    `LapWalk`.
    """

    mode: str
    laps: list[Lap]
    laps_finished: int
    waypoints_reached: int
    waypoints: int
    mean_lap_seconds: float | None
    path_overshoot_cm: float
    foot_slide_cm: float | None
    largest_turn_degrees: float
    predicted_turn_degrees: float
    turns_held_back: int
    milliseconds: Milliseconds


class PieceResults(TypedDict):
    """What one job of this measurement writes: all laps in one phase mode.

    laps: the results. runs: the paths of the first laps.
    """

    laps: ModeResults
    runs: list[LapPath]


class Track(TypedDict):
    """The closed track, a line through waypoints.

    waypoints: how many. metres: length of the line. gaits: the gait on the way to each waypoint. x, z: places
    of the waypoints, m.
    """

    waypoints: int
    metres: float
    gaits: list[str]
    x: list[float]
    z: list[float]


class Responsivity(ModeResults):
    """responsivity.json: the results of the configured phase mode, and in `modes` those of all modes.

    runs: the paths of the first laps in the configured mode. parameters: three counts of the weights and
    biases that one frame uses, None for a network without layers. `true`: the actual count; `table_6_1`: by
    the formula of Segerstedt (2021, table 6.1); `table_6_1_as_printed`: by the same formula, but with one
    hidden layer fewer than the network has, as in the numbers printed in that table. stored: mode -> how many
    numbers the network keeps in memory, each of `bytes_each` bytes. exact: the mode that evaluates the
    network without approximation. laps_other_modes: number of laps in each other mode.
    """

    configuration: str
    track: Track
    runs: list[LapPath]
    parameters: dict[str, int] | None
    stored: dict[str, int]
    bytes_each: int
    exact: str
    laps_other_modes: int
    modes: list[ModeResults]
