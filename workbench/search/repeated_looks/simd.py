"""The innermost step of the compiled program over look counts, eight targets at a time in the processor's registers.

Written in LLVM's intermediate language: numba does not know that the two arrays do not overlap, and so reads and
writes the minimum again for every candidate. Additions and comparisons are those of plain code, and so are results.
"""

# pyright: basic, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np
from llvmlite import binding, ir
from numba import config, njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from workbench.arrays import Floats, Uints64
from workbench.third_party.kernels import kernel

LANES = 8
"""Targets in one register (of 512 bits; LLVM splits it on machines that have smaller ones)."""

BLOCKS = (5, 2, 1)
"""Registers that are accumulated at once, from the most."""

TOGETHER = 2
"""Places whose minima are accumulated at once; with more, registers run short."""

PROCESSOR = config.CPU_NAME or binding.get_host_cpu_name()  # pyright: ignore[reportAttributeAccessIssue]
AS_INTEGERS = PROCESSOR in ("znver4", "znver5")
"""Costs are not negative, and such numbers are in the order of their bits. AMD's processors since Zen 4 compare
integers beside additions, but floating-point numbers only in turn with them."""

FLAGS = ("nnan", "ninf", "nsz")
VECTOR, INT = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(64)
BITS = ir.VectorType(INT, LANES)


@njit(nogil=True, inline="always")
def least(best: Floats, r: float, metres: Floats, left: Uints64, count: int, onward: Floats) -> None:
    """best[g] = min over c < count of r metres[left[c]] + onward[c, g].

    Args:
        best: shape (targets,), overwritten; a multiple of LANES.
        r: not negative, as are metres and onward.
        metres: shape (k,).
        left: which of metres belong to the rows of onward, at least `count` of them.
        count: at least 1.
        onward: shape (at least count, targets).
    """
    _least(best, r, metres, left, count, onward)  # pyright: ignore[reportCallIssue]


@njit(nogil=True, inline="always")
def least_together(
    best: Floats, rows: Uints64, r: float, metres: Floats, stood: Uints64, left: Uints64, count: int, onward: Floats
) -> None:
    """least() from TOGETHER places at once, which reads every row of onward once for all of them.

    Args:
        best: shape (places, targets); row rows[i] is overwritten for each of the places i.
        metres: shape (k, k); row i is from place i.
        stood: the places, at least TOGETHER of them.
        left, count, onward: as for least().
    """
    _least_together(best, rows, r, metres, stood, left, count, onward)  # pyright: ignore[reportCallIssue]


@njit(nogil=True, inline="always")
def price(
    onward: Floats, look: float, gain: Floats, reward: Floats, later: Floats, row: Uints64, left: Uints64, count: int
) -> None:
    """onward[c, g] = look + gain[c] reward[left[c], g] + later[row[left[c]], g] for c < count.

    Args:
        onward: shape (at least count, targets), overwritten; reward, later: shape (rows, targets).
        look: what the look itself is expected to cost.
    """
    _price(onward, look, gain, reward, later, row, left, count)  # pyright: ignore[reportCallIssue]


@intrinsic
def _price(typing, onward, look, gain, reward, later, row, left, count):
    given = (onward, types.float64, gain, reward, later, row, left, types.int64)
    return types.void(*given), _generate_price


@intrinsic
def _least(typing, best, r, metres, left, count, onward):
    return types.void(best, types.float64, metres, left, types.int64, onward), _generate


@intrinsic
def _least_together(typing, best, rows, r, metres, stood, left, count, onward):
    return types.void(best, rows, types.float64, metres, stood, left, types.int64, onward), _generate_together


def _generate(context, builder, signature, args):
    best, r, metres, *rest = _arrays(context, builder, signature, args)
    targets = cgutils.unpack_tuple(builder, best.shape)[0]
    return _over_targets(context, builder, ((best.data, metres.data),), targets, r, rest)


def _generate_together(context, builder, signature, args):
    best, rows, r, metres, stood, *rest = _arrays(context, builder, signature, args)
    targets, k = (cgutils.unpack_tuple(builder, array.shape)[1] for array in (best, metres))
    places = []
    for n in range(TOGETHER):
        place = builder.load(builder.gep(stood.data, [INT(n)]))
        row = builder.load(builder.gep(rows.data, [place]))
        places.append(
            (builder.gep(best.data, [builder.mul(row, targets)]), builder.gep(metres.data, [builder.mul(place, k)]))
        )
    return _over_targets(context, builder, places, targets, r, rest)


def _generate_price(context, builder, signature, args):
    onward, look, gain, reward, later, row, left, count = _arrays(context, builder, signature, args)
    targets = cgutils.unpack_tuple(builder, onward.shape)[1]
    looks = _in_every_lane(builder, look)

    def block(at, registers):
        with cgutils.for_range_slice(builder, INT(0), count, INT(1), INT) as (c, _):
            candidate = builder.load(builder.gep(left.data, [c]))
            gains = _in_every_lane(builder, builder.load(builder.gep(gain.data, [c])))
            there = builder.load(builder.gep(row.data, [candidate]))
            begin, found, after = (builder.add(at, builder.mul(i, targets)) for i in (c, candidate, there))
            for n in range(registers):
                rewards = builder.load(_register(builder, reward.data, found, n), align=8)
                onwards = builder.load(_register(builder, later.data, after, n), align=8)
                priced = builder.fadd(builder.fadd(looks, builder.fmul(gains, rewards)), onwards)
                builder.store(priced, _register(builder, onward.data, begin, n), align=8)

    return _in_blocks(context, builder, targets, block)


def _arrays(context, builder, signature, args):
    return [
        context.make_array(kind)(context, builder, value) if isinstance(kind, types.Array) else value
        for kind, value in zip(signature.args, args, strict=True)
    ]


def _over_targets(context, builder, places, targets, r, rest):
    """All targets, block by block; places are pairs of pointers to a result and to its metres."""
    return _in_blocks(context, builder, targets, lambda at, n: _block(builder, at, n, places, r, rest, targets))


def _in_blocks(context, builder, targets, block):
    """block(at, registers) for all targets, the most registers first."""
    first = INT(0)
    for registers in BLOCKS:
        step = INT(registers * LANES)
        end = builder.sub(targets, builder.srem(builder.sub(targets, first), step))
        with cgutils.for_range_slice(builder, first, end, step, INT) as (at, _):
            block(at, registers)
        first = end
    return context.get_dummy_value()


def _block(builder, at, registers, places, r, rest, targets):
    """The loop over candidates for so many registers of targets from `at` on."""
    left, count, onward = rest

    def legs_of(metres, candidate):
        """r metres[candidate] in every lane."""
        return _in_every_lane(builder, builder.fmul(r, builder.load(builder.gep(metres, [candidate]))))

    def sums(c):
        """r metres[left[c]] + onward[c, at:], a register each, place by place."""
        candidate = builder.load(builder.gep(left.data, [c]))
        row = builder.add(at, builder.mul(c, targets))
        rows = [builder.load(_register(builder, onward.data, row, n), align=8) for n in range(registers)]
        return [builder.fadd(legs, row) for legs in [legs_of(m, candidate) for _, m in places] for row in rows]

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
        builder.store(phi, _register(builder, places[n // registers][0], at, n % registers), align=8)


def _register(builder, array, at, n):
    """A pointer to the n-th register of an array from an index on."""
    place = builder.gep(array, [builder.add(at, INT(n * LANES))])
    return builder.bitcast(place, VECTOR.as_pointer())


def _in_every_lane(builder, number):
    one = builder.insert_element(VECTOR(ir.Undefined), number, ir.IntType(32)(0))
    return builder.shuffle_vector(one, VECTOR(ir.Undefined), ir.VectorType(ir.IntType(32), LANES)([0] * LANES))


def _lesser(builder, new, old):
    if AS_INTEGERS:
        new, old = builder.bitcast(new, BITS), builder.bitcast(old, BITS)
        return builder.bitcast(builder.select(builder.icmp_signed("<", new, old), new, old), VECTOR)
    return builder.select(builder.fcmp_ordered("<", new, old, flags=FLAGS), new, old)


@kernel()
def aligned(rows, targets):
    """Zeros of shape (rows, targets) in which every register begins at a line of the processor's cache."""
    flat = np.zeros(rows * targets + LANES)
    skip = (-(flat.ctypes.data // 8)) % LANES
    return flat[skip : skip + rows * targets].reshape(rows, targets)
