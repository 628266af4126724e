"""Types that the results of several measurements share."""

from __future__ import annotations

from typing import Literal, TypedDict

Split = Literal["train", "held_out"]
SPLITS: tuple[Split, Split] = ("train", "held_out")


class SampleSize(TypedDict):
    """The size of a sample. excerpts, clips: how many are in the sample; strata: how many it is drawn from.

    of_excerpts, of: how many excerpts and clips there are in all.
    """

    excerpts: int
    of_excerpts: int
    clips: int
    of: int
    strata: int
