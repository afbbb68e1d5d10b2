"""What would each find cost from where the robot stood, by where the item is brought?"""

from __future__ import annotations

from dashboards.panels.markup import name, number, table, text
from dashboards.scene import Scene
from workbench.worlds.names import readable_name

MOST_ROWS = 200


def find_costs(scene: Scene, robot_at: str) -> str:
    """A row per item type and target, from where the robot stood at the decision; cheapest first."""
    costs = scene.find_costs
    if costs is None:
        return '<div class="lp"><p class="muted">No find was priced at this decision.</p></div>'
    origin = costs.origins.index(robot_at) if robot_at in costs.origins else 0
    found = [
        (costs.metres[i][origin][k], item, target)
        for i, item in enumerate(costs.item_types)
        for k, target in enumerate(costs.targets)
    ]
    found.sort(key=lambda row: (row[0], row[1], row[2]))
    planned = {
        (s.step.item_types[0], s.step.target) for s in scene.steps if s.step.action == "find" and s.step.item_types
    }
    rows = [
        [name(readable_name(item)), name(target), number(cost), "in the plan" if (item, target) in planned else ""]
        for cost, item, target in found[:MOST_ROWS]
    ]
    kind = costs.kind if costs.kind != "model" else f"model ({costs.belief_model})"
    left = f'<p class="muted">and {len(found) - MOST_ROWS} more</p>' if len(found) > MOST_ROWS else ""
    return (
        f'<div class="lp"><p class="muted">{text(kind)} costs from {name(costs.origins[origin])}</p>'
        f"{table(('find', 'bring to', 'cost', ''), rows, key='costs', classes=('', '', 'n', ''))}{left}</div>"
    )
