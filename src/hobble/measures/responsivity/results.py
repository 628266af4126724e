"""The types of responsivity.json."""

from __future__ import annotations

from typing import TypedDict


class Spread(TypedDict):
    """Of a frame's total: standard deviation, median, 99th percentile. whole_call: mean of a whole call."""

    sd: float
    median: float
    p99: float
    whole_call: float


class Steps(TypedDict):
    """Milliseconds of each step of a frame."""

    prepare: float
    input: float
    insert: float
    predict: float
    output: float
    update: float


class Milliseconds(Steps):
    """Means of the steps and of their `total`. sd: standard deviations of the steps. spread: of the total,
    and the mean of a whole call.
    """

    total: float
    sd: Steps
    spread: Spread


class LapWalk(TypedDict):
    """How one lap went. Distances in cm from the line between waypoints; turns in degrees."""

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
    """One lap, and the times of its first frames."""

    milliseconds: Milliseconds


class Run(TypedDict):
    """The path of a lap: `x`, `z`, m, and `off_cm` from the line between waypoints."""

    lap: int
    seconds_between: float
    x: list[float]
    z: list[float]
    off_cm: list[float]


class OfMode(TypedDict):
    """All laps of one phase mode. waypoints: how many there are in all laps."""

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


class LapsOfMode(TypedDict):
    """The file of a piece: all laps of a phase mode, and the paths of the first ones."""

    laps: OfMode
    runs: list[Run]


class Track(TypedDict):
    """The track. x, z: m. metres: its length."""

    waypoints: int
    metres: float
    gaits: list[str]
    x: list[float]
    z: list[float]


class Responsivity(OfMode):
    """responsivity.json. The values of the runtime's own mode are at the top, `modes` has those of all.

    runs: the paths of the first laps in the own mode. parameters: see `parameter_counts`; None for a network
    without layers. stored: mode -> numbers kept in memory, of `bytes_each`. exact: the mode without loss.
    """

    configuration: str
    track: Track
    runs: list[Run]
    parameters: dict[str, int] | None
    stored: dict[str, int]
    bytes_each: int
    exact: str
    laps_other_modes: int
    modes: list[OfMode]
