"""Panel of containers by belief, with the intended order of search."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from dashboards.model.scene import STATUSES, Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import GOAL, css
from dashboards.panels.markup import bar, chip, command, html, name, number, percent, place, table, text
from workbench.belief_colours import belief_colours
from workbench.planning.tasks import goal_locations
from workbench.worlds.house import Container
from workbench.worlds.names import readable_name

MAX_ROWS = 60
MAX_ROOM_CHARS = 20
HINTS = {
    "#": "Place in the intended order of search",
    "belief": "Probability that the container holds the item. They may add up to more than 1, since "
    "a house may hold several such items",
    "leg m": "Metres from the stop before it in the order of search",
}


def beliefs(scene: Scene, timeline: Timeline) -> Markup:
    """All containers: most believed first, then searched ones."""
    plan = timeline.plan
    if not plan.containers:
        return Markup('<div class="lp"><p class="muted">This log has no containers.</p></div>')
    believed = np.nan_to_num(np.where(np.isnan(scene.belief), scene.left, scene.belief), nan=-1.0)
    ranked = sorted(range(len(believed)), key=lambda i: (-believed[i], plan.containers[i].id))
    legs = {stop.container: stop.leg_m for stop in scene.search_order}
    top = scene.top_belief or 1.0
    rooms = {room.id: readable_name(room.kind) for room in plan.rooms}
    goal = {str(location) for location in goal_locations(timeline.run.task.goal)}
    rows: list[list[str]] = []
    for i in ranked[:MAX_ROWS]:
        container = plan.containers[i]
        p = float(scene.belief[i])
        rows.append(
            [
                str(int(scene.order[i])) if scene.order[i] else "",
                _link(i, container) + (" " + chip("goal", css(GOAL)) if container.id in goal else Markup("")),
                name(rooms.get(container.room, ""), max_chars=MAX_ROOM_CHARS),
                bar(p / top, css(belief_colours(p / top))) if p == p else _status(scene, timeline, i),
                percent(p) if p == p else _left(scene, i),
                number(legs.get(container.id)),
            ]
        )
    more = html('<p class="muted">and {} more</p>', len(ranked) - MAX_ROWS) if len(ranked) > MAX_ROWS else ""
    head = ("#", "container", "room", "belief", "", "leg m")
    shown = table(head, rows, key="beliefs", classes=("n", "", "", "", "n", "n"), hints=HINTS)
    return html('<div class="lp">{}{}{}</div>', shown, more, _sum(scene))


def _sum(scene: Scene) -> Markup:
    """What the probabilities add up to; nothing where there is no belief."""
    known = scene.belief[~np.isnan(scene.belief)]
    if not known.size:
        return Markup("")
    total = number(float(known.sum()), 2)
    return html('<p class="muted">Adds up to {}: the expected number of containers that hold it.</p>', total)


def _link(index: int, container: Container) -> Markup:
    """As the other panels name it; a click opens it."""
    return html(
        '<span class="seek" {} title="{}">{}</span>', command(f"look {index}"), text(container.id), _words(container)
    )


def _words(container: Container) -> Markup:
    """Its kind, and which one: by its number, or by its own name in the survey of a site."""
    kind, own = readable_name(container.type), readable_name(container.id)
    if "|" in container.id:
        return place(container.id)
    return (
        name(kind)
        if own.lower() == kind.lower()
        else html("{} <small>{}</small>", name(kind), name(own, max_chars=MAX_ROOM_CHARS))
    )


def _left(scene: Scene, i: int) -> str:
    """What is left of the belief where a look may have missed the item."""
    left = float(scene.left[i])
    return f"{percent(left)} left" if left == left else ""


def _status(scene: Scene, timeline: Timeline, i: int) -> str:
    status = STATUSES[int(scene.status[i])]
    if scene.holds_focus[i]:
        return "✓ seen there"
    if timeline.passed[i] and status == "searched":
        return "× seen in passing"
    return {"searched": "× searched", "known": "known", "unreachable": "not reachable"}.get(status, "–")
