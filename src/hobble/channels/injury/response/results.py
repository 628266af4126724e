"""The types of injury.json, the result of the measurement of the response to injury.

A link is the piece of the body between two neighbouring joints. The distance between two walks is the mean
distance of their joints at the same phase, in cm.
"""

from __future__ import annotations

from typing import NotRequired, TypedDict

Number = float | None  # None if the value cannot be measured


class SweepRow(TypedDict):
    """The walk at one severity of one link.

    gait: "walk" or "jog". direction: "rising" or "falling" severity.

    Measures from `hobble.measures.walks.gait_measures`: speed in cm/s; stance as a share of the
    frames; steps and hip_height in cm; knee and arm, how far each bends or swings, in degrees; lean of the
    trunk in degrees. An asymmetry is left minus right, divided by their mean.

    from_healthy: distance from the healthy walk. from_worst: distance from the walk at severity 10.
    from_rising: distance from the walk at the same severity while the severity rose. largest_acceleration: of
    any joint, cm per frame squared.
    """

    gait: str
    link: str
    direction: str
    severity: float
    speed: float
    stance_left: float
    stance_right: float
    stance_asymmetry: Number
    step_left: Number
    step_right: Number
    step_asymmetry: Number
    knee_left: float
    arm_left: float
    knee_right: float
    arm_right: float
    lean_forward: float
    lean_left: float
    hip_height: float
    from_healthy: float
    from_worst: float
    from_rising: float
    largest_acceleration: float


class Response(TypedDict):
    """How the walk responds to the severity of one link.

    For the fields see `SeveritySweep.response` in `hobble.channels.injury.response.sweep`.
    """

    spearman: dict[str, Number]
    spearman_falling: dict[str, Number]
    from_healthy_cm: float
    after_healing_cm: float
    hysteresis_cm: float
    speed_share: Number
    settle_seconds: Number
    heal_seconds: Number
    largest_acceleration: float
    acceleration_share: float


class LinkResponse(Response):
    """The response of one link in one gait.

    trained: whether the link was hurt in training. clip_acceleration: largest acceleration of any joint in
    captured motion, cm per frame squared; None if there is no such motion. clip_acceleration_of: the motion
    that `clip_acceleration` comes from: "link" for motion in this gait in which this link hurts, "gait" for
    all motion in this gait, because this link hurts in none. clip_acceleration_share: the character's largest
    acceleration, divided by `clip_acceleration`.
    """

    gait: str
    link: str
    trained: bool
    clip_acceleration: Number
    clip_acceleration_of: str | None
    clip_acceleration_share: Number


class Summary(TypedDict):
    """Means over the responses of several links in one gait. For the fields see `LinkResponse`.

    spearman_<measure>: mean of `spearman[<measure>]`. spearman_falling_<measure>: mean of
    `spearman_falling[<measure>]`.
    """

    spearman_from_healthy: Number
    spearman_speed: Number
    spearman_falling_from_healthy: Number
    from_healthy_cm: Number
    after_healing_cm: Number
    hysteresis_cm: Number
    speed_share: Number
    settle_seconds: Number
    heal_seconds: Number
    acceleration_share: Number
    clip_acceleration_share: Number


class SecondInjury(TypedDict):
    """A second injury at severity 10 in addition to a first one.

    For the fields see `second_injuries` in `hobble.channels.injury.response.cases`.
    """

    first: str
    second: str
    from_first_cm: float
    share: Number
    from_second_cm: float
    spearman: Number


class IntoAJog(TypedDict):
    """A change from walking to jogging with one link hurt, or with none.

    For the fields see `into_a_jog` in `hobble.channels.injury.response.cases`.
    """

    link: str | None
    severity: float
    walk_speed: float
    jog_speed: float
    reach_seconds: Number
    walk_from_healthy_cm: float
    jog_from_healthy_cm: float
    kept: Number
    largest_acceleration: float


class Divided(TypedDict):
    """The walk with one link hurt, if the runtime divides `severity` by `scale`.

    from_healthy_cm: distance from the healthy walk. speed_share: speed, divided by the healthy speed.
    """

    scale: float
    link: str
    severity: float
    from_healthy_cm: float
    speed_share: float


class InjuryResponse(TypedDict):
    """The content of injury.json. If `applies` is false, it has only `configuration`, `applies` and `reason`.

    For the fields see `hobble.channels.injury.response.run.injury_response`.
    """

    configuration: str
    applies: bool
    reason: NotRequired[str]
    mode: NotRequired[str]
    seconds: NotRequired[float]
    severities: NotRequired[list[float]]
    links: NotRequired[list[str]]
    trained: NotRequired[list[str]]
    rows: NotRequired[list[SweepRow]]
    falling: NotRequired[list[SweepRow]]
    responses: NotRequired[list[LinkResponse]]
    second: NotRequired[list[SecondInjury]]
    into_a_jog: NotRequired[list[IntoAJog]]
    divided: NotRequired[list[Divided]]
    summary: NotRequired[dict[str, Summary]]
    summary_untrained: NotRequired[dict[str, Summary]]
