"""Products of a few rows of inputs with many weights.

The result for a row has the same bits, however many other rows there are.

A panel holds the weights of WIDTH outputs. A matrix of weights is stored as (panels, inputs, WIDTH), so that
the WIDTH weights that multiply the same input are neighbours in memory. Each output is one running sum, to
which the products are added in the order of the inputs, by fused multiply-add. A tile is a group of rows and
panels whose sums are kept in registers together. The number of rows and panels in a tile changes only the
speed.
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
# At most this many inputs are processed at a time, so that their weights in a panel stay in the L1 cache.
DEPTH = 256
ALIGNMENT = 64  # bytes of a cache line
# With one row of inputs, the weights of an input are fetched from memory this many inputs earlier.
AHEAD = 48


def panel_count(outputs: int) -> int:
    """The number of panels for `outputs` outputs."""
    return -(-outputs // WIDTH)


def aligned_zeros(size: int, dtype: Any) -> Array:
    """(size,) zeros that begin at a cache line."""
    dtype = np.dtype(dtype)
    room = np.zeros(size * dtype.itemsize + ALIGNMENT, np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    return room[start : start + size * dtype.itemsize].view(dtype)


def in_panels(weights: Array) -> Array:
    """Weights (..., out, in) as (..., panels, in, WIDTH), padded with zeros after the last output."""
    *lead, outputs, inputs = weights.shape
    panels = panel_count(outputs)
    padded = np.zeros((*lead, panels * WIDTH, inputs), weights.dtype)
    padded[..., :outputs, :] = weights
    return np.ascontiguousarray(np.swapaxes(padded.reshape(*lead, panels, WIDTH, inputs), -1, -2))


def _write_tile(builder, shape, weights_from, inputs_from, sums_at):  # type: ignore[no-untyped-def]
    """Write the loop of `_tile` in LLVM IR, with vectors of WIDTH numbers on every processor.

    Code written this way keeps the sums in registers. Compilers do not achieve this for plain loops. shape:
    numbers of rows and panels. weights_from, inputs_from, sums_at: as in `_typed_tile`, with pointers instead
    of arrays. Lists of sums are in the order of rows, then panels.
    """
    (rows, panels), (weights, first, step) = shape, weights_from
    (x, x_at, x_step, depth), (y, y_at) = inputs_from, sums_at
    index, vector = ir.IntType(64), ir.VectorType(ir.FloatType(), WIDTH)
    fused = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(vector, [vector] * 3), f"llvm.fmuladd.v{WIDTH}f32"
    )
    begin = builder.block
    # Before the loop: load the sums so far, and find where each row's inputs and each panel's weights begin.
    places = []
    for r in range(rows):
        row = builder.load(builder.gep(y_at, [index(r)]))
        places += [_vector_at(builder, y, builder.add(row, index(q * WIDTH))) for q in range(panels)]
    before = [builder.load(place, align=4) for place in places]
    row_starts = [builder.add(x_at, builder.mul(x_step, index(r))) for r in range(rows)]
    panel_starts = [builder.add(first, builder.mul(step, index(q))) for q in range(panels)]

    # The loop over the inputs: add input k times its weights to the sums.
    loop, done = builder.append_basic_block("inputs"), builder.append_basic_block("done")
    builder.branch(loop)
    builder.position_at_end(loop)
    k = builder.phi(index)
    sums = [builder.phi(vector) for _ in places]
    at = builder.mul(k, index(WIDTH))
    w = [_weights_at(builder, weights, builder.add(start, at), vector) for start in panel_starts]
    if rows == 1:
        _fetch_ahead(builder, weights, panel_starts, step, k, depth)
    after = []
    for r in range(rows):
        x_k = _spread(builder, builder.load(builder.gep(x, [builder.add(row_starts[r], k)])), vector)
        after += [builder.call(fused, [x_k, w[q], sums[r * panels + q]]) for q in range(panels)]
    next_k = builder.add(k, index(1))
    for phi, old, new in zip([k, *sums], [index(0), *before], [next_k, *after], strict=True):
        phi.add_incoming(old, begin)
        phi.add_incoming(new, loop)
    builder.cbranch(builder.icmp_signed("<", next_k, depth), loop, done)
    builder.position_at_end(done)
    for place, total in zip(places, after, strict=True):
        builder.store(total, place, align=4)


def _fetch_ahead(builder, weights, panel_starts, step, k, depth):  # type: ignore[no-untyped-def]
    """At input k, fetch the panels' weights of input k + AHEAD, or of the next tile near the end of a panel.

    The processor also fetches in advance, but it starts anew at each panel, so a single row would wait for
    memory. panel_starts: index where each panel's weights begin. step: distance between panels. depth: number
    of inputs.
    """
    index, flag, cell = ir.IntType(64), ir.IntType(32), ir.IntType(8).as_pointer()
    fetch = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.VoidType(), [cell, flag, flag, flag]), "llvm.prefetch.p0"
    )
    later = builder.add(k, index(AHEAD))
    # In memory, a panel is followed by the other panels of this tile. Past its end, skip them to get to the
    # next tile.
    further = builder.select(
        builder.icmp_signed("<", later, depth), index(0), builder.mul(step, index(len(panel_starts) - 1))
    )
    distance = builder.add(builder.mul(later, index(WIDTH)), further)
    for start in panel_starts:
        place = builder.gep(weights, [builder.add(start, distance)])
        # The flags mean: 0, fetch to read; 3, keep in all caches; 1, data and not code.
        builder.call(fetch, [builder.bitcast(place, cell), flag(0), flag(3), flag(1)])


def _vector_at(builder, array, place):  # type: ignore[no-untyped-def]
    """A pointer to the WIDTH numbers of `array` from index `place` on."""
    vector = ir.VectorType(array.type.pointee, WIDTH)
    return builder.bitcast(builder.gep(array, [place]), vector.as_pointer())


def _weights_at(builder, weights, place, vector):  # type: ignore[no-untyped-def]
    """The WIDTH weights from index `place` on as float32. They are stored as float32 or int16."""
    stored = builder.load(_vector_at(builder, weights, place), align=2)
    if isinstance(weights.type.pointee, ir.FloatType):
        return stored
    return builder.sitofp(builder.sext(stored, ir.VectorType(ir.IntType(32), WIDTH)), vector)


def _spread(builder, number, vector):  # type: ignore[no-untyped-def]
    """A vector with `number` in all places."""
    undefined, lane = ir.Constant(vector, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(undefined, number, lane(0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(lane, WIDTH), [0] * WIDTH))


def _typed_tile(typing, rows, panels, weights_from, inputs_from, sums_at):  # type: ignore[no-untyped-def]
    """The signature and the code generator of the compiled function `_tile`, in the form that numba asks for.

    `_tile` adds the products of some inputs with `panels` panels of weights to `rows` rows of sums.

    rows, panels: compile-time constants. The other arguments are tuples of flat arrays and whole numbers.
    weights_from: the weights; index of the first panel's weights for these inputs; distance from one panel to
    the next. inputs_from: the inputs; index of the first row's inputs; distance from one row to the next;
    number of inputs in each row. sums_at: the sums; (rows,) index of each row's sums for the first panel.
    """
    if not (isinstance(rows, types.IntegerLiteral) and isinstance(panels, types.IntegerLiteral)):
        return None  # tells numba that `_tile` cannot be compiled for these arguments
    shape = rows.literal_value, panels.literal_value
    signature = types.void(rows, panels, weights_from, inputs_from, sums_at)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        tuples = [
            [
                _pointer(context, builder, *part)
                for part in zip(tuple_type, cgutils.unpack_tuple(builder, arg), strict=True)
            ]
            for tuple_type, arg in zip(signature.args[2:], args[2:], strict=True)
        ]
        _write_tile(builder, shape, *tuples)
        return context.get_dummy_value()

    return signature, generate


def _pointer(context, builder, kind, value):  # type: ignore[no-untyped-def]
    """The pointer to an array's numbers; any other value unchanged. kind: numba's type of the value."""
    return context.make_array(kind)(context, builder, value).data if isinstance(kind, types.Array) else value


_tile: Any = intrinsic(_typed_tile)


def _has_32_registers() -> bool:
    """Whether compiled code can use the 32 wide registers of AVX-512.

    False if the user chose a processor for numba (NUMBA_CPU_NAME): it may lack them.
    """
    return not getattr(config, "CPU_NAME", None) and bool(llvm.get_host_cpu_features().get("avx512f"))


# Number of panels in a tile with one row, with two or three rows, and with four to six rows. With two rows or
# more, the sums nearly fill the registers. They are enough to keep the processor busy, although each addition
# has to wait for the last one to the same sum. With one row the processor waits for memory anyway.
PANELS_FOR_1_ROW = 4
PANELS_FOR_3_ROWS, PANELS_FOR_6_ROWS = (4, 4) if _has_32_registers() else (2, 1)
ROWS = 6  # a tile has at most this many rows


@njit(forceinline=True, cache=False)
def multiply(
    weights: Any, start: int, panels: int, inputs: int, x: Any, rows: int, y: Any, y_at: Any
) -> None:
    """Add W x to y for each row x of inputs. All arrays are flat.

    weights: the matrix W as (panels, inputs, WIDTH), which begins at index `start`. x: (rows, inputs). y:
    each row's panels * WIDTH sums. y_at: (rows,) index in y where each row's sums begin.
    """
    sums_from = np.empty(ROWS, np.int64)  # for each row of a tile, index in y of its sums for the first panel
    tiles = -(-rows // ROWS)
    tile_panels = PANELS_FOR_1_ROW if rows == 1 else PANELS_FOR_3_ROWS if rows <= 3 else PANELS_FOR_6_ROWS
    # The inputs are divided into stretches of at most DEPTH inputs. For one row, one stretch is enough: each
    # weight is used once, so no weights need to stay in the cache.
    stretches = 1 if rows == 1 else -(-inputs // DEPTH)
    for stretch in range(stretches):
        first_input = inputs * stretch // stretches
        depth = inputs * (stretch + 1) // stretches - first_input
        panel = 0
        while panel < panels:
            together = tile_panels if panel + tile_panels <= panels else 1
            first = start + (panel * inputs + first_input) * WIDTH
            # All rows use these weights before the next ones. The rows are divided evenly among the tiles.
            for tile in range(tiles):
                row = rows * tile // tiles
                count = rows * (tile + 1) // tiles - row
                for r in range(count):
                    sums_from[r] = y_at[row + r] + panel * WIDTH
                weights_from = weights, first, inputs * WIDTH
                inputs_from = x, row * inputs + first_input, inputs, depth
                _call_tile(count, together, weights_from, inputs_from, (y, sums_from))
            panel += together


@njit(forceinline=True, cache=False)
def _call_tile(rows: int, panels: int, weights_from: Any, inputs_from: Any, sums_at: Any) -> None:
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
