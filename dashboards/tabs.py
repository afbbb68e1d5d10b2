"""The tabs that the Viser app and the offline page have in common, in their order, and what fills them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from markupsafe import Markup

from dashboards.model.first_stop_costs import first_looks
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.panels.find_costs import find_costs
from dashboards.panels.plan import plan

TABS = (
    ("beliefs", "Belief"),
    ("plan", "Plan"),
    ("costs", "Find costs"),
    ("plots", "Plots"),
    ("comparison", "Compare"),
)
"""Key and label of each tab; the last is for several runs."""


def _costs(scene: Scene, timeline: Timeline) -> Markup:
    at = timeline.decision_at(scene.stamp_ns)
    frame = timeline.decisions[at] if at >= 0 else None
    robot_at = frame.plan.robot_at if frame is not None and frame.plan is not None else ""
    return find_costs(scene, robot_at, first_looks(timeline, frame) if frame is not None else ())


SCENE_PANELS: Mapping[str, Callable[[Scene, Timeline], Markup]] = MappingProxyType(
    {
        "plan": lambda scene, _: plan(scene),
        "costs": _costs,
    }
)
"""The tabs whose content depends on the moment alone, and not on the item or the clock that was chosen."""
