"""Types that the results of several measurements share."""

from __future__ import annotations

from typing import Literal, TypedDict

Split = Literal["train", "held_out"]
SPLITS: tuple[Split, Split] = ("train", "held_out")


class SampleSize(TypedDict):
    """The size of a sample of excerpts of clips, drawn by `hobble.measures.stratified_sample`.

    excerpts: number of excerpts in the sample. of_excerpts: number of excerpts in all. clips: number of clips
    with an excerpt in the sample. of: number of clips in all. strata: number of strata.
    """

    excerpts: int
    of_excerpts: int
    clips: int
    of: int
    strata: int
