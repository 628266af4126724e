"""The order in which a pass over the data visits rows and their terrain fits.

The functions keep no state. The order depends only on their arguments, such as the seed.

Rows are stored in chunks (files). Each row has one or more terrain fits (ground heights that suit its
motion).

A pass visits every row `visits` times. It consists of `visits` layers. A layer visits every row once, with
one of the row's fits. Each pass permutes the fits of every row anew. In layer l, a row with n fits has the
fit at place l % n of its permutation. So a row with `visits` fits has each of them once in a pass. A row on
flat ground has only one fit, which comes in every layer. All visits of a pass, layer after layer, are cut
into sections of nearly equal length. With `visits` sections, each section is a layer.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

# What random numbers are drawn for. This is part of the generator's seed, so that each purpose gets other
# numbers.
CHUNKS, ROWS, FITS = 1, 2, 3


def layer_parts(
    rows: int, visits: int, section: int, sections: int, part: range
) -> Iterator[tuple[int, int, int]]:
    """Yield the parts of layers of which a section consists, as (layer, first place, last place + 1).

    rows: number of rows in a layer. visits: number of layers. section: number of the section, from 0.
    sections: number of all sections. part: the numbers of those visits of the section to yield.
    """
    total = rows * visits
    first = total * section // sections
    start, stop = first + part.start, first + part.stop
    while start < stop:
        layer = start // rows
        end = min(stop, (layer + 1) * rows)
        yield layer, start - layer * rows, end - layer * rows
        start = end


def chunk_groups(chunks: int, window: int, seed: int, pass_index: int, layer: int) -> list[np.ndarray]:
    """Groups of chunks, in the order of a layer. Each is an array with the numbers of its chunks.

    The chunks of a group are read together, and their rows are mixed. chunks: number of all chunks. window:
    largest number of chunks of a group. The first group has one chunk, and each further group has twice as
    many as the group before, up to `window`. The first groups are small, so that the first rows of a layer
    are ready soon. They are well mixed even so, because all rows were permuted when they were written.
    """
    order = np.random.default_rng([seed, CHUNKS, pass_index, layer]).permutation(chunks)
    groups, start, size = [], 0, 1
    while start < chunks:
        groups.append(order[start : start + size])
        start, size = start + size, min(2 * size, window)
    return groups


def pick_fits(
    count: np.ndarray, visits: int, seed: int, pass_index: int, layer: int, chunk: int
) -> np.ndarray:
    """(R,) which of its fits, numbered from 0, each row of a chunk has in a layer.

    count: (R,) number of fits of each row, at most `visits`. chunk: number of the chunk.
    """
    if np.all(count <= 1):
        return np.zeros(len(count), np.int64)
    # (R, visits) random numbers. Sorting those of a row gives the permutation of its fits in this pass.
    draws = np.random.default_rng([seed, FITS, pass_index, chunk]).random((len(count), visits))
    place = layer % np.maximum(count, 1)
    picked = np.zeros(len(count), np.int64)
    for fits in np.unique(count[count > 1]):
        rows = np.flatnonzero(count == fits)
        permutations = np.argsort(draws[rows, :fits], axis=1)
        picked[rows] = permutations[np.arange(len(rows)), place[rows]]
    return picked


def first_fits(count: np.ndarray) -> np.ndarray:
    """(R,) the index of each row's first fit if the fits are stored row after row.

    count: (R,) number of fits of each row.
    """
    return np.cumsum(count, dtype=np.int64) - count


def rows_and_fits(
    chunks: Sequence[int],
    rows: Sequence[int],
    count: np.ndarray,
    visits: int,
    where: tuple[int, int, int, int],
    part: slice,
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) indices of rows of a group of chunks, in the order of a layer, and (n,) indices of their fits.

    chunks: numbers of the group's chunks. rows: number of rows of each chunk. count: (R,) number of fits of
    each row of the group. where: seed, pass, layer and group. part: the n places in this order to return.
    """
    seed, pass_index, layer, group = where
    picked = [
        pick_fits(count[end - n : end], visits, seed, pass_index, layer, int(chunk))
        for chunk, n, end in zip(chunks, rows, np.cumsum(rows), strict=True)
    ]
    order = np.random.default_rng([seed, ROWS, pass_index, layer, group]).permutation(len(count))
    chosen = order[part]
    return chosen, first_fits(count)[chosen] + np.concatenate(picked)[chosen]


# How training processes share the samples of a section.
#
# A section is a part of a pass over the data. Its samples have a fixed order, which is cut into consecutive
# stretches. A batch takes samples from every stretch, about as many from each. With one stretch, a batch is a
# run of consecutive samples. Each process reads certain stretches whole, which fill its places in every
# batch. So the content of a batch depends on the number of stretches, but not on the number of processes.


def stretches_of_section(total: int, batch: int, count: int) -> list[tuple[range, int]]:
    """The `count` stretches of a section: the numbers of their samples, and how many of them a batch takes.

    total: number of samples of the section. batch: samples of a batch. The last batch may be shorter.
    """
    full, rest = divmod(total, batch)  # full batches, and samples of a shorter last batch
    edges = [
        batch * number // count for number in range(count + 1)
    ]  # places of a batch where stretches begin
    starts = [full * edge + min(rest, edge) for edge in edges]
    return [
        (range(*ends), places)
        for ends, places in zip(pairwise(starts), (b - a for a, b in pairwise(edges)), strict=True)
    ]


def own_part(count: int, rank: int, processes: int) -> range:
    """Which of `count` stretches, or places of a batch, belong to process `rank` of `processes`."""
    return range(count * rank // processes, count * (rank + 1) // processes)
