"""Sixteen costs at a time: how costs are laid out, and the two operations on them that Numba does not write.

A cost matrix lies row by row, every row filled up to a multiple of LANES = 16 columns, so that a row is a
whole number of *lanes*: 16 neighbouring costs, one 512-bit register of float32 (or two of 256 bits, where a
processor has no more). Rows are filled up to a multiple of ROWS = 4, since four rows share every load of a
lane of the other clip. What fills up are copies of a clip's last frame: they change neither the least nor
the greatest cost, so nothing has to be masked until cells are counted.

Numba vectorises loops where it sees that it may, at 256 bits, and keeps sums in memory; here the lanes are
written out in LLVM's own vector types, which become the widest registers there are. A fused multiply-add
rounds once, on every processor alike.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

LANES = 16
ROWS = 4
# Costs that are compared at once, for the bits of a word.
WORD = 64
Count = TypeVar("Count", int, NDArray[np.int64])
_INDEX = ir.IntType(32)


def padded(count: Count, multiple: int) -> Count:
    """Return a number, or an array of numbers, rounded up to a multiple."""
    return -(-count // multiple) * multiple


def _fill_block(typingctx: Any, rows: Any, i: Any, lanes: Any, block: Any, out: Any, extremes: Any) -> Any:
    """Fill the costs of ROWS rows from i and the LANES columns of a block, and take part in the extremes.

    `rows` (m, d), `lanes` (blocks, d, LANES) and `out` (m, blocks * LANES) are of one type; `extremes`
    (2, LANES) holds the least and the greatest cost that each lane has met. Every cell adds its squared
    differences in the order of the dimensions, each by one fused multiply-add.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        arrays = [
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args, arguments, strict=True)
            if isinstance(kind, types.Array)
        ]
        rows, lanes, out, extremes = arrays
        i, block = arguments[1], arguments[3]
        depth = cgutils.unpack_tuple(builder, rows.shape)[1]
        width = cgutils.unpack_tuple(builder, out.shape)[1]
        begin = builder.mul(block, builder.mul(depth, i.type(LANES)))
        lane = _lane_type(context, signature.args[0])
        sums = [cgutils.alloca_once(builder, lane) for _ in range(ROWS)]
        row_numbers = [builder.add(i, i.type(r)) for r in range(ROWS)]
        for total in sums:
            builder.store(lane([0.0] * LANES), total)
        with cgutils.for_range(builder, depth) as loop:
            others = _load(builder, lanes, builder.add(begin, builder.mul(loop.index, i.type(LANES))), lane)
            for row, total in zip(row_numbers, sums, strict=True):
                place = builder.add(builder.mul(row, depth), loop.index)
                value = _in_every_place(builder, builder.load(builder.gep(rows.data, [place])), lane)
                difference = builder.fsub(others, value)
                fused = _call(builder, "fma", lane, [difference, difference, builder.load(total)])
                builder.store(fused, total)
        least, greatest = (_load(builder, extremes, i.type(side * LANES), lane) for side in (0, 1))
        for row, total in zip(row_numbers, sums, strict=True):
            cost = _call(builder, "sqrt", lane, [builder.load(total)])
            _store(
                builder, cost, out, builder.add(builder.mul(row, width), builder.mul(block, i.type(LANES)))
            )
            least = builder.select(builder.fcmp_ordered("<", cost, least), cost, least)
            greatest = builder.select(builder.fcmp_ordered(">", cost, greatest), cost, greatest)
        _store(builder, least, extremes, i.type(0))
        _store(builder, greatest, extremes, i.type(LANES))
        return context.get_dummy_value()

    return types.void(rows, types.intp, lanes, types.intp, out, extremes), generate


def _bits_at_most(typingctx: Any, costs: Any, place: Any, limit: Any) -> Any:
    """Compare the WORD costs from `place` with a limit: bit k is set where cost k is not above it."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        costs = context.make_array(signature.args[0])(context, builder, arguments[0])
        word = ir.VectorType(context.get_data_type(signature.args[0].dtype), WORD)
        kept = builder.fcmp_ordered(
            "<=", _load(builder, costs, arguments[1], word), _in_every_place(builder, arguments[2], word)
        )
        return builder.bitcast(kept, ir.IntType(WORD))

    return types.uint64(costs, types.intp, costs.dtype), generate


def _trailing_zeros(typingctx: Any, word: Any) -> Any:
    """Count the zero bits below the lowest set bit of a 64-bit word; 64 where there is none."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], cgutils.false_bit)

    return types.uint64(types.uint64), generate


fill_block: Any = intrinsic(_fill_block)
bits_at_most: Any = intrinsic(_bits_at_most)
trailing_zeros: Any = intrinsic(_trailing_zeros)


def _lane_type(context: Any, array: Any) -> ir.VectorType:
    return ir.VectorType(context.get_data_type(array.dtype), LANES)


def _load(builder: Any, array: Any, place: Any, vector: ir.VectorType) -> Any:
    loaded = builder.load(builder.bitcast(builder.gep(array.data, [place]), vector.as_pointer()))
    loaded.align = _element_bytes(vector)
    return loaded


def _store(builder: Any, value: Any, array: Any, place: Any) -> None:
    stored = builder.store(value, builder.bitcast(builder.gep(array.data, [place]), value.type.as_pointer()))
    stored.align = _element_bytes(value.type)


def _element_bytes(vector: ir.VectorType) -> int:
    return 4 if isinstance(vector.element, ir.FloatType) else 8


def _in_every_place(builder: Any, value: Any, vector: ir.VectorType) -> Any:
    nothing = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(nothing, value, _INDEX(0))
    return builder.shuffle_vector(first, nothing, ir.VectorType(_INDEX, vector.count)([0] * vector.count))


def _call(builder: Any, name: str, vector: ir.VectorType, operands: list[Any]) -> Any:
    kind = f"v{vector.count}f{8 * _element_bytes(vector)}"
    signature = ir.FunctionType(vector, [vector] * len(operands))
    return builder.call(
        cgutils.get_or_insert_function(builder.module, signature, f"llvm.{name}.{kind}"), operands
    )
