"""The order in which a pass visits rows and their fits, as pure functions of the seed.

A pass is `visits` layers. A layer visits every row once; row r appears in layer l with its fit number
picks[r, l % fits of r], a permutation drawn for each row and pass. So every (frame, fit) pair comes once in
a pass, a flat row's one fit as often as there are layers, and no batch holds a frame twice. Sections cut
the sequence of layers into near equal parts; with as many sections as visits, a section is a layer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

CHUNKS, ROWS, FITS = 1, 2, 3  # what a generator draws, so that no two draw the same numbers


def generator(seed: int, *of: int) -> np.random.Generator:
    """Seeded by a configuration's number and by what it is for, whatever was drawn before."""
    return np.random.default_rng([seed, *of])


def spans(
    rows: int, visits: int, section: int, sections: int, part: tuple[int, int] | None = None
) -> Iterator[tuple[int, int, int]]:
    """The parts of layers that make up a section: (layer, first place, last place + 1).

    part: only the samples of the section from the first to before the second of two numbers.
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


def groups(
    chunk_rows: Sequence[int], window: int, seed: int, pass_index: int, layer: int
) -> list[np.ndarray]:
    """The chunks that are read and mixed together, in a fresh order: one, two, four, ..., `window` at a time.

    So the first rows of a layer are there after one chunk is read; since the rows were permuted when they
    were written, few chunks are mixed as well as many.
    """
    order = generator(seed, CHUNKS, pass_index, layer).permutation(len(chunk_rows))
    out, start, size = [], 0, 1
    while start < len(order):
        out.append(order[start : start + size])
        start, size = start + size, min(2 * size, window)
    return out


def row_order(rows: int, seed: int, pass_index: int, layer: int, group: int) -> np.ndarray:
    """(rows,) in which order the rows of a group come."""
    return generator(seed, ROWS, pass_index, layer, group).permutation(rows)


def picks(count: np.ndarray, visits: int, seed: int, pass_index: int, layer: int, chunk: int) -> np.ndarray:
    """(R,) which of its fits each row of a chunk shows in this layer; `count` (R,) is how many it has.

    No count may be above `visits`.
    """
    if np.all(count <= 1):
        return np.zeros(len(count), np.int64)
    draws = generator(seed, FITS, pass_index, chunk).random((len(count), visits))
    place = layer % np.maximum(count, 1)
    out = np.zeros(len(count), np.int64)
    for fits in np.unique(count[count > 1]):
        of = np.flatnonzero(count == fits)
        ranked = np.argsort(draws[of, :fits], axis=1)
        out[of] = ranked[np.arange(len(of)), place[of]]
    return out


def starts(count: np.ndarray) -> np.ndarray:
    """(R,) where each row's fits begin among those of all; `count` (R,) is how many each has."""
    return np.cumsum(count, dtype=np.int64) - count


def shown(
    chunks: Sequence[int],
    rows: Sequence[int],
    count: np.ndarray,
    first: np.ndarray,
    visits: int,
    place: tuple[int, int, int, int],
    part: slice,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of a group of chunks in the order of a layer, and the fit of each: both (n,), n of `part`.

    chunks: their numbers; rows: of each. count, first: (R,) of the group's rows, as in `starts`. place: seed,
    pass, layer and group. part: of the order.
    """
    seed, pass_index, layer, group = place
    picked = [
        picks(count[end - n : end], visits, seed, pass_index, layer, int(chunk))
        for chunk, n, end in zip(chunks, rows, np.cumsum(rows), strict=True)
    ]
    some = row_order(len(count), seed, pass_index, layer, group)[part]
    return some, first[some] + np.concatenate(picked)[some]
