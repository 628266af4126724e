"""Types that the results of several measurements share."""

from __future__ import annotations

from typing import Literal, TypedDict

Split = Literal["train", "held_out"]
SPLITS: tuple[Split, Split] = ("train", "held_out")


class SampleSize(TypedDict):
    """The size of a sample, drawn by `hobble.measures.stratified_sample`. It consists of excerpts of clips.

    excerpts: number of excerpts in the sample. of_excerpts: number of excerpts of all clips. clips: number of
    clips with an excerpt in the sample. of: number of all clips. strata: number of groups of similar excerpts
    from which the sample was drawn.
    """

    excerpts: int
    of_excerpts: int
    clips: int
    of: int
    strata: int
