"""The order in which a pass over the data visits rows and their terrain fits: pure functions of the seed.

A pass uses every row `visits` times, so it has `visits` layers. A layer has every row once, with one of the
row's terrain fits. Each pass permutes the fits of every row anew. In layer l, a row with n fits has the fit
at place l % n of its permutation. So a pass has each pair of a row and a fit once. Only a row on flat ground
has a single fit, which comes in every layer. The layers of a pass, one after another, are cut into sections
of nearly equal length. With `visits` sections, each section is a layer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

# What random numbers are drawn for. Part of the generator's seed, so that each purpose gets other numbers.
CHUNKS, ROWS, FITS = 1, 2, 3


def generator(seed: int, *purpose: int) -> np.random.Generator:
    """A new random generator, whose numbers depend only on the arguments.

    seed: the seed in the configuration. purpose: CHUNKS, ROWS or FITS, then the numbers of pass, layer etc.
    """
    return np.random.default_rng([seed, *purpose])


def spans(
    rows: int, visits: int, section: int, sections: int, part: tuple[int, int] | None = None
) -> Iterator[tuple[int, int, int]]:
    """The parts of layers that a section consists of: (layer, first place, last place + 1).

    rows: number of rows of a layer. visits: number of layers. section: number of the section, from 0.
    sections: how many there are. part: (start, stop), to get only these samples of the section; None: all.
    """
    total = rows * visits
    start, stop = total * section // sections, total * (section + 1) // sections
    if part is not None:
        start, stop = start + part[0], min(stop, start + part[1])
    while start < stop:
        layer = start // rows
        end = min(stop, (layer + 1) * rows)
        yield layer, start - layer * rows, end - layer * rows
        start = end


def groups(shards: np.ndarray, window: int, seed: int, pass_index: int, layer: int) -> list[np.ndarray]:
    """Groups of chunks, in random order. The chunks of a group are read together and their rows are mixed.

    shards: (chunks,) the shard of each chunk. window: largest number of chunks of a group. The first group
    has as many chunks as there are shards, each further group twice as many as the one before, up to
    `window`. Small groups come first so that the first rows of a layer are ready soon. Their rows are mixed
    as well as those of large groups: each group has chunks of all shards in proportion, to within a chunk,
    and the rows of a shard were permuted when they were written.
    """
    draw = generator(seed, CHUNKS, pass_index, layer)
    order = draw.permutation(len(shards))
    of_each = np.bincount(shards)
    if (count := int(np.count_nonzero(of_each))) > 1:
        order = order[np.argsort(_places(shards[order], of_each, draw.random(len(of_each))), kind="stable")]
    out, start, size = [], 0, min(count, window)
    while start < len(order):
        out.append(order[start : start + size])
        start, size = start + size, min(2 * size, window)
    return out


def _places(shards: np.ndarray, of_each: np.ndarray, first: np.ndarray) -> np.ndarray:
    """(chunks,) places from 0 to 1 that spread the chunks of each shard evenly.

    shards: (chunks,) the shard of each chunk. of_each: (shards,) number of chunks of each shard. first:
    (shards,) numbers from 0 to 1: the first chunk of a shard with n chunks gets the place first / n.
    """
    number, by_shard = np.empty(len(shards)), np.argsort(shards, kind="stable")
    number[by_shard] = np.arange(len(shards)) - np.repeat(np.cumsum(of_each) - of_each, of_each)
    return (number + first[shards]) / of_each[shards]


def row_order(rows: int, seed: int, pass_index: int, layer: int, group: int) -> np.ndarray:
    """(rows,) a random order of the rows of a group."""
    return generator(seed, ROWS, pass_index, layer, group).permutation(rows)


def picks(count: np.ndarray, visits: int, seed: int, pass_index: int, layer: int, chunk: int) -> np.ndarray:
    """(R,) which of its fits, numbered from 0, each of the R rows of a chunk has in a layer.

    count: (R,) number of fits of each row, at most `visits`. chunk: number of the chunk.
    """
    if np.all(count <= 1):
        return np.zeros(len(count), np.int64)
    draws = generator(seed, FITS, pass_index, chunk).random((len(count), visits))
    place = layer % np.maximum(count, 1)
    out = np.zeros(len(count), np.int64)
    for fits in np.unique(count[count > 1]):
        of_rows = np.flatnonzero(count == fits)
        ranked = np.argsort(draws[of_rows, :fits], axis=1)
        out[of_rows] = ranked[np.arange(len(of_rows)), place[of_rows]]
    return out


def starts(count: np.ndarray) -> np.ndarray:
    """(R,) the index of each row's first fit. count: (R,) number of fits of each row."""
    return np.cumsum(count, dtype=np.int64) - count


def rows_and_fits(
    chunks: Sequence[int],
    rows: Sequence[int],
    count: np.ndarray,
    first: np.ndarray,
    visits: int,
    where: tuple[int, int, int, int],
    part: slice,
) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n,) of rows of a group of chunks, in the order of a layer, and (n,) of the fit of each row.

    chunks: their numbers. rows: number of rows of each chunk. count, first: (R,) number of fits and index of
    the first fit (`starts`) of each row of the group. where: seed, pass, layer and group. part: which n
    places of the group's order to return.
    """
    seed, pass_index, layer, group = where
    picked = [
        picks(count[end - n : end], visits, seed, pass_index, layer, int(chunk))
        for chunk, n, end in zip(chunks, rows, np.cumsum(rows), strict=True)
    ]
    some = row_order(len(count), seed, pass_index, layer, group)[part]
    return some, first[some] + np.concatenate(picked)[some]
