"""Panel of the plan in force, the order of search, and the alternatives."""

from __future__ import annotations

from markupsafe import Markup

from dashboards.model.scene import Scene
from dashboards.panels.markup import html, name, number, percent, place, table, text
from workbench.log_schema.events import WayNotTaken
from workbench.tolerances import NEAR_COST

MARKS = {"done": "✓", "current": "▶", "next": "○"}
MAX_STEPS = 60
HINTS = {
    "P(there)": "Probability that the item is in this container",
    "P(reached)": "Probability that the search gets this far without finding the item first",
    "leg m": "Metres from the stop before it",
}


def plan(scene: Scene) -> Markup:
    """Steps with costs: done, current, next."""
    if not scene.steps:
        words = f"No plan in force ({scene.plan_status})." if scene.plan_status else "No plan in force."
        return html('<div class="lp"><p class="muted">{}</p></div>', text(words))
    items = Markup("").join(
        html(
            '<li class="{}"><span class="m">{}</span><span class="w">{}</span><span class="c">{}</span></li>',
            s.progress,
            MARKS[s.progress],
            name(s.words),
            number(s.step.cost),
        )
        for s in scene.steps[:MAX_STEPS]
    )
    total = html("{} by {}, expected cost {}", scene.plan_status, scene.solver, number(scene.expected_cost))
    return html(
        '<div class="lp"><p class="muted">{}</p><ol class="plan">{}</ol>{}{}</div>',
        total,
        items,
        _order(scene),
        _alternatives(scene),
    )


def _order(scene: Scene) -> Markup:
    if not scene.search_order:
        return Markup("")
    rows = [
        [str(i + 1), place(s.container), percent(s.probability), percent(s.reached), number(s.leg_m)]
        for i, s in enumerate(scene.search_order)
    ]
    head = ("#", "container", "P(there)", "P(reached)", "leg m")
    return Markup("<h3>Intended order of search</h3>") + table(
        head, rows, key="order", classes=("n", "", "n", "n", "n"), hints=HINTS
    )


def _alternatives(scene: Scene) -> Markup:
    """Other ways to the goal, with the planner's reason against them or how much more they cost."""
    if not scene.alternatives:
        return Markup("")
    taken = scene.expected_cost if scene.expected_cost is not None else min(a.cost for a in scene.alternatives)
    rows = [[name(a.title), number(a.cost), _against(a, taken)] for a in scene.alternatives]
    return Markup("<h3>Ways to begin</h3>") + table(
        ("way", "cost", "why not"), rows, key="ways", classes=("", "n", "")
    )


def _against(alternative: WayNotTaken, taken: float) -> Markup:
    if alternative.why_not:
        return name(alternative.why_not)
    more = alternative.cost - taken
    if abs(more) < NEAR_COST:
        return Markup("<b>taken</b>")
    return html(
        '<span class="muted">{:.1f} {}</span>',
        abs(more),
        "more expensive" if more > 0 else "cheaper, by a lower bound",
    )
