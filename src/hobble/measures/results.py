"""Types that the results of several measurements share."""

from __future__ import annotations

from typing import Literal, TypedDict

Split = Literal["train", "held_out"]
SPLITS: tuple[Split, Split] = ("train", "held_out")


class SampleSize(TypedDict):
    """How many clips were measured, `of` how many, from how many strata."""

    clips: int
    of: int
    strata: int
