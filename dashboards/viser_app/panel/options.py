"""Controls of the View tab: item, clock, speed, walls and layers of one browser.

They change the session's state, and follow it when a link or another control has changed it.
"""

from __future__ import annotations

from typing import Any, final

import viser

from dashboards.model.clock import ALIGNMENTS
from dashboards.model.scene import AUTOMATIC
from dashboards.viser_app.session import BrowserSession
from workbench.worlds.names import readable_name

SPEEDS = ("0.25×", "0.5×", "1×", "2×", "4×", "8×", "16×")
FOLLOW_PLAN: str = "as the plan finds"
ITEMS: tuple[str, ...] = (FOLLOW_PLAN,)
WALLS = {"cut": "cut away", "whole": "whole", "none": "none"}
THEMES = {"": "as the system", "light": "light", "dark": "dark"}
LAYERS = (
    ("Belief as bars", "bars"),
    ("Order of search", "orders"),
    ("Room names", "room_names"),
    ("Unopened marked", "unopened"),
    ("Items seen", "items"),
    ("Names of all items", "item_names"),
    ("Sight", "sight"),
    ("Occupancy map", "occupancy"),
    ("Pictures", "pictures"),
    ("Point clouds", "points"),
    ("Local grid", "grid"),
    ("Follow the robot", "follow"),
)
"""Check boxes, each with its field of the state."""


@final
class Options:
    """The controls; made inside the tab that holds them."""

    def __init__(self, session: BrowserSession) -> None:
        gui, state = session.client.gui, session.state
        self._session = session
        self._types: dict[str, str] = {}
        self._focus = gui.add_dropdown("Item", ITEMS)
        self._focus.on_update(lambda e: self._change(e, focus=self._types.get(self._focus.value, AUTOMATIC)))
        clocks = [str(alignment) for alignment in ALIGNMENTS]
        self._align = gui.add_dropdown("Clock", clocks, hint="The clock by which several runs are aligned.")
        self._align.on_update(self._realign)
        speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1×")
        speed.on_update(lambda e: self._change(e, speed=float(speed.value.rstrip("×"))))
        self._loop = gui.add_checkbox("Loop", False)
        self._loop.on_update(lambda e: self._change(e, loop=self._loop.value))
        self._walls = gui.add_dropdown("Walls", tuple(WALLS.values()))
        self._walls.on_update(lambda e: self._change(e, walls=_key(WALLS, self._walls.value)))
        self._theme = gui.add_dropdown("Colours", tuple(THEMES.values()))
        self._theme.on_update(lambda e: self._change(e, theme=_key(THEMES, self._theme.value)))
        self._boxes: dict[str, viser.GuiCheckboxHandle] = {}
        for label, field in LAYERS:
            box = self._boxes[field] = gui.add_checkbox(label, getattr(state, field))
            box.on_update(lambda e, b=box, f=field: self._change(e, **{f: b.value}))
        cameras = gui.add_button_group("Camera", ("Fit", "From above"))
        cameras.on_click(lambda event: session.look(from_above=event.target.value == "From above"))

    def offer(self, item_types: tuple[str, ...]) -> None:
        """Item types of the run in focus."""
        self._types = {f"{readable_name(t)} ({t})" if readable_name(t) != t else t: t for t in item_types}
        options = (FOLLOW_PLAN, *self._types)
        if self._focus.options != options:
            self._focus.options = options

    def follow(self) -> None:
        """Shows the current state."""
        state = self._session.state
        focus = _key(self._types, state.focus) or FOLLOW_PLAN
        for dropdown, value in (
            (self._align, state.alignment),
            (self._walls, WALLS[state.walls]),
            (self._theme, THEMES[state.theme]),
            (self._focus, focus),
        ):
            if dropdown.value != value:
                dropdown.value = value
        for field, box in self._boxes.items():
            if box.value != getattr(state, field):
                box.value = getattr(state, field)
        if self._loop.value != state.loop:
            self._loop.value = state.loop

    def _change(self, event: viser.GuiEvent[Any], **changes: object) -> None:
        """Applies a person's choice; changes by the server call back without a client."""
        if event.client is not None:
            self._session.change(at=None, **changes)

    def _realign(self, event: viser.GuiEvent[Any]) -> None:
        """Switches to another clock at the same moment of the run in focus."""
        chosen = ALIGNMENTS[ALIGNMENTS.index(self._align.value)]
        if event.client is not None and chosen != self._session.state.alignment:
            self._session.align(chosen)


def _key(table: dict[str, str], value: str) -> str:
    """The key of a value; empty for none."""
    return next((key for key, other in table.items() if other == value), "")
