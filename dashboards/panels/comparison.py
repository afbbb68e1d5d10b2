"""Panel that compares overlaid runs: their costs, and the moment at which each diverges from the first."""

from __future__ import annotations

from dashboards.model.clock import Clock
from dashboards.model.divergence import Divergence, divergence
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour
from dashboards.panels.markup import command, dot, name, number, percent, place, table, text
from workbench.worlds.names import readable_name

MAX_BELIEVED = 4
MAX_RUN_CHARS = 28


def comparison(clock: Clock, scenes: list[Scene], names: list[str], *, not_shown: int = 0) -> str:
    """One row for each run; below, where each other run diverges from the first, with both beliefs.

    Args:
        not_shown: how many more runs were opened than are on show.
    """
    rows = [
        [
            f"{dot(run_colour(i))}{name(names[i], most=MAX_RUN_CHARS)}<br><small>{name(timeline.status)}</small>",
            number(scene.cost),
            _final(timeline),
            number(scene.travel_m),
            str(scene.searches),
        ]
        for i, (timeline, scene) in enumerate(zip(clock.timelines, scenes, strict=True))
    ]
    head = ("run", "cost now", "in all", "walked m", "looks")
    kinds = ("w", "n", "n", "n", "n")
    made = table(head, rows, key="comparison", classes=kinds)
    parts = [f'<div class="lp">{_warning(clock)}{made}']
    if not_shown:
        parts.append(f'<p class="muted">{not_shown} more of the opened logs not on show; the tab Runs lists all.</p>')
    for i in range(1, len(clock.timelines)):
        parts.append(_parting(clock, i, names))
    if len(clock.timelines) == 1:
        parts.append('<p class="muted">Overlay more runs in the Runs tab to compare them.</p>')
    return "".join(parts) + "</div>"


def _warning(clock: Clock) -> str:
    first = clock.timelines[0]
    notes: list[str] = []
    if any(t.plan != first.plan for t in clock.timelines):
        notes.append("These runs are of different places; only those of the first one's place fit the picture.")
    if any(t.run.task != first.run.task for t in clock.timelines):
        notes.append("These runs are of different tasks; their costs do not compare.")
    return "".join(f'<div class="warn">{text(note)}</div>' for note in notes)


def _final(timeline: Timeline) -> str:
    """The charged cost; for a replay whose cost the log cannot settle, its bounds and estimate."""
    if timeline.undecided is not None:
        lower, upper = timeline.undecided
        middle = timeline.counterfactual.estimate if timeline.counterfactual is not None else None
        estimate = f"<br>about {number(middle)}" if middle is not None else ""
        return f"{number(lower)} to {number(upper)}{estimate}"
    outcome = timeline.run.outcome
    return number(outcome.cost if outcome is not None else None)


def _parting(clock: Clock, other: int, names: list[str]) -> str:
    first, second = clock.timelines[0], clock.timelines[other]
    found = divergence(first, second)
    mine, others = (f"{dot(run_colour(i))}{name(names[i], most=MAX_RUN_CHARS)}" for i in (0, other))
    title = f"<h3>{mine} and {others}</h3>"
    if found is None:
        return f"{title}<p>They do the same to the end.</p>"
    at = clock.reading(found.stamps_ns[0])
    jump = f'<span class="seek" {command(f"seek {at:.6f}")}>after {found.index} shared actions</span>'
    sides = "".join(
        f"<p>{dot(run_colour(run))}{name(did)}{_believed(timeline, found, side)}</p>"
        for side, (run, timeline, did) in enumerate(((0, first, found.did[0]), (other, second, found.did[1])))
    )
    return f"{title}<p>They diverge {jump}.</p>{sides}"


def _believed(timeline: Timeline, found: Divergence, side: int) -> str:
    """The most believed containers at the decision where the runs diverged."""
    frame = next((d for d in timeline.decisions if d.number == found.decisions[side]), None)
    belief = frame.belief if frame is not None else None
    if belief is None or not belief.item_types:
        return ""
    plan = frame.plan if frame is not None else None
    wanted = next((s.item_types[0] for s in plan.steps if s.action == "find" and s.item_types), "") if plan else ""
    row = belief.item_types.index(wanted) if wanted in belief.item_types else 0
    ranked = sorted(
        zip(belief.probability[row], belief.containers, strict=True), key=lambda pair: (-pair[0], pair[1])
    )
    listed = ", ".join(f"{place(c)} {percent(p)}" for p, c in ranked[:MAX_BELIEVED])
    return f'<br><span class="muted">believed {text(readable_name(belief.item_types[row]))}: {listed}</span>'
