"""CRC-32 of bytes that are joined, from the checksums of their parts (as zlib's crc32_combine)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

POLYNOMIAL = 0xEDB88320
"""Of CRC-32 (ISO 3309), bits reversed."""
MAX_POWERS = 64
"""Of two, that a length can hold: one table each."""
Tables = tuple[tuple[int, ...], ...]


def combined_crc(first: int, second: int, second_bytes: int) -> int:
    """The checksum of two blocks in a row.

    Args:
        first: checksum of the first block.
        second: checksum of the second block.
        second_bytes: length of the second block.
    """
    power = 0
    while second_bytes:
        if second_bytes & 1:
            low, lower, higher, high = _zeros(power)
            first = low[first & 255] ^ lower[first >> 8 & 255] ^ higher[first >> 16 & 255] ^ high[first >> 24]
        second_bytes >>= 1
        power += 1
    return first ^ second


@lru_cache(maxsize=MAX_POWERS)
def _zeros(power: int) -> Tables:
    """What 2^power zero bytes make of a checksum: a table for each of its four bytes, the lowest first."""
    columns = _columns(power)
    return tuple(_table(columns[8 * byte : 8 * byte + 8]) for byte in range(4))


def _table(columns: Sequence[int]) -> tuple[int, ...]:
    """What becomes of each value of a byte."""
    table = [0]
    for column in columns:
        table += [found ^ column for found in table]
    return tuple(table)


@lru_cache(maxsize=MAX_POWERS)
def _columns(power: int) -> tuple[int, ...]:
    """The same as a matrix over bits: what becomes of a checksum in which a single bit is set."""
    if power > 0:
        half = _columns(power - 1)
        return tuple(_applied(half, column) for column in half)
    columns = tuple(POLYNOMIAL if bit == 0 else 1 << (bit - 1) for bit in range(32))  # one zero bit
    for _ in range(3):
        columns = tuple(_applied(columns, column) for column in columns)
    return columns


def _applied(columns: Sequence[int], value: int) -> int:
    found = 0
    for bit, column in enumerate(columns):
        if value >> bit & 1:
            found ^= column
    return found
