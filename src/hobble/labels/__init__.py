"""Labels a clip with contacts, phase and gait, from hand-made files or from the motion alone.

This file has the keys of a data set's `labels` section.
"""

from typing import Literal

from pydantic import Field

from hobble.core.section import Section


class LabelOptions(Section):
    """Options for contacts, phase and gait."""

    files: bool = Field(True, description="use hand-made label files beside the clip")
    contacts: Literal["stance", "original"] = Field(
        "stance",
        description="stance: a heel or toe is down if it is slow and near the height of its stance. "
        "original: it is down if it moves less than 1.4 mm in a frame, as in Holden et al. (2017)",
    )
    phase_zero: Literal["right", "left"] = Field("right", description="the foot that lands at phase 0")
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
