"""Panel of the current moment: the task, the decision in force, and four figures."""

from __future__ import annotations

from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import FOUND, KNOWN, PHASES, RUNS, SEARCHED, css
from dashboards.panels.markup import chip, dot, name, number, percent, text
from replayers.runs.gaps import gaps_of
from workbench.belief_colours import belief_colours
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

MAX_TASK_CHARS = 300
"""Characters of a task that are shown."""


def title(timeline: Timeline) -> str:
    """Heading of a run: task, place, strategy."""
    info = timeline.run.info
    parts = [info.place, info.strategy, info.estimator, f"seed {info.seed}", info.source]
    notes = [] if timeline.run.complete else ["This log stops short of its end; it is shown as far as it goes."]
    lost = gaps_of(timeline.run).lost
    if lost:
        notes.append(f"This log is not whole: {'; '.join(lost)}; see lios doctor.")
    if not timeline.decisions:
        notes.append("This log holds no decisions.")
    if not timeline.item_types:
        notes.append("This log holds no beliefs; containers keep one colour.")
    warned = "".join(f'<div class="warn">{text(note)}</div>' for note in notes)
    facts = " · ".join(name(p) for p in parts if p)
    task = name(timeline.task_words, most=MAX_TASK_CHARS)
    return f'<div class="lp"><h2>{task}</h2><p class="muted">{facts}</p>{warned}</div>'


def now(scene: Scene) -> str:
    """The moment: what the robot does and why, and the cost so far."""
    remaining = number(scene.expected_cost)
    figures = (
        (number(scene.cost), "cost so far", ' data-live="cost"'),
        (remaining, "plan expected", ""),
        (number(scene.travel_m) + " m", "walked", ' data-live="walked"'),
        (str(scene.searches), "searched", ""),
    )
    cells = "".join(f"<div><b{live}>{value}</b><span>{label}</span></div>" for value, label, live in figures)
    holding = f" · holding {text(readable_name(scene.robot.holding))}" if scene.robot.holding else ""
    phase = chip(scene.phase, PHASES.get(scene.phase, "#ddd"))
    if scene.outcome:
        phase = chip(scene.outcome, css(FOUND if scene.outcome == "done" else RUNS[1]), dark=True)
    why = f'<p class="muted">Decided because: {name(scene.reason)}</p>' if scene.reason else ""
    return (
        f'<div class="lp"><p>{phase} {name(scene.doing)}{holding}</p>'
        f'<div class="facts">{cells}</div>'
        f"<p>Decision <b>{scene.decision}</b> of {scene.decisions}</p>{why}{_failure_note(scene)}</div>"
    )


def _failure_note(scene: Scene) -> str:
    """Why a failed run ended, and the charged cost if it differs from the spent cost."""
    if scene.outcome in ("", "done"):
        return ""
    charged = (
        scene.charged if scene.charged is not None and abs(scene.charged - scene.cost) > NEAR_SHOWN_COST else None
    )
    cost = f" Charged: {number(charged)}." if charged is not None else ""
    return f'<p class="warn">Ended because: {name(scene.why_ended, most=MAX_TASK_CHARS)}.{cost}</p>'


def legend(scene: Scene, *, unopened: bool = False, ended: bool = False) -> str:
    """What the colours and marks of runs mean, with the scale's ends. The same at every moment, so that the layout is
    stable.

    Args:
        unopened: containers that no run opened are marked. ended: one is marked where a replay had to end.
    """
    stops = ", ".join(css(belief_colours(i / 8)) for i in range(9))
    of = f"belief in {text(readable_name(scene.focus))}" if scene.focus else "no beliefs"
    scale = (
        f'0 <span class="ramp" style="background:linear-gradient(90deg,{stops})"></span> {percent(scene.top_belief)}'
    )
    marks = (
        f"<span>{dot(SEARCHED)}searched (×: not there)</span>"
        f"<span>{dot(FOUND)}✓ seen there</span>"
        f"<span>{dot(KNOWN)}known at the start</span>"
    )
    marks += "<span>? nobody opened it</span>" if unopened else ""
    marks += "<span>◆ here a replay had to end</span>" if ended else ""
    marks += "<span>1, 2, 3 order of search</span>" if scene.decisions else ""
    colours = f"{of}: {scale}" if scene.focus else of
    return f'<div class="lp legend"><span>{colours}</span>{marks}</div>'
