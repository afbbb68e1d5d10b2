"""A worked example of an expected cost: a world of three containers step by step, as in the paper's Fig. 4."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from workbench.beliefs.belief import Belief
from workbench.evaluation.figures.style import BLUE, GREEN, GREY
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.engine import expected_search
from workbench.search.find_costs import BeliefModel
from workbench.search.orders import ExpectedSearch
from workbench.search.policy import SearchQuery
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG = ItemType("Mug")
PLACES: tuple[tuple[str, float, float, float], ...] = (
    ("table", 1.5, 1.0, 0.15),
    ("shelf", -1.0, 2.5, 0.25),
    ("fridge", 4.0, 2.0, 0.60),
)
"""Name, x and y in metres from the start, and the probability of a mug."""


def worked_query() -> SearchQuery:
    """The query of the example: find a mug and bring it to the start; distances are straight lines."""
    points = np.array([(0.0, 0.0), *((x, y) for _, x, y, _ in PLACES)])
    metres = np.round(np.linalg.norm(points[:, None] - points[None], axis=2), 1)
    names = tuple(ContainerId(name) for name, *_ in PLACES)
    return SearchQuery(
        item_type=MUG,
        origin=START,
        target=START,
        belief=Belief(
            item_types=(MUG,), containers=names, probability=np.array([[p for *_, p in PLACES]]), estimator="example"
        ),
        travel=TravelCosts(locations=(START, *(LocationId(n) for n in names)), metres=metres),
        costs=SIMULATION_COSTS,
    )


def draw_worked_example(ax: Axes, *, model: BeliefModel) -> None:
    """Draw the world, the order of least expected cost, and the contribution of each step."""
    query = worked_query()
    search = expected_search(query, belief_model=model)
    places = {"start": (0.0, 0.0), **{name: (x, y) for name, x, y, _ in PLACES}}
    _draw_world(ax, places)
    at = "start"
    for stop in search.stops:
        (x0, y0), (x1, y1) = places[at], places[stop.container]
        ax.annotate(
            "",
            (x1, y1),
            (x0, y0),
            arrowprops={"arrowstyle": "->", "color": BLUE, "lw": 1.5, "shrinkA": 9, "shrinkB": 9},
        )
        ax.text((x0 + x1) / 2, (y0 + y1) / 2 - 0.22, f"{stop.leg_m:.1f} m", fontsize=7, color=BLUE, ha="center")
        at = stop.container
    ax.text(-1.6, -0.75, "\n".join(steps_in_words(query, search)), fontsize=6.8, va="top", family="monospace")
    ax.set(xlim=(-1.9, 5.2), ylim=(-2.7, 3.3), aspect="equal")
    ax.set_axis_off()
    ax.set_title(f"{model}: expected cost {search.cost:.2f}", fontsize=9)


def steps_in_words(query: SearchQuery, search: ExpectedSearch) -> list[str]:
    """One line per step: probability of reaching it, distance, probability of success with the cost that follows,
    and the sum."""
    lines: list[str] = []
    for stop, cost in zip(search.stops, search.partial_costs, strict=True):
        back = query.travel.between(LocationId(stop.container), query.target) or 0.0
        lines.append(
            f"{stop.container:>7}: {stop.reached:.2f} x [{stop.leg_m:.1f} + {stop.probability:.2f} x "
            f"({query.costs.manipulation:.0f} + {back:.1f})] = {cost:5.2f}"
        )
    lines.append(f"{'sum':>7}: {search.cost:.2f}; not found with chance {search.missing:.2f}")
    return lines


def _draw_world(ax: Axes, places: dict[str, tuple[float, float]]) -> None:
    chance = {name: p for name, _, _, p in PLACES}
    for name, (x, y) in places.items():
        colour = GREY if name == "start" else GREEN
        ax.plot(x, y, "s" if name == "start" else "o", markersize=13, color=colour, alpha=0.85)
        label = name if name == "start" else f"{name}, p = {chance[name]:.2f}"
        ax.text(x, y + 0.33, label, fontsize=7.5, ha="center")
