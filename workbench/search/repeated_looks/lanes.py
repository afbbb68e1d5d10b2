"""The innermost step of the compiled program over look counts, eight targets at a time in the processor's registers.

Written in LLVM's intermediate language: numba does not know that the two arrays do not overlap, and so reads and
writes the minimum again for every candidate. Additions and comparisons are those of plain code, and so are results.
"""

# pyright: basic, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from workbench.arrays import Floats, Ints

LANES = 8
"""Targets in one register (of 512 bits; LLVM splits it on machines that have smaller ones)."""

BLOCKS = (5, 2, 1)
"""Registers that are accumulated at once, from the most."""

FLAGS = ("nnan", "ninf", "nsz")
VECTOR, INT = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(64)


@njit(nogil=True, inline="always")
def least(best: Floats, r: float, metres: Floats, left: Ints, count: int, onward: Floats) -> None:
    """best[g] = min over c < count of r metres[left[c]] + onward[c, g].

    Args:
        best: shape (targets,), overwritten; a multiple of LANES.
        metres: shape (k,).
        left: which of metres belong to the rows of onward, at least `count` of them.
        count: at least 1.
        onward: shape (at least count, targets).
    """
    _least(best, r, metres, left, count, onward)  # pyright: ignore[reportCallIssue]


@intrinsic
def _least(typing, best, r, metres, left, count, onward):
    return types.void(best, types.float64, metres, left, types.int64, onward), _generate


def _generate(context, builder, signature, args):
    arrays = [
        context.make_array(kind)(context, builder, value) if isinstance(kind, types.Array) else value
        for kind, value in zip(signature.args, args, strict=True)
    ]
    targets = cgutils.unpack_tuple(builder, arrays[0].shape)[0]
    first = INT(0)
    for registers in BLOCKS:
        step = INT(registers * LANES)
        end = builder.sub(targets, builder.srem(builder.sub(targets, first), step))
        with cgutils.for_range_slice(builder, first, end, step, INT) as (at, _):
            _block(builder, at, registers, arrays, targets)
        first = end
    return context.get_dummy_value()


def _block(builder, at, registers, arrays, targets):
    """The loop over candidates for so many registers of targets from `at` on."""
    best, r, metres, left, count, onward = arrays

    def sums(c):
        """r metres[left[c]] + onward[c, at:], a register each."""
        candidate = builder.load(builder.gep(left.data, [c]))
        leg = builder.fmul(r, builder.load(builder.gep(metres.data, [candidate])))
        one = builder.insert_element(VECTOR(ir.Undefined), leg, ir.IntType(32)(0))
        legs = builder.shuffle_vector(one, VECTOR(ir.Undefined), ir.VectorType(ir.IntType(32), LANES)([0] * LANES))
        row = builder.add(at, builder.mul(c, targets))
        return [
            builder.fadd(legs, builder.load(_register(builder, onward, row, n), align=8)) for n in range(registers)
        ]

    start, before = sums(INT(0)), builder.block
    loop, after = builder.append_basic_block("candidates"), builder.append_basic_block("least")
    builder.cbranch(builder.icmp_signed(">", count, INT(1)), loop, after)
    with builder.goto_block(loop):
        c = builder.phi(INT)
        so_far = [builder.phi(VECTOR) for _ in start]
        lesser = [_lesser(builder, new, old) for new, old in zip(sums(c), so_far, strict=True)]
        following = builder.add(c, INT(1))
        for phi, begin, onwards in zip((c, *so_far), (INT(1), *start), (following, *lesser), strict=True):
            phi.add_incoming(begin, before)
            phi.add_incoming(onwards, loop)
        builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
    builder.position_at_end(after)
    least_of = [builder.phi(VECTOR) for _ in start]
    for n, phi in enumerate(least_of):
        phi.add_incoming(start[n], before)
        phi.add_incoming(lesser[n], loop)
    for n, phi in enumerate(least_of):
        builder.store(phi, _register(builder, best, at, n), align=8)


def _register(builder, array, at, n):
    """A pointer to the n-th register of an array from an index on."""
    place = builder.gep(array.data, [builder.add(at, INT(n * LANES))])
    return builder.bitcast(place, VECTOR.as_pointer())


def _lesser(builder, new, old):
    return builder.select(builder.fcmp_ordered("<", new, old, flags=FLAGS), new, old)


@njit(cache=True, nogil=True)
def aligned(rows, targets):
    """Zeros of shape (rows, targets) in which every register begins at a line of the processor's cache."""
    flat = np.zeros(rows * targets + LANES)
    skip = (-(flat.ctypes.data // 8)) % LANES
    return flat[skip : skip + rows * targets].reshape(rows, targets)
