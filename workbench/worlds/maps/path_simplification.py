"""Reduction of a grid path to a few corner points, of the same length and over free cells only.

Between two of its cells, a shortest path may be replaced by one straight and one diagonal piece of the same total
length, if all their cells are free. So the length of the polyline equals the travel cost exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from workbench.arrays import Bools

Cell = tuple[int, int]


def corner_cells(free: Bools, cells: Sequence[Cell]) -> list[Cell]:
    """The corners of a path of adjacent cells, both ends included; of the same length and over free cells only."""
    if len(cells) < 2:
        return list(cells)
    corners = [cells[0]]
    start = 0
    while start < len(cells) - 1:
        end, via = start + 1, None
        for candidate in range(start + 2, len(cells)):
            if not _is_straight_enough(cells, start, candidate):
                break
            found = _elbow(free, cells[start], cells[candidate])
            if found is None:
                break
            end, via = candidate, found
        if via is not None and via not in (cells[start], cells[end]):
            corners.append(via)
        corners.append(cells[end])
        start = end
    return _without_midpoints(corners)


def _is_straight_enough(cells: Sequence[Cell], start: int, end: int) -> bool:
    """Whether the path between two of its cells is as short as on an empty grid."""
    (row0, column0), (row1, column1) = cells[start], cells[end]
    return max(abs(row1 - row0), abs(column1 - column0)) == end - start and _diagonals(cells, start, end) == min(
        abs(row1 - row0), abs(column1 - column0)
    )


def _diagonals(cells: Sequence[Cell], start: int, end: int) -> int:
    return sum(cells[i][0] != cells[i + 1][0] and cells[i][1] != cells[i + 1][1] for i in range(start, end))


def _elbow(free: Bools, a: Cell, b: Cell) -> Cell | None:
    """The cell between a straight and a diagonal piece (in either order) from a to b, if their cells are free."""
    rows, columns = b[0] - a[0], b[1] - a[1]
    diagonal = min(abs(rows), abs(columns))
    turn = (_sign(rows) * diagonal, _sign(columns) * diagonal)
    for via in ((a[0] + turn[0], a[1] + turn[1]), (b[0] - turn[0], b[1] - turn[1])):
        if _is_free(free, a, via) and _is_free(free, via, b):
            return via
    return None


def _is_free(free: Bools, a: Cell, b: Cell) -> bool:
    """Whether a straight or diagonal piece runs over free cells without cutting corners of obstacles."""
    step = (_sign(b[0] - a[0]), _sign(b[1] - a[1]))
    for row, column in _between(a, b, step):
        if not free[row, column]:
            return False
        if (
            step[0]
            and step[1]
            and (row, column) != b
            and not (free[row + step[0], column] and free[row, column + step[1]])
        ):
            return False
    return True


def _between(a: Cell, b: Cell, step: Cell) -> Iterator[Cell]:
    for i in range(max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1):
        yield (a[0] + i * step[0], a[1] + i * step[1])


def _without_midpoints(corners: Sequence[Cell]) -> list[Cell]:
    kept = [corners[0]]
    for here, after in zip(corners[1:], [*corners[2:], None], strict=True):
        if after is not None:
            into = (_sign(here[0] - kept[-1][0]), _sign(here[1] - kept[-1][1]))
            out = (_sign(after[0] - here[0]), _sign(after[1] - here[1]))
            if into == out:
                continue
        kept.append(here)
    return kept


def _sign(value: int) -> int:
    return (value > 0) - (value < 0)
