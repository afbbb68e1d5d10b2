"""Panel of the cost of each find from where the robot stood, and why it was or was not chosen."""

from __future__ import annotations

from collections.abc import Mapping

from dashboards.model.first_stop_costs import FirstLook
from dashboards.model.scene import Scene
from dashboards.panels.markup import name, number, percent, place, table, text
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

MAX_ROWS = 200


def find_costs(scene: Scene, robot_at: str, looks: tuple[FirstLook, ...] = ()) -> str:
    """One row for each item type and target, from where the robot stood at the decision, cheapest first; then first
    looks.

    Args:
        looks: expected costs of looking elsewhere first, from first_looks.
    """
    costs = scene.find_costs
    if costs is None:
        words = "No find was priced at this decision."
        return f'<div class="lp"><p class="muted">{words}</p>{_first_looks(looks, scene.focus)}</div>'
    origin = costs.origins.index(robot_at) if robot_at in costs.origins else 0
    found = [
        (costs.metres[i][origin][k], item, target)
        for i, item in enumerate(costs.item_types)
        for k, target in enumerate(costs.targets)
    ]
    found.sort(key=lambda row: (row[0], row[1], row[2]))
    planned = {
        s.step.item_types[0]: s.step.target for s in scene.steps if s.step.action == "find" and s.step.item_types
    }
    rows = [
        [name(readable_name(item)), place(target), number(cost), _reason(item, target, cost, found, planned)]
        for cost, item, target in found[:MAX_ROWS]
    ]
    kind = costs.kind if costs.kind != "model" else f"model ({costs.belief_model})"
    left = f'<p class="muted">and {len(found) - MAX_ROWS} more</p>' if len(found) > MAX_ROWS else ""
    made = table(("find", "bring to", "cost", "in the plan?"), rows, key="costs", classes=("", "", "n", ""))
    return (
        f'<div class="lp"><p class="muted">{text(kind)} costs from {place(costs.origins[origin])}</p>'
        f"{made}{left}{_first_looks(looks, scene.focus)}</div>"
    )


def _reason(
    item: str, target: str, cost: float, found: list[tuple[float, str, str]], planned: Mapping[str, str]
) -> str:
    """In words: chosen, or what the plan does instead."""
    wanted = planned.get(item)
    if wanted == target:
        return "<b>yes</b>"
    if wanted is None:
        return '<span class="muted">no: the plan does without it</span>'
    there = next((c for c, i, t in found if i == item and t == wanted), None)
    more = f" ({_difference_words(cost - there)})" if there is not None else ""
    return f'<span class="muted">no, to {place(wanted)} instead{more}</span>'


def _difference_words(more: float) -> str:
    """By how much an alternative differs from what is done, in words; its cost is shown beside."""
    if abs(more) < NEAR_SHOWN_COST:
        return "costs the same"
    return f"{abs(more):.1f} {'cheaper' if more > 0 else 'more expensive'}"


def _first_looks(looks: tuple[FirstLook, ...], focus: str) -> str:
    """Where the search could begin, the expected cost of the whole search then, and why the others were not
    chosen."""
    if not looks:
        return ""
    chosen = next((look.cost for look in looks if look.chosen), looks[0].cost)
    rows = [
        [place(look.container), percent(look.probability), number(look.cost), _verdict(look, chosen)]
        for look in looks
    ]
    head = ("look first into", "there", "search costs", "why not")
    return (
        f"<h3>Where to look first for {name(readable_name(focus))}</h3>"
        + table(head, rows, key="looks", classes=("", "n", "n", ""))
        + '<p class="muted">Expected cost of the search with that container first, the others in the order meant.</p>'
    )


def _verdict(look: FirstLook, chosen: float) -> str:
    more = look.cost - chosen
    if look.chosen:
        return "<b>taken</b>"
    if abs(more) < NEAR_SHOWN_COST:
        return '<span class="muted">no better</span>'
    if more > 0:
        return f'<span class="muted">{more:.1f} more expensive</span>'
    return f"{-more:.1f} cheaper, but not this policy's order"
