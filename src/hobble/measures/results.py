"""Types that the results of several measurements share."""

from __future__ import annotations

from typing import Literal, TypedDict

Split = Literal["train", "held_out"]
SPLITS: tuple[Split, Split] = ("train", "held_out")


class SampleSize(TypedDict):
    """How many excerpts were measured, `of_excerpts` how many, from how many clips, `of` how many.

    strata: their number.
    """

    excerpts: int
    of_excerpts: int
    clips: int
    of: int
    strata: int
