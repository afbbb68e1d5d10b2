"""Panel of the cost of each find from where the robot stood, and why it was or was not chosen."""

from __future__ import annotations

from collections.abc import Mapping

from markupsafe import Markup

from dashboards.model.first_stop_costs import FirstLook
from dashboards.model.scene import Scene
from dashboards.panels.markup import html, name, number, percent, place, table, text
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

MAX_ROWS = 200


def find_costs(scene: Scene, robot_at: str, looks: tuple[FirstLook, ...] = ()) -> Markup:
    """One row for each item type and target, from where the robot stood at the decision, cheapest first; then first
    looks.

    Args:
        looks: expected costs of looking elsewhere first, from first_looks.
    """
    costs = scene.find_costs
    if costs is None:
        words = "No find was priced at this decision."
        return html('<div class="lp"><p class="muted">{}</p>{}</div>', words, _first_looks(looks, scene.focus))
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
    left = html('<p class="muted">and {} more</p>', len(found) - MAX_ROWS) if len(found) > MAX_ROWS else ""
    made = table(("find", "bring to", "cost", "in the plan?"), rows, key="costs", classes=("", "", "n", ""))
    return html(
        '<div class="lp"><p class="muted">{} costs from {}</p>{}{}{}</div>',
        text(kind),
        place(costs.origins[origin]),
        made,
        left,
        _first_looks(looks, scene.focus),
    )


def _reason(
    item: str, target: str, cost: float, found: list[tuple[float, str, str]], planned: Mapping[str, str]
) -> Markup:
    """In words: chosen, or what the plan does instead."""
    wanted = planned.get(item)
    if wanted == target:
        return Markup("<b>yes</b>")
    if wanted is None:
        return Markup('<span class="muted">no: the plan does without it</span>')
    there = next((c for c, i, t in found if i == item and t == wanted), None)
    more = f" ({_difference_words(cost - there)})" if there is not None else ""
    return html('<span class="muted">no, to {} instead{}</span>', place(wanted), more)


def _difference_words(more: float) -> str:
    """By how much an alternative differs from what is done, in words; its cost is shown beside."""
    if abs(more) < NEAR_SHOWN_COST:
        return "costs the same"
    return f"{abs(more):.1f} {'cheaper' if more > 0 else 'more expensive'}"


def _first_looks(looks: tuple[FirstLook, ...], focus: str) -> Markup:
    """Where the search could begin, the expected cost of the whole search then, and why the others were not
    chosen."""
    if not looks:
        return Markup("")
    chosen = next((look.cost for look in looks if look.chosen), looks[0].cost)
    rows = [
        [place(look.container), percent(look.probability), number(look.cost), _verdict(look, chosen)]
        for look in looks
    ]
    head = ("look first into", "there", "search costs", "why not")
    return (
        html("<h3>Where to look first for {}</h3>", name(readable_name(focus)))
        + table(head, rows, key="looks", classes=("", "n", "n", ""))
        + Markup(
            '<p class="muted">Expected cost of the search with that container first, the others in '
            "the order meant.</p>"
        )
    )


def _verdict(look: FirstLook, chosen: float) -> Markup:
    more = look.cost - chosen
    if look.chosen:
        return Markup("<b>taken</b>")
    if abs(more) < NEAR_SHOWN_COST:
        return Markup('<span class="muted">no better</span>')
    if more > 0:
        return html('<span class="muted">{:.1f} more expensive</span>', more)
    return html("{:.1f} cheaper, but not this policy's order", -more)
