"""The state that decides what one browser shows: runs, moment, clock, item, layers."""

from __future__ import annotations

from dataclasses import dataclass

from dashboards.model.clock import Alignment
from dashboards.model.scene import AUTOMATIC

MAX_RUNS = 24
"""Runs that one browser shows at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewState:
    """Everything that decides what one browser shows; a link restores it."""

    runs: tuple[int, ...]
    at: float = 0.0
    alignment: Alignment = "time"
    focus: str = AUTOMATIC
    container: str = ""
    """The id of the container that is opened in its panel, "" for none."""
    truth: bool = False
    """Shows the true contents of that container, where the log holds them."""
    walls: str = "cut"
    theme: str = ""
    """Light or dark; "" follows the system's preference, as the page reports it."""
    system_theme: str = "light"
    playing: bool = False
    speed: float = 1.0
    loop: bool = False
    live: bool = False
    """Stays at the end of a run that is being recorded, until a person looks elsewhere."""
    follow: bool = False
    bars: bool = True
    orders: bool = True
    room_names: bool = True
    unopened: bool = True
    items: bool = True
    """Marks the items that were seen."""
    item_names: bool = False
    """Names all of them; otherwise only those of the goal and of the opened container."""
    sight: bool = True
    """Draws how far the robot sees in passing, and what it saw so."""
    occupancy: bool = False
    pictures: bool = True
    points: bool = True
    grid: bool = False
