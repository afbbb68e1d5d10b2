"""One run as the offline page plays it: arrays for continuous motion, and frames for discrete changes.

There is a frame for every moment at which a decision is made, an action begins or ends, or something is seen. What
frames share (colours, texts, paths) is stored once and referred to by number.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup

from dashboards.model.clock import Clock
from dashboards.model.containers.container_style import bar_colours, bar_heights_m, container_colours, left_labels
from dashboards.model.containers.item_marks import item_marks
from dashboards.model.containers.seen_items import items_seen
from dashboards.model.scene import STATUSES, Scene, scene_at
from dashboards.model.timeline import NEVER, Timeline
from dashboards.palette import Colour
from dashboards.panels.beliefs import beliefs
from dashboards.panels.comparison import comparison, divergences
from dashboards.panels.now import RunLegend, legend, now
from dashboards.panels.plots import plots
from dashboards.tabs import SCENE_PANELS
from workbench.planning.tasks import goal_types
from workbench.worlds.names import readable_name

MAX_ITEMS = 12
"""Item types that can be chosen in the page."""
MAX_FRAMES = 3000
"""Frames of a run; a longer run keeps its decisions first."""


class TextTable:
    """Texts that occur often, each stored once."""

    def __init__(self) -> None:
        self.all: list[Any] = []
        self._index: dict[Any, int] = {}

    def put(self, value: Any) -> int:
        """The number of a value: a text, or a list that JSON can hold."""
        key = value if isinstance(value, str) else repr(value)
        if key not in self._index:
            self._index[key] = len(self.all)
            self.all.append(value)
        return self._index[key]


def items_of(timeline: Timeline) -> tuple[str, ...]:
    """The item types that can be chosen: first those of the goal and the plans, then the most believed."""
    wanted = [t for t in goal_types(timeline.run.task.goal) if t in timeline.top_belief]
    for frame in timeline.decisions:
        steps = frame.plan.steps if frame.plan is not None else ()
        wanted += [s.item_types[0] for s in steps if s.action == "find" and s.item_types]
    wanted += sorted(timeline.item_types, key=lambda t: (-timeline.top_belief[t], t))
    return tuple(t for t in dict.fromkeys(wanted) if t in timeline.top_belief)[:MAX_ITEMS]


def run_data(
    timeline: Timeline, name: str, colour: Colour, texts: TextTable, *, signs: RunLegend | None = None
) -> dict[str, Any]:
    """A run for the page. A frame has one look for the item that the plan finds, and one for each that can be chosen.

    Args:
        texts: stores the markup of the panels.
        signs: what the legend needs for the runs shown together; given for the run in focus, the only one whose
            panels and marks the page has.
    """
    palettes, heights, marks, orders, paths = TextTable(), TextTable(), TextTable(), TextTable(), TextTable()
    balls, item_names, left = TextTable(), TextTable(), TextTable()
    items = items_of(timeline) if signs is not None else ()
    stamps = frame_stamps(timeline)
    frames: list[dict[str, Any]] = []
    for stamp in stamps:
        scene = scene_at(timeline, stamp)
        frame: dict[str, Any] = {"walked": round(scene.travel_m, 4), "ahead": paths.put(_points(scene.ahead))}
        if signs is not None:
            focused = [scene, *(scene_at(timeline, stamp, focus=item) for item in items)]
            seen = [_items(timeline, s) for s in focused]
            frame |= {
                "looks": [
                    [
                        palettes.put(container_colours(s).ravel().tolist()),
                        heights.put(np.round(bar_heights_m(s), 3).tolist()),
                        marks.put(_marks(s)),
                        texts.put(beliefs(s, timeline)),
                        texts.put(legend(s, signs, items=True)),
                        item_names.put(names),
                        left.put([list(words) for words in left_labels(s)]),
                        palettes.put(bar_colours(s).ravel().tolist()),
                    ]
                    for s, (_, names) in zip(focused, seen, strict=True)
                ],
                "items": balls.put(seen[0][0]),
                "order": orders.put(_order(scene, timeline)),
                "html": {key: texts.put(html) for key, html in _panels(scene, timeline).items()},
            }
        frames.append(frame)
    return _motion(timeline) | {
        "name": name,
        "colour": list(colour),
        "frameS": [round(timeline.seconds(s), 6) for s in stamps],
        "frames": frames,
        "items": [readable_name(item) for item in items],
        "palettes": palettes.all,
        "heights": heights.all,
        "marks": marks.all,
        "orders": orders.all,
        "ways": paths.all,
        "balls": balls.all,
        "itemNames": item_names.all,
        "left": left.all,
    }


def _motion(timeline: Timeline) -> dict[str, Any]:
    """What the page interpolates between frames, and the stamps that it steps to, in seconds."""
    return {
        "duration": round(timeline.duration_s, 6),
        "wayS": _list(timeline.path_s, 4),
        "wayX": _list(timeline.path_xy[:, 0]),
        "wayY": _list(timeline.path_xy[:, 1]),
        "wayM": _list(timeline.path_m, 4),
        "facing": _list(timeline.heading_rad),
        "imputed": np.flatnonzero(timeline.imputed).tolist(),
        "costS": _list(timeline.cost_s, 4),
        "cost": _list(timeline.cost),
        "decisions": [round(timeline.seconds(s), 6) for s in timeline.decision_ns],
        "actions": [round(timeline.seconds(s), 6) for s in timeline.action_ns],
        "searchS": sorted(
            round(timeline.seconds(int(s)), 6) for s in timeline.searched_ns[~timeline.passed] if s != NEVER
        ),
        "stop": _stop(timeline),
    }


def still_panels(clock: Clock, names: list[str]) -> dict[str, Any]:
    """Panels that do not change while the runs play; plots for each item that can be chosen."""
    last = [scene_at(t, t.end_ns) for t in clock.timelines]
    focus = next((s.focus for s in last if s.focus), "")
    chosen = (focus, *items_of(clock.timelines[0]))
    made: dict[str, Any] = {"plots": [plots(clock, names, item) for item in chosen]}
    if len(clock.timelines) > 1:
        made["comparison"] = comparison(clock, last, names) + divergences(clock, names)
    return made


def frame_stamps(timeline: Timeline) -> list[int]:
    """The stamps of frames in nanoseconds, in order; the run's start is always one."""
    decisions = {timeline.start_ns, timeline.end_ns, *timeline.decision_ns}
    others = {stamp for a in timeline.actions for stamp in (a.start.ns, a.stamp.ns)}
    others |= {int(s) for s in timeline.searched_ns if s != NEVER}
    more = sorted(others - decisions)
    room = max(0, MAX_FRAMES - len(decisions))
    kept = more if len(more) <= room else more[:: max(1, len(more) // room)] if room else []
    return sorted(decisions | set(kept))


def _panels(scene: Scene, timeline: Timeline) -> dict[str, Markup]:
    return {"now": now(scene)} | {name: panel(scene, timeline) for name, panel in SCENE_PANELS.items()}


def _marks(scene: Scene) -> dict[str, list[int]]:
    searched = scene.status == STATUSES.index("searched")
    seen = searched | (scene.status == STATUSES.index("known"))
    found = seen & scene.holds_focus
    return {
        "cross": np.flatnonzero(searched & ~scene.holds_focus).tolist(),
        "tick": np.flatnonzero(found).tolist(),
    }


def _items(timeline: Timeline, scene: Scene) -> tuple[list[list[float]], list[list[Any]]]:
    """The items seen by a moment: balls as [x, y, z, diameter, 1 for one of the goal], names as [words, x, y, z]."""
    seen = items_seen(timeline, scene.stamp_ns)
    made = item_marks(timeline.plan, seen, named=(), focus=scene.focus)
    table = np.column_stack([made.centre, made.size_m, made.wanted])
    return np.round(table, 3).tolist(), [[words, *np.round(at, 3).tolist()] for words, at in made.names]


def _stop(timeline: Timeline) -> list[float] | None:
    """When a replay had to end, in seconds, and at which container that nobody opened; None for other runs."""
    unseen = np.flatnonzero(scene_at(timeline, timeline.end_ns).unseen)
    outcome = timeline.run.outcome
    if outcome is None or not len(unseen):
        return None
    return [round(timeline.seconds(outcome.stamp.ns), 6), int(unseen[0])]


def _order(scene: Scene, timeline: Timeline) -> list[int]:
    index: dict[str, int] = {c.id: i for i, c in enumerate(timeline.plan.containers)}
    return [index[s.container] for s in scene.search_order if s.container in index]


def _points(path: np.ndarray) -> list[list[float]]:
    return np.round(path, 3).tolist()


def _list(values: np.ndarray, digits: int = 3) -> list[float]:
    return np.round(values, digits).tolist()
