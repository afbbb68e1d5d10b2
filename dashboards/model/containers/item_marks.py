"""Marks of the items that were seen, as every view draws them: the position of each, and the names beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from dashboards.model.containers.item_spots import item_spots
from dashboards.model.containers.seen_items import ItemPlace
from dashboards.model.labels import label
from workbench.arrays import Bools, Floats32
from workbench.worlds.house import FloorPlan
from workbench.worlds.names import readable_name

MAX_MARKS = 48
"""Items of one container that are drawn; the container's panel lists all."""
MAX_NAMES = 40
"""Names that stand in the view at once, those of the goal first."""
MAX_IN_LINE = 3
"""Item types that the line over a container names."""
STAGGER_M, LEVELS = 0.1, 3
"""Names stand at three heights by turns, to be legible beside their neighbours."""
LINE_UP_M = 0.12
"""Height of the line over the marks of a container."""
Point3 = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemMarks:
    """All marks of a moment.

    Attributes:
        centre: in metres on the map, float32 (n, 3); size_m: diameters, float32 (n,).
        wanted: whether the goal names the item's type, bool (n,).
        names: what stands over which point, "egg x 3".
    """

    centre: Floats32
    size_m: Floats32
    wanted: Bools
    names: tuple[tuple[str, Point3], ...]


def item_marks(plan: FloorPlan, places: Sequence[ItemPlace], *, named: Sequence[int], focus: str) -> ItemMarks:
    """The marks of items, in order of their containers.

    Args:
        places: as `items_seen` gives them.
        named: indices of containers all of whose items have their name beside them; elsewhere one line over a
            container names those of the goal and in focus.
        focus: an item type.
    """
    centres: list[Floats32] = []
    sizes: list[float] = []
    wanted: list[bool] = []
    names: list[tuple[bool, str, Point3]] = []
    for container, found in groupby(places, key=lambda p: p.container):
        here = list(found)[:MAX_MARKS]
        spots, size_m = item_spots(plan.containers[container], len(here))
        centres.append(spots)
        sizes += [size_m] * len(here)
        wanted += [p.wanted for p in here]
        kinds = _kinds(here)
        if container in named:
            for i, (first, count, words) in enumerate(kinds):
                x, y, z = (float(v) for v in spots[first : first + count].mean(axis=0))
                names.append((True, words, (x, y, z + size_m / 2 + STAGGER_M * (i % LEVELS))))
        else:
            shown = [kind for kind in kinds if here[kind[0]].wanted or here[kind[0]].item_type == focus]
            if shown:
                x, y, z = (float(v) for v in spots.mean(axis=0))
                more = f" + {len(shown) - MAX_IN_LINE}" if len(shown) > MAX_IN_LINE else ""
                line = label(", ".join(words for _, _, words in shown[:MAX_IN_LINE])) + more
                names.append((any(here[first].wanted for first, _, _ in shown), line, (x, y, z + LINE_UP_M)))
    names.sort(key=lambda entry: not entry[0])
    return ItemMarks(
        centre=np.concatenate(centres) if centres else np.zeros((0, 3), dtype=np.float32),
        size_m=np.array(sizes, dtype=np.float32),
        wanted=np.array(wanted, dtype=np.bool_),
        names=tuple((words, at) for _, words, at in names[:MAX_NAMES]),
    )


def _kinds(here: Sequence[ItemPlace]) -> list[tuple[int, int, str]]:
    """The item types of one container: where each begins, how many there are, and its name."""
    kinds: list[tuple[int, int, str]] = []
    first = 0
    for item_type, same in groupby(here, key=lambda p: p.item_type):
        count = len(list(same))
        kinds.append((first, count, label(readable_name(item_type)) + (f" x {count}" if count > 1 else "")))
        first += count
    return kinds
