"""The tags of ar_track_alvar as a dictionary for OpenCV, which has none of them.

A tag is 5 by 5 squares within a black border two squares wide (MarkerData of ALVAR with its defaults for ROS,
ar_track_alvar/src/Marker.cpp, and BitsetExt for the code). The middle row, alternating, and the four other squares of
the middle column say what size it has and which way is up; the other sixteen squares, row by row, hold a number of 8
bits as two blocks of the extended Hamming(8,4) code, 1 being black.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from workbench.arrays import Uints8

COUNT = 256
"""Numbers 0 to 255; larger ones are on tags of 7 by 7 squares and more, which are not read."""
SIDE, BORDER = 5, 2
"""Squares across the code, and of the black border on each side."""
CORRECTED = 0
"""Wrong squares that are put right: none, though codes differ in at least four: 25 squares are soon met by chance."""


def alvar_code(number: int) -> Uints8:
    """The squares of a tag that stands upright, shape (5, 5): 1 for white, 0 for black.

    Raises:
        ValueError: the number is not within 0 to 255.
    """
    if not 0 <= number < COUNT:
        raise ValueError(f"tags of 5 by 5 squares have numbers from 0 to {COUNT - 1}, not {number}")
    black = np.zeros((SIDE, SIDE), dtype=np.uint8)
    middle = SIDE // 2
    black[middle, 1::2] = 1
    black[:middle, middle] = 1
    data = [*_block(number >> 4), *_block(number & 0xF)]
    free = [(row, column) for row in range(SIDE) for column in range(SIDE) if middle not in (row, column)]
    for (row, column), bit in zip(free, data, strict=True):
        black[row, column] = bit
    return 1 - black


def _block(nibble: int) -> list[int]:
    """Four bits as a block of the extended Hamming code: parities at places 1, 2 and 4, and over all seven at 8."""
    d1, d2, d3, d4 = ((nibble >> shift) & 1 for shift in (3, 2, 1, 0))
    block = [d1 ^ d2 ^ d4, d1 ^ d3 ^ d4, d1, d2 ^ d3 ^ d4, d2, d3, d4]
    return [*block, sum(block) % 2]


@lru_cache(maxsize=1)
def _codes() -> tuple[Uints8, ...]:
    return tuple(alvar_code(number) for number in range(COUNT))


def alvar_dictionary(cv2: Any) -> Any:
    """The tags as a dictionary of OpenCV's aruco module; their border is BORDER squares wide."""
    rows = [cv2.aruco.Dictionary.getByteListFromBits(code) for code in _codes()]
    return cv2.aruco.Dictionary(np.concatenate(rows), SIDE, CORRECTED)
