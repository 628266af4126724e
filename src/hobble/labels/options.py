"""The keys of a data set's `labels` section."""

from typing import Literal

from pydantic import Field

from hobble.core.section import Positive, PositiveFloat, Section


class LabelOptions(Section):
    """Options for contacts, phase and gait. Speeds are in centimetres per frame at 120 Hz."""

    files: bool = Field(True, description="use hand-made label files beside the clip")
    contacts: Literal["stance", "original"] = Field(
        "stance",
        description="stance: a heel or toe is down if it is slow and near the height of its stance. "
        "original: it is down if it moves less than the square root of `contact_threshold` in a frame",
    )
    contact_threshold: PositiveFloat = Field(
        0.02, description="for `contacts: original`: limit of the squared displacement, cm2 per 60 Hz frame"
    )
    phase_zero: Literal["right", "left"] = Field("right", description="the foot that lands at phase 0")
    heel_speed: PositiveFloat = Field(
        0.375, description="unit for the speed of a heel: a heel slower than 0.35 of this rests"
    )
    toe_speed: PositiveFloat = Field(
        0.0875, description="unit for the speed of a toe: a toe slower than 0.35 of this rests"
    )
    valley_factor: PositiveFloat = Field(
        2.875,
        description="a foot that never rests between two swings is down while its speed is less than this "
        "many times its lowest speed between these swings",
    )
    margins: Literal["extend", "drop"] = Field(
        "extend",
        description="what happens to gait cycles that begin less than a second after the clip's first frame "
        "or end less than a second before its last frame. extend: they are used, and the path is continued "
        "straight past the clip's end. drop: they are left out, as in Holden et al. (2017)",
    )
    between: bool = Field(
        False,
        description="also use the frames between gait cycles, cut into pieces of about a second. Their phase "
        "means nothing, so take a kind of network without a phase (`local`, `mann`)",
    )
    shortest_step: Positive = Field(
        5, description="a landing at most this many frames (at 120 Hz) after the other foot's is left out"
    )
