"""Detection probabilities: how likely one look detects an item that is there, by item type.

Looks at one container from different viewpoints are independent trials. Two looks from one viewpoint count once:
misses from one place are correlated (Velez et al., JAIR 44, 2012).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import floor
from types import MappingProxyType
from typing import Literal

from workbench.errors import BadValue
from workbench.worlds.house import ItemType

Source = Literal["assumed", "calibrated", "site"]
"""Where a detection probability comes from: a setting, an estimate from logs, the site's file."""

SOURCES: tuple[Source, ...] = ("assumed", "calibrated", "site")

VIEWPOINT_M = 0.25
"""Viewpoints nearer to one another than this are one: what a look from one misses, the other misses as well."""

MAX_LOOKS = 3
"""Looks into one container, at most, where nobody knows that what is sought exists."""


def viewpoint_square(x_m: float, y_m: float) -> tuple[int, int]:
    """The square of the floor, VIEWPOINT_M wide, within which a viewpoint counts as the same."""
    return floor(x_m / VIEWPOINT_M), floor(y_m / VIEWPOINT_M)


@dataclass(frozen=True, slots=True, kw_only=True)
class Perception:
    """Detection probabilities of one look.

    Attributes:
        p_detect: for every item type that `by_type` does not name; in (0, 1].
        by_type: per item type, in (0, 1].
        source: where they come from.
        detector: what detects; empty where it has no name.

    Raises:
        BadValue: a probability outside (0, 1], or an unknown source.
    """

    p_detect: float = 1.0
    by_type: Mapping[ItemType, float] = field(default_factory=lambda: MappingProxyType({}))
    source: Source = "assumed"
    detector: str = ""

    def __post_init__(self) -> None:
        for p in (self.p_detect, *self.by_type.values()):
            if not 0 < p <= 1:
                raise BadValue("detection probability", p, "above 0 and at most 1")
        if self.source not in SOURCES:
            raise BadValue("source of detection probabilities", self.source, "one of " + ", ".join(SOURCES))

    @property
    def perfect(self) -> bool:
        """Whether every look shows everything."""
        return self.p_detect == 1.0 and all(p == 1.0 for p in self.by_type.values())

    def of(self, item_type: ItemType) -> float:
        """The chance that one look detects an item of that type where it is."""
        return self.by_type.get(item_type, self.p_detect)


PERFECT = Perception()
"""A look that shows everything."""


def missing_at(rate: float) -> Perception:
    """The perception of a robot that misses each item with this chance, and knows it.

    Raises:
        BadValue: a rate outside [0, 1).
    """
    if not 0 <= rate < 1:
        raise BadValue("miss rate", rate, "at least 0 and below 1")
    return Perception(p_detect=1.0 - rate, detector="simulated") if rate else PERFECT
