"""Rates of moving from pairs of scenes before and after: the episodes of AI2-THOR's rearrangement challenge.

A file holds one JSON object a line: {"scene": name, "moves": [[item type, from, to], ...]}. A type counts as present
in all episodes of a scene in which one of its kind ever moved. An episode counts as one day, which is an assumption:
the data say how often a type moves against others, and only logs of a household say how often that is.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import msgspec

from workbench.beliefs.memory.move_rates import OTHERS, RateRow
from workbench.errors import FileMissing, MalformedFile

SMOOTHING = 20.0
"""Episodes at the mean rate that are added to every type."""
MAX_LINE_BYTES = 1 << 20
MAX_LINES = 1_000_000


class _Episode(msgspec.Struct, frozen=True):
    scene: str
    moves: list[tuple[str, tuple[float, ...], tuple[float, ...]]]


def rates_from_episodes(path: Path) -> tuple[RateRow, ...]:
    """Moves a day by item type, sorted, with a first row for all other types.

    Raises:
        FileMissing, MalformedFile: no such file, or a line that is no episode.
    """
    episodes: Counter[str] = Counter()
    moved: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for episode in _episodes(path):
        episodes[episode.scene] += 1
        moved[episode.scene].update({move[0] for move in episode.moves})
    present: Counter[str] = Counter()
    moves: Counter[str] = Counter()
    for scene, counts in moved.items():
        for item_type, count in counts.items():
            present[item_type] += episodes[scene]
            moves[item_type] += count
    total, days = sum(moves.values()), sum(present.values())
    if not total:
        raise MalformedFile(path, "holds no episode in which something moved", "Give episodes with moves")
    mean = total / days
    rows = [
        RateRow(item_type=t, rate=_rate((moves[t] + SMOOTHING * mean) / (n + SMOOTHING)), moves=moves[t], days=n)
        for t, n in sorted(present.items())
    ]
    return (RateRow(item_type=OTHERS, rate=_rate(mean), moves=total, days=days), *rows)


def _rate(share: float) -> float:
    """Moves a day of what is found elsewhere after a day with this chance."""
    return -math.log1p(-min(share, 0.999))


def _episodes(path: Path) -> Iterator[_Episode]:
    if not path.is_file():
        raise FileMissing(path)
    opened = gzip.open if path.suffix == ".gz" else open
    number = 0
    try:
        with opened(path, "rb") as file:
            while line := file.readline(MAX_LINE_BYTES):
                number += 1
                if number > MAX_LINES:
                    raise MalformedFile(path, f"holds more than {MAX_LINES} lines", "Give fewer episodes")
                if line.strip():
                    yield msgspec.json.decode(line, type=_Episode)
    except (msgspec.MsgspecError, UnicodeDecodeError, OSError, EOFError, zlib.error) as error:
        what = f"line {number} is no episode ({error})"
        raise MalformedFile(path, what, 'Give one {"scene": ..., "moves": [[type, from, to], ...]} a line') from None
