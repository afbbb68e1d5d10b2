"""Connects clicks in panels and the page's address to the server, by a small script and one visible field.

Viser shows HTML in panels but receives no events from it. The script writes commands into the "Go to" field, which
people can type into as well; the address is kept current with the History API. Without scripts everything else works.
"""

from __future__ import annotations

from json import dumps
from typing import Any
from urllib.parse import parse_qs, urlencode

import viser
from markupsafe import Markup

from dashboards.model.clock import ALIGNMENTS
from dashboards.panels.markup import html
from dashboards.resources import resource
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_state import MAX_RUNS, ViewState
from workbench.errors import BadValue

SCRIPTS = ("panels/panels.js", "panels/help.js", "viser_app/bridge.js", "viser_app/dock.js")
THEMES = ("light", "dark")
WALLS = ("cut", "whole", "none")
MAX_FIELDS = 40
"""The most fields of an address; none of ours has as many."""
PAGE = "> "
"""Before commands of the page itself, which are whole as they come; people type theirs letter by letter."""
VERBS = ("seek", "decision", "open", "overlay", "look")
WANTED = "seconds, as 12.5, or one of: decision 7, seek 12.5, open 2, overlay 3, look 5, filter lios, page 2"
DIGITS = 6
"""Of a run's number, at most."""


def script() -> Markup:
    """The markup that installs the scripts once, with the style of what they lay out."""
    code = "".join(resource(name) for name in SCRIPTS)
    sheet = Markup(resource("viser_app/dock.css"))
    return html('<style>{}</style><img src="data:," alt="" style="display:none" onerror="{}">', sheet, code)


def update_address(query: str) -> Markup:
    """Markup that puts a query into the page's address without reloading it; the page adds the tab in front."""
    code = f"window.liosAddress({dumps('?' + query)})"
    return html('<img src="data:," alt="" style="display:none" onerror="{}">', code)


def scale_bar(width_px: float, words: str) -> Markup:
    """Markup that shows a bar of a width and what length it is in the view's corner."""
    shown = f"window.liosScale({width_px:.1f},{dumps(words)})"
    code = f"(function show(){{window.liosScale?{shown}:setTimeout(show,100)}})()"  # the script may come later
    return html('<img src="data:," alt="" style="display:none" onerror="{}">', code)


def choose_tab(label: str, count: int) -> Markup:
    """Markup that brings a tab to the front, each time that the count differs."""
    code = f"window.liosTab({dumps(label)})/*{count}*/"
    return html('<img src="data:," alt="" style="display:none" onerror="{}">', code)


def address(state: ViewState, camera: viser.CameraHandle | None) -> str:
    """The query of a link that restores a view: runs, moment, clock, item, walls, camera."""
    words: dict[str, str] = {"runs": ",".join(str(r) for r in state.runs), "at": _exact(state.at)}
    if state.alignment != "time":
        words["clock"] = state.alignment
    if state.focus:
        words["item"] = state.focus
    if state.container:
        words["container"] = state.container
    if state.truth:
        words["truth"] = "1"
    if state.walls != "cut":
        words["walls"] = state.walls
    if state.theme:
        words["theme"] = state.theme
    if state.follow:
        words["follow"] = "1"
    if camera is not None and camera.image_height:
        words["initialCameraPosition"] = ",".join(f"{v:.3f}" for v in camera.position)
        words["initialCameraLookAt"] = ",".join(f"{v:.3f}" for v in camera.look_at)
    return urlencode(words, safe=",")


def _exact(reading: float) -> str:
    """To the nanosecond: a decision's own stamp must not be rounded to before it."""
    return f"{reading:.9f}".rstrip("0").rstrip(".")


def parse_query(query: str, *, runs: int) -> dict[str, Any]:
    """The changes of state that a query asks for; invalid fields are ignored.

    Args:
        query: "?runs=0,1&at=12.5".
        runs: how many logs there are.
    """
    query = "&".join(query.lstrip("?").split("&", MAX_FIELDS)[:MAX_FIELDS])
    words = {key: values[-1] for key, values in parse_qs(query).items()}
    changes: dict[str, Any] = {}
    chosen = [run for run in _runs(words.get("runs", "")) if run < runs]
    if chosen:
        changes["runs"] = tuple(dict.fromkeys(chosen))[:MAX_RUNS]
    at = _number(words.get("at"))
    if at is not None:
        changes["at"] = max(0.0, at)
    if words.get("clock") in ALIGNMENTS:
        changes["alignment"] = words["clock"]
    if words.get("walls") in WALLS:
        changes["walls"] = words["walls"]
    if words.get("theme") in THEMES:
        changes["theme"] = words["theme"]
    if words.get("scheme") in THEMES:
        changes["system_theme"] = words["scheme"]
    if "item" in words:
        changes["focus"] = words["item"]
    if "container" in words:
        changes["container"] = words["container"]
    if words.get("truth") == "1":
        changes["truth"] = True
    if words.get("follow") == "1":
        changes["follow"] = True
    return changes


def execute_command(session: BrowserSession, words: str) -> None:
    """Executes a command: "12.5", "seek 12.5", "decision 7", "open 3", "overlay 3", "look 5".

    Raises:
        BadValue: words that are none of these, or a number that there is not.
    """
    verb, _, rest = words.strip().partition(" ")
    value = _number(rest) if rest else _number(verb)
    if not verb:
        return
    if verb == "open" and _runs(rest):
        session.open_runs(tuple(_runs(rest)[:MAX_RUNS]))
    elif verb == "address":
        changes = parse_query(rest, runs=len(session.library.paths))
        if changes:
            session.change(**changes)
    elif verb == "drawn":
        session.show_planned_paths()
    elif verb in session.listers:
        session.listers[verb](rest.strip())
    elif value is None or (rest and verb not in VERBS):
        raise BadValue("Go to", words.strip(), WANTED)
    elif verb == "decision":
        stops = session.clock.decisions()
        if not 1 <= int(value) <= len(stops):
            raise BadValue("Go to", words.strip(), f"a decision from 1 to {len(stops)}")
        session.change(at=stops[int(value) - 1], playing=False)
    elif verb == "overlay":
        session.toggle_run(int(value))
    elif verb == "look":
        session.open_container(int(value))
    elif verb == "seek" or not rest:
        session.change(at=min(max(value, 0.0), session.clock.end), playing=False)


def _runs(words: str) -> list[int]:
    """ "0,1" as numbers; invalid ones are ignored."""
    parts = (part.strip() for part in words.split(","))
    return [int(part) for part in parts if part.isdecimal() and len(part) <= DIGITS]


def _number(words: str | None) -> float | None:
    try:
        value = float(words) if words else None
    except ValueError:
        return None
    return value if value is not None and abs(value) < 1e12 else None
