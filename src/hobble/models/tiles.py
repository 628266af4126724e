"""Products of a few rows of inputs with many weights.

The result for a row has the same bits whatever the number of rows.

Weights are stored in panels of WIDTH outputs, (panels, inputs, WIDTH), so that each input is multiplied with
WIDTH neighbouring weights. Every output is one running sum over the inputs in their order, by fused
multiply-add. A tile is a group of rows and panels whose sums are kept in registers. Its shape changes only
the speed.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils, config
from numba.extending import intrinsic

from hobble.core.compiled import njit
from hobble.core.quat import Array

WIDTH = 16  # outputs in a panel: two registers with AVX2, one with AVX-512
DEPTH = 256  # at most this many inputs at a time, so that their weights in a panel stay in the L1 cache
ALIGNMENT = 64  # bytes of a cache line
# With one row of inputs, weights are fetched from memory this many inputs before they are needed.
AHEAD = 48


def panels_of(outputs: int) -> int:
    """The number of panels for `outputs` outputs."""
    return -(-outputs // WIDTH)


def aligned(size: int, dtype: Any) -> Array:
    """(size,) zeros, aligned to a cache line."""
    dtype = np.dtype(dtype)
    room = np.zeros(size * dtype.itemsize + ALIGNMENT, np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    return room[start : start + size * dtype.itemsize].view(dtype)


def in_panels(weights: Array) -> Array:
    """Weights (..., out, in) as (..., panels, in, WIDTH), padded with zeros after the last output."""
    *lead, outputs, inputs = weights.shape
    panels = panels_of(outputs)
    padded = np.zeros((*lead, panels * WIDTH, inputs), weights.dtype)
    padded[..., :outputs, :] = weights
    return np.ascontiguousarray(np.swapaxes(padded.reshape(*lead, panels, WIDTH, inputs), -1, -2))


def _write_tile(builder, shape, weights_from, inputs_from, sums_at):  # type: ignore[no-untyped-def]
    """Write the loop of `_tile` in LLVM IR, with vectors of WIDTH numbers on every processor.

    Written this way, the sums stay in registers. From plain loops compilers do not achieve this. shape:
    numbers of rows and panels. weights_from, inputs_from, sums_at: see `_typed_tile`; here arrays are
    pointers.
    """
    (rows, panels), (weights, first, step) = shape, weights_from
    (x, x_at, x_step, depth), (y, y_at) = inputs_from, sums_at
    index, vector = ir.IntType(64), ir.VectorType(ir.FloatType(), WIDTH)
    fused = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(vector, [vector] * 3), f"llvm.fmuladd.v{WIDTH}f32"
    )
    begin = builder.block
    places = []
    for r in range(rows):
        row = builder.load(builder.gep(y_at, [index(r)]))
        places += [_vector_at(builder, y, builder.add(row, index(q * WIDTH))) for q in range(panels)]
    before = [builder.load(place, align=4) for place in places]
    of_row = [builder.add(x_at, builder.mul(x_step, index(r))) for r in range(rows)]
    of_panel = [builder.add(first, builder.mul(step, index(q))) for q in range(panels)]

    loop, done = builder.append_basic_block("inputs"), builder.append_basic_block("done")
    builder.branch(loop)
    builder.position_at_end(loop)
    k = builder.phi(index)
    sums = [builder.phi(vector) for _ in places]
    at = builder.mul(k, index(WIDTH))
    w = [_weights_at(builder, weights, builder.add(start, at), vector) for start in of_panel]
    if rows == 1:
        _fetch_ahead(builder, weights, of_panel, step, k, depth)
    after = []
    for r in range(rows):
        x_k = _spread(builder, builder.load(builder.gep(x, [builder.add(of_row[r], k)])), vector)
        after += [builder.call(fused, [x_k, w[q], sums[r * panels + q]]) for q in range(panels)]
    following = builder.add(k, index(1))
    for phi, old, new in zip([k, *sums], [index(0), *before], [following, *after], strict=True):
        phi.add_incoming(old, begin)
        phi.add_incoming(new, loop)
    builder.cbranch(builder.icmp_signed("<", following, depth), loop, done)
    builder.position_at_end(done)
    for place, total in zip(places, after, strict=True):
        builder.store(total, place, align=4)


def _fetch_ahead(builder, weights, of_panel, step, k, depth):  # type: ignore[no-untyped-def]
    """Fetch the panels' weights AHEAD inputs early. At the end of a panel, fetch those of the next tile.

    The processor's own prefetching starts anew at each panel, so a single row would wait for memory.
    """
    index, flag, cell = ir.IntType(64), ir.IntType(32), ir.IntType(8).as_pointer()
    fetch = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.VoidType(), [cell, flag, flag, flag]), "llvm.prefetch.p0"
    )
    later = builder.add(k, index(AHEAD))
    # A panel is followed in memory by the other panels of this tile. Skip them to get to the next tile.
    further = builder.select(
        builder.icmp_signed("<", later, depth), index(0), builder.mul(step, index(len(of_panel) - 1))
    )
    distance = builder.add(builder.mul(later, index(WIDTH)), further)
    for start in of_panel:
        place = builder.gep(weights, [builder.add(start, distance)])
        # 0: to read; 3: keep in all caches; 1: data, not code.
        builder.call(fetch, [builder.bitcast(place, cell), flag(0), flag(3), flag(1)])


def _vector_at(builder, array, place):  # type: ignore[no-untyped-def]
    vector = ir.VectorType(array.type.pointee, WIDTH)
    return builder.bitcast(builder.gep(array, [place]), vector.as_pointer())


def _weights_at(builder, weights, place, vector):  # type: ignore[no-untyped-def]
    stored = builder.load(_vector_at(builder, weights, place), align=2)
    if isinstance(weights.type.pointee, ir.FloatType):
        return stored
    return builder.sitofp(builder.sext(stored, ir.VectorType(ir.IntType(32), WIDTH)), vector)


def _spread(builder, number, vector):  # type: ignore[no-untyped-def]
    """A vector with `number` in all places."""
    nothing, lane = ir.Constant(vector, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(nothing, number, lane(0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(lane, WIDTH), [0] * WIDTH))


def _typed_tile(typing, rows, panels, weights_from, inputs_from, sums_at):  # type: ignore[no-untyped-def]
    """The signature and the code of the compiled function `_tile`.

    It adds the products of some inputs with `panels` panels of weights to `rows` rows of sums.

    rows, panels: compile-time constants. The other arguments are tuples of flat arrays and indices:
    weights_from: the weights; index of the first panel's weights for these inputs; distance from one panel to
    the next. inputs_from: the inputs; index of the first row's inputs; distance from one row to the next;
    number of inputs in each row. sums_at: the sums; (rows,) index of each row's sums for the first panel.
    """
    if not (isinstance(rows, types.IntegerLiteral) and isinstance(panels, types.IntegerLiteral)):
        return None
    shape = rows.literal_value, panels.literal_value
    signature = types.void(rows, panels, weights_from, inputs_from, sums_at)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        tuples = [
            [
                _pointer(context, builder, *part)
                for part in zip(kind, cgutils.unpack_tuple(builder, arg), strict=True)
            ]
            for kind, arg in zip(signature.args[2:], args[2:], strict=True)
        ]
        _write_tile(builder, shape, *tuples)
        return context.get_dummy_value()

    return signature, generate


def _pointer(context, builder, kind, value):  # type: ignore[no-untyped-def]
    """The pointer to an array's numbers. Other values stay as they are."""
    return context.make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else value


_tile: Any = intrinsic(_typed_tile)


def _has_32_registers() -> bool:
    """Whether compiled code has the 32 wide registers of AVX-512."""
    return not getattr(config, "CPU_NAME", None) and bool(llvm.get_host_cpu_features().get("avx512f"))


# Number of panels in a tile with one row, with two or three rows, and with four to six rows. With two rows or
# more, the sums nearly fill the registers, and there are enough sums to hide the latency of an addition. With
# one row the processor waits for memory anyway.
PANELS_FOR_1_ROW = 4
PANELS_FOR_3_ROWS, PANELS_FOR_6_ROWS = (4, 4) if _has_32_registers() else (2, 1)
ROWS = 6  # a tile has at most this many rows


@njit(forceinline=True, cache=False)
def multiply(
    weights: Any, start: int, panels: int, inputs: int, x: Any, rows: int, y: Any, y_at: Any
) -> None:
    """Add W x to rows of y. All arrays are flat.

    weights: the matrix W as (panels, inputs, WIDTH), which begins at index `start`. x: (rows, inputs). y:
    each row's panels * WIDTH sums. y_at: (rows,) index in y where a row's sums begin.
    """
    at = np.empty(ROWS, np.int64)
    tiles = -(-rows // ROWS)
    wide = PANELS_FOR_1_ROW if rows == 1 else PANELS_FOR_3_ROWS if rows <= 3 else PANELS_FOR_6_ROWS
    # With one row each weight is used only once, so there is nothing to keep in the cache.
    stretches = 1 if rows == 1 else -(-inputs // DEPTH)
    for stretch in range(stretches):
        k = inputs * stretch // stretches
        depth = inputs * (stretch + 1) // stretches - k
        panel = 0
        while panel < panels:
            together = wide if panel + wide <= panels else 1
            first = start + (panel * inputs + k) * WIDTH
            # These weights stay in the L1 cache for all rows. Tiles get about the same number of rows.
            for n in range(tiles):
                row = rows * n // tiles
                count = rows * (n + 1) // tiles - row
                for r in range(count):
                    at[r] = y_at[row + r] + panel * WIDTH
                rows_from = x, row * inputs + k, inputs, depth
                _chosen_tile(count, together, (weights, first, inputs * WIDTH), rows_from, (y, at))
            panel += together


@njit(forceinline=True, cache=False)
def _chosen_tile(rows: int, panels: int, weights_from: Any, inputs_from: Any, sums_at: Any) -> None:
    """Call `_tile` with `rows` and `panels` as compile-time constants."""
    if rows == 1:
        if panels == PANELS_FOR_1_ROW:
            _tile(1, PANELS_FOR_1_ROW, weights_from, inputs_from, sums_at)
        else:
            _tile(1, 1, weights_from, inputs_from, sums_at)
    elif rows == 2:
        if panels == PANELS_FOR_3_ROWS:
            _tile(2, PANELS_FOR_3_ROWS, weights_from, inputs_from, sums_at)
        else:
            _tile(2, 1, weights_from, inputs_from, sums_at)
    elif rows == 3:
        if panels == PANELS_FOR_3_ROWS:
            _tile(3, PANELS_FOR_3_ROWS, weights_from, inputs_from, sums_at)
        else:
            _tile(3, 1, weights_from, inputs_from, sums_at)
    elif rows == 4:
        if panels == PANELS_FOR_6_ROWS:
            _tile(4, PANELS_FOR_6_ROWS, weights_from, inputs_from, sums_at)
        else:
            _tile(4, 1, weights_from, inputs_from, sums_at)
    elif rows == 5:
        if panels == PANELS_FOR_6_ROWS:
            _tile(5, PANELS_FOR_6_ROWS, weights_from, inputs_from, sums_at)
        else:
            _tile(5, 1, weights_from, inputs_from, sums_at)
    elif panels == PANELS_FOR_6_ROWS:
        _tile(6, PANELS_FOR_6_ROWS, weights_from, inputs_from, sums_at)
    else:
        _tile(6, 1, weights_from, inputs_from, sums_at)
