"""Panel of the plan in force, the order of search, and the alternatives."""

from __future__ import annotations

from dashboards.model.scene import Scene
from dashboards.panels.markup import name, number, percent, place, table, text
from workbench.log_schema.events import WayNotTaken
from workbench.tolerances import NEAR_COST

MARKS = {"done": "✓", "current": "▶", "next": "○"}
MAX_STEPS = 60


def plan(scene: Scene) -> str:
    """Steps with costs: done, current, next."""
    if not scene.steps:
        words = f"No plan in force ({scene.plan_status})." if scene.plan_status else "No plan in force."
        return f'<div class="lp"><p class="muted">{text(words)}</p></div>'
    items = "".join(
        f'<li class="{s.progress}"><span class="m">{MARKS[s.progress]}</span><span class="w">{name(s.words)}</span>'
        f'<span class="c">{number(s.step.cost)}</span></li>'
        for s in scene.steps[:MAX_STEPS]
    )
    total = f"{text(scene.plan_status)} by {text(scene.solver)}, expected cost {number(scene.expected_cost)}"
    return (
        f'<div class="lp"><p class="muted">{total}</p><ol class="plan">{items}</ol>'
        f"{_order(scene)}{_alternatives(scene)}</div>"
    )


def _order(scene: Scene) -> str:
    if not scene.search_order:
        return ""
    rows = [
        [str(i + 1), place(s.container), percent(s.probability), percent(s.reached), number(s.leg_m)]
        for i, s in enumerate(scene.search_order)
    ]
    head = ("#", "container", "P(there)", "P(reached)", "leg m")
    return "<h3>Intended order of search</h3>" + table(head, rows, key="order", classes=("n", "", "n", "n", "n"))


def _alternatives(scene: Scene) -> str:
    """Other ways to the goal, with the planner's reason against them or how much more they cost."""
    if not scene.alternatives:
        return ""
    taken = scene.expected_cost if scene.expected_cost is not None else min(a.cost for a in scene.alternatives)
    rows = [[name(a.title), number(a.cost), _against(a, taken)] for a in scene.alternatives]
    return "<h3>Ways to begin</h3>" + table(("way", "cost", "why not"), rows, key="ways", classes=("", "n", ""))


def _against(way: WayNotTaken, taken: float) -> str:
    if way.why_not:
        return name(way.why_not)
    more = way.cost - taken
    if abs(more) < NEAR_COST:
        return "<b>taken</b>"
    return (
        f'<span class="muted">{abs(more):.1f} {"more expensive" if more > 0 else "cheaper, by a lower bound"}</span>'
    )
