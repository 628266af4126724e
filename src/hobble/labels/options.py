"""The keys of a data set's `labels` section."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from hobble.core.section import Positive, PositiveFloat, Section


class LabelOptions(Section):
    """Contacts, phase and gait. Speeds are in centimetres a frame at 120 Hz."""

    files: bool = Field(True, description="use hand-made label files beside the clip")
    contacts: Literal["stance", "original"] = Field(
        "stance",
        description="stance: a heel or toe is down if it is slow and near the height of its stance. "
        "original: it is down if it moves less than the root of `contact_threshold` in a frame",
    )
    contact_threshold: PositiveFloat = Field(
        0.02, description="for `contacts: original`: squared displacement, cm2 per 60 Hz frame"
    )
    phase_zero: Literal["right", "left"] = Field("right", description="the foot that lands at phase 0")
    heel_speed: PositiveFloat = Field(0.375, description="unit in which the speed of a heel is judged")
    toe_speed: PositiveFloat = Field(0.0875, description="unit in which the speed of a toe is judged")
    valley_factor: PositiveFloat = Field(
        2.875, description="a foot that never rests is down while its speed is at most this times its lowest"
    )
    margins: Literal["extend", "drop"] = Field(
        "extend",
        description="cycles with less than a second of clip before or after them: extend uses them, and "
        "continues the path straight past the clip's end; drop leaves them out, as in the original",
    )
    shortest_step: Positive = Field(5, description="steps of this many 120 Hz frames or fewer are dropped")
