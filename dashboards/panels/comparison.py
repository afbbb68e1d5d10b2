"""Panel that compares overlaid runs: their costs, and the moment at which each diverges from the first."""

from __future__ import annotations

from markupsafe import Markup

from dashboards.model.clock import Clock
from dashboards.model.divergence import RunDivergence, divergence
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour
from dashboards.panels.markup import command, dot, html, name, number, percent, place, table, text
from workbench.worlds.names import readable_name

MAX_BELIEVED = 4
MAX_RUN_CHARS = 28
HEAD = ("run", "cost now", "walked m", "looks", "at the end")
HINTS = {
    "cost now": "Spent by the moment shown, in the paper's unit: one metre walked costs 1",
    "looks": "Containers searched by the moment shown",
    "at the end": "The charged cost and how the run ends; bounds and estimate where the log cannot settle a replay's",
}


def comparison(clock: Clock, scenes: list[Scene], names: list[str], *, not_shown: int = 0) -> Markup:
    """One row for each run, as it stands at a moment.

    Args:
        not_shown: how many more runs were opened than are on show.
    """
    rows = [
        [
            dot(run_colour(i)) + name(names[i], max_chars=MAX_RUN_CHARS),
            _live(number(scene.cost), "cost", i),
            _live(number(scene.travel_m), "metres", i),
            _live(str(scene.searches), "looks", i),
            html("{}<br><small>{}</small>", _final(timeline), name(timeline.status)),
        ]
        for i, (timeline, scene) in enumerate(zip(clock.timelines, scenes, strict=True))
    ]
    made = table(HEAD, rows, key="comparison", classes=("", "n", "n", "n", "n"), hints=HINTS)
    parts = [html('<div class="lp">{}', made)]
    if not_shown:
        parts.append(
            html('<p class="muted">{} more of the opened logs not on show; the tab Runs lists all.</p>', not_shown)
        )
    return Markup("").join(parts) + Markup("</div>")


def divergences(clock: Clock, names: list[str]) -> Markup:
    """Where each other run diverges from the first, with both beliefs; the same at every moment."""
    parts = [_parting(clock, i, names) for i in range(1, len(clock.timelines))]
    alone = Markup('<p class="muted">Overlay more runs in the Runs tab to compare them.</p>')
    return html('<div class="lp">{}</div>', Markup("").join(parts) if parts else alone)


def _live(value: str, what: str, run: int) -> Markup:
    """A value of a run at the moment shown, which the offline page replaces while it plays."""
    return html('<span data-live="{}" data-run="{}">{}</span>', what, run, value)


def mismatches(clock: Clock) -> Markup:
    """That runs are of different places or tasks, in words; empty where they can be compared."""
    first = clock.timelines[0]
    notes: list[str] = []
    if any(t.plan != first.plan for t in clock.timelines):
        notes.append("These runs are in different places; only those in the first one's place are drawn.")
    if any(t.run.task != first.run.task for t in clock.timelines):
        notes.append("These runs are of different tasks; their costs are not comparable.")
    warned = Markup("").join(html('<div class="warn">{}</div>', text(note)) for note in notes)
    return html('<div class="lp">{}</div>', warned) if notes else Markup("")


def _final(timeline: Timeline) -> Markup:
    """The charged cost; for a replay whose cost the log cannot settle, its bounds and estimate."""
    if timeline.undecided is not None:
        lower, upper = timeline.undecided
        middle = timeline.counterfactual.estimate if timeline.counterfactual is not None else None
        estimate = html("<br>about {}", number(middle)) if middle is not None else ""
        return html("{} to {}{}", number(lower), number(upper), estimate)
    outcome = timeline.run.outcome
    return text(number(outcome.cost if outcome is not None else None))


def _parting(clock: Clock, other: int, names: list[str]) -> Markup:
    first, second = clock.timelines[0], clock.timelines[other]
    found = divergence(first, second)
    mine, others = (dot(run_colour(i)) + name(names[i], max_chars=MAX_RUN_CHARS) for i in (0, other))
    title = html("<h3>{} and {}</h3>", mine, others)
    if found is None:
        return html("{}<p>They do the same to the end.</p>", title)
    at = clock.reading(found.stamps_ns[0])
    jump = html('<span class="seek" {}>after {} shared actions</span>', command(f"seek {at:.6f}"), found.index)
    sides = Markup("").join(
        html("<p>{}{}{}</p>", dot(run_colour(run)), name(did), _believed(timeline, found, side))
        for side, (run, timeline, did) in enumerate(((0, first, found.did[0]), (other, second, found.did[1])))
    )
    return html("{}<p>They diverge {}.</p>{}", title, jump, sides)


def _believed(timeline: Timeline, found: RunDivergence, side: int) -> Markup:
    """The most believed containers at the decision where the runs diverged."""
    frame = next((d for d in timeline.decisions if d.number == found.decisions[side]), None)
    belief = frame.belief if frame is not None else None
    if belief is None or not belief.item_types:
        return Markup("")
    plan = frame.plan if frame is not None else None
    wanted = next((s.item_types[0] for s in plan.steps if s.action == "find" and s.item_types), "") if plan else ""
    row = belief.item_types.index(wanted) if wanted in belief.item_types else 0
    ranked = sorted(
        zip(belief.probability[row], belief.containers, strict=True), key=lambda pair: (-pair[0], pair[1])
    )
    listed = Markup(", ").join(html("{} {}", place(c), percent(p)) for p, c in ranked[:MAX_BELIEVED])
    return html('<br><span class="muted">believed {}: {}</span>', text(readable_name(belief.item_types[row])), listed)
