"""The codes of ar_track_alvar's tags, by hand and as a code."""

from __future__ import annotations

import numpy as np
import pytest

from recorders.spot.tags.alvar import COUNT, alvar_code


def _drawn(number: int) -> list[str]:
    return ["".join(".#"[1 - square] for square in row) for row in alvar_code(number).tolist()]


def test_by_hand_the_squares_of_two_tags() -> None:
    """0: only what says the size and which way is up is black. 183 is 1011 0111, whose blocks are 0110 0110 and 0001
    1110: data at places 3, 5, 6 and 7, parities at 1, 2, 4 and 8."""
    assert _drawn(0) == ["..#..", "..#..", ".#.#.", ".....", "....."]
    assert _drawn(183) == [".###.", ".###.", ".#.#.", "....#", "##.#."]


def test_codes_differ_in_four_squares_however_they_are_turned() -> None:
    turned = np.array([[np.rot90(alvar_code(number), k).ravel() for k in range(4)] for number in range(COUNT)])
    every = turned.reshape(-1, 25)
    for number in range(COUNT):
        apart = (every != turned[number, 0]).sum(axis=1)
        apart[4 * number] = 25
        assert apart.min() >= 4, number


def test_a_number_that_has_no_tag_of_this_size_is_refused() -> None:
    with pytest.raises(ValueError, match="0 to 255"):
        alvar_code(256)
