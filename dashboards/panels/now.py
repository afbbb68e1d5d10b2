"""Panel of the current moment: the task, the decision in force, and four figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from dashboards.model.containers.unopened import unopened as never_opened
from dashboards.model.perception.belief_after_misses import can_miss
from dashboards.model.perception.sight import field_of, seen_in_passing
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import FAILED, FOUND, GOAL, IN_SIGHT, ITEM, KNOWN, PHASES, SEARCHED, SIGHT, css
from dashboards.panels.markup import chip, dot, html, name, number, percent, text
from replayers.runs.gaps import gaps_of
from workbench.belief_colours import belief_colours
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

DARK_PHASES = ("searching", "manipulating")
"""Phases whose colour has white words on it."""
COST_HINT = "Spent so far: 1 for each metre walked, and what searches, picks and other actions cost"
MAX_TASK_CHARS = 300
"""Characters of a task that are shown."""


def title(timeline: Timeline, *, followed: bool = False) -> Markup:
    """Heading of a run: task, place, strategy.

    Args:
        followed: a run that has not ended is still being recorded.
    """
    info = timeline.run.info
    parts = [info.place, info.strategy, info.estimator, f"seed {info.seed}", timeline.run.source_words]
    cut_off = "This run is being recorded." if followed else "This log was cut off; it is shown as far as it goes."
    notes = [] if timeline.run.complete else [cut_off]
    lost = gaps_of(timeline.run).dropped
    if lost:
        notes.append(f"This log is not whole: {'; '.join(lost)}; see lios doctor.")
    if followed and not timeline.decisions:
        notes.append("No decision has been made yet.")
    elif not timeline.decisions:
        notes.append("This log holds no decisions.")
    if not (timeline.item_types or (followed and not timeline.decisions)):
        notes.append("This log holds no beliefs; containers keep one colour.")
    warned = Markup("").join(html('<div class="warn">{}</div>', text(note)) for note in notes)
    facts = Markup(" · ").join(name(p) for p in parts if p)
    task = name(timeline.task_words, max_chars=MAX_TASK_CHARS)
    return html('<div class="lp"><h2>{}</h2><p class="muted">{}</p>{}</div>', task, facts, warned)


def now(scene: Scene) -> Markup:
    """The moment: what the robot does and why, and the cost so far."""
    remaining = number(scene.expected_cost)
    figures = (
        (number(scene.cost), "cost so far", Markup(' data-live="cost"'), COST_HINT),
        (remaining, "plan expected", "", "Expected cost of the plan in force, from its decision to the goal"),
        (number(scene.travel_m) + " m", "walked", Markup(' data-live="walked"'), "Metres along the path"),
        (str(scene.searches), "searched", "", "Containers that the run has looked into"),
    )
    cells = Markup("").join(
        html('<div title="{}"><b{}>{}</b><span>{}</span></div>', hint, live, value, label)
        for value, label, live, hint in figures
    )
    holding = html(" · holding {}", readable_name(scene.robot.holding)) if scene.robot.holding else ""
    phase = chip(scene.phase, PHASES.get(scene.phase, "#ddd"), dark=scene.phase in DARK_PHASES)
    if scene.outcome:
        phase = chip(scene.outcome, css(FOUND if scene.outcome == "done" else FAILED), dark=True)
    why = html('<p class="muted">Decided because: {}</p>', name(scene.reason)) if scene.reason else ""
    return html(
        '<div class="lp"><p>{} {}{}</p><div class="facts">{}</div><p>Decision <b>{}</b> of {}</p>{}{}</div>',
        phase,
        name(scene.doing),
        holding,
        cells,
        scene.decision,
        scene.decisions,
        why,
        _failure_note(scene),
    )


def _failure_note(scene: Scene) -> Markup:
    """Why a failed run ended, and the charged cost if it differs from the spent cost."""
    if scene.outcome in ("", "done"):
        return Markup("")
    charged = (
        scene.charged if scene.charged is not None and abs(scene.charged - scene.cost) > NEAR_SHOWN_COST else None
    )
    cost = f" Charged: {number(charged)}." if charged is not None else ""
    return html('<p class="warn">Ended because: {}.{}</p>', name(scene.why_ended, max_chars=MAX_TASK_CHARS), cost)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunLegend:
    """Which signs of the legend runs shown together need at some moment.

    Attributes:
        unopened: containers that no run opened are marked. ended: one is marked where a replay had to end.
        assumed: parts of a path were assumed by a replay. ghosts: other runs are drawn, paler.
        sight: how far the robot sees in passing is drawn. passed: something was seen so. missed: looks can miss.
    """

    unopened: bool = False
    ended: bool = False
    assumed: bool = False
    ghosts: bool = False
    sight: bool = False
    passed: bool = False
    missed: bool = False


NO_SIGNS = RunLegend()


def run_signs(timelines: Sequence[Timeline]) -> RunLegend:
    return RunLegend(
        unopened=bool(never_opened(timelines).any()),
        ended=any(t.ends_unseen for t in timelines),
        assumed=any(bool(t.imputed.any()) for t in timelines),
        ghosts=len(timelines) > 1,
        sight=any(field_of(t) is not None for t in timelines[:1]),
        passed=any(bool(seen_in_passing(t, t.end_ns)) for t in timelines[:1]),
        missed=any(can_miss(t) for t in timelines[:1]),
    )


def legend(scene: Scene, signs: RunLegend = NO_SIGNS, *, items: bool = False) -> Markup:
    """What the colours and marks of runs mean, with the scale's ends. The same at every moment, so that the layout is
    stable.

    Args:
        signs: of the runs shown together.
        items: the items that were seen are marked, and the places of the goal framed.
    """
    stops = Markup(", ").join(css(belief_colours(i / 8)) for i in range(9))
    of = html("belief in {}", readable_name(scene.focus)) if scene.focus else "no beliefs"
    scale = html(
        '0 <span class="ramp" style="background:linear-gradient(90deg,{})"></span> {}',
        stops,
        percent(scene.top_belief),
    )
    marks = html(
        "<span>{}searched (×: not there)</span><span>{}✓ seen there</span><span>{}known at the start</span>",
        dot(SEARCHED),
        dot(FOUND),
        dot(KNOWN),
    )
    marks += Markup("<span>× under a bar: perhaps missed, what is left</span>") if signs.missed else ""
    marks += _line("whole", "walked") + _line("dashed", "planned")
    marks += _line("short", "assumed by a replay") if signs.assumed else ""
    marks += _sight() if signs.sight else ""
    marks += _seen_in_passing() if signs.passed else ""
    marks += Markup("<span>paler robot: another run</span>") if signs.ghosts else ""
    marks += Markup("<span>? nobody opened it</span>") if signs.unopened else ""
    marks += Markup("<span>◆ here a replay had to end</span>") if signs.ended else ""
    marks += Markup("<span>1, 2, 3 order of search</span>") if scene.decisions else ""
    marks += html("<span>{}item seen</span><span>{}the goal's</span>", dot(ITEM), dot(GOAL)) if items else ""
    frame = html('<span><span class="frame" style="border-color:{}"></span>place of the goal</span>', css(GOAL))
    marks += frame if items else ""
    colours = html("{}: {}", of, scale) if scene.focus else of
    return html('<div class="lp legend"><span>{}</span>{}</div>', colours, marks)


def _sight() -> Markup:
    return html(
        '<span><span class="sight" style="border-color:{};background:{}"></span>sees so far</span>',
        css(SIGHT),
        css(IN_SIGHT),
    )


def _seen_in_passing() -> Markup:
    """An eye and a dotted line, as from a viewpoint to what was seen from there."""
    return html(
        '<span><svg class="key" width="40" height="10"><path class="eye" d="M1 5 Q7 -2 13 5 Q7 12 1 5Z"/>'
        '<circle class="pupil" cx="7" cy="5" r="2"/><line class="eye" x1="16" x2="40" y1="5" y2="5" '
        'stroke-dasharray="2.5 3"/></svg>seen in passing</span>'
    )


def _line(kind: str, words: str) -> Markup:
    """A line as paths are drawn: whole, dashed, or in short dashes."""
    dashes = {"whole": "", "dashed": "6 4", "short": "3 3"}[kind]
    return html(
        '<span><svg class="key" width="24" height="8"><line x1="1" x2="23" y1="4" y2="4" class="mark" '
        'stroke-width="2" stroke-dasharray="{}"/></svg>{}</span>',
        dashes,
        words,
    )
