"""Draws the figures of the concept pages from the sample logs: `python docs/figures/make.py [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dashboards.figures.style import figure_style
from dashboards.palette import run_colour, unit_rgb
from replayers.batch.replay_all import LogFailed, ReplayRequest, replay_log, strategies_named
from replayers.batch.store import StoredReplay
from replayers.counterfactual.replay import ReplaySettings
from replayers.runs.run import read
from workbench.beliefs.belief import Belief
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.engine import expected_search
from workbench.search.find_costs import BeliefModel
from workbench.search.orders import order_cost
from workbench.search.places import SearchSpace, search_space
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchQuery
from workbench.search.remaining import still_missing_along
from workbench.worlds.house import START, ContainerId, ItemType

ROOT = Path(__file__).resolve().parents[2]
LOG = ROOT / "logs" / "find-conditioned-lios.mcap"
MODEL: BeliefModel = "exists"
MODELS: tuple[BeliefModel, ...] = ("independent", "exists", "exclusive")


def first_query(log: Path, item: str) -> SearchQuery:
    """What a sample log's robot could ask before its first step: where is the item?"""
    run = read(log)
    first = run.beliefs[0]
    row = first.item_types.index(item)
    belief = Belief(
        item_types=(ItemType(item),),
        containers=tuple(ContainerId(name) for name in first.containers),
        probability=np.array(first.probability)[row : row + 1],
        estimator=first.estimator,
    )
    return SearchQuery(
        item_type=belief.item_types[0],
        origin=START,
        target=START,
        belief=belief,
        travel=run.place.travel,
        costs=SIMULATION_COSTS,
    )


def _orders(query: SearchQuery, here: SearchSpace) -> dict[str, list[int]]:
    """Whole orders of three policies, as indices of containers."""
    chosen = {
        "nearest first": [stop.container for stop in policy("greedy").order(query)],
        "most probable first": [stop.container for stop in policy("most-probable").order(query)],
        "least expected cost (Eq. 1)": [s.container for s in expected_search(query, belief_model=MODEL).stops],
    }
    # A policy's order may stop at its candidates; what is left is looked into nearest first.
    rest = chosen["nearest first"]
    whole = {name: [*stops, *(c for c in rest if c not in stops)] for name, stops in chosen.items()}
    return {name: [here.containers.index(c) for c in stops] for name, stops in whole.items()}


def draw_found_by(ax: Axes) -> None:
    """The chance to have found the item by so many metres, for three orders; the dots are looks."""
    query = first_query(ROOT / "logs" / "deliver-3.mcap", "Pencil")
    here = search_space(query.belief, query.travel, origins=(START,), targets=(START,))
    for i, (name, order) in enumerate(_orders(query, here).items()):
        search = order_cost(order, here, model=MODEL, costs=query.costs)
        walked = np.cumsum([stop.leg_m for stop in search.stops])
        found = 1 - still_missing_along(here.probability[:1], np.array([order]), MODEL)[0]
        colour = unit_rgb(run_colour(i))
        label = f"{name}: {search.cost:.1f} on average"
        ax.step([0, *walked], found, where="post", color=colour, label=label)
        ax.plot(walked, found[1:], ".", color=colour, markersize=3)
    ax.set_xlabel("metres walked")
    ax.set_ylabel("chance that it is found by then")
    ax.set_ylim(0, 1.02)
    ax.set_xlim(0, 160)
    ax.legend(loc="lower right")


def draw_belief_models(ax: Axes) -> None:
    """What the same numbers mean once others turned out empty: the chance to find it in the next container."""
    query = first_query(LOG, "Mug")
    here = search_space(query.belief, query.travel, origins=(START,), targets=(START,))
    order = np.argsort(-here.probability[0])[:8]
    looks = np.arange(1, len(order) + 1)
    ax.bar(looks, here.probability[0][order], color="#d9dce1", width=0.8, label="the network's probability")
    for i, model in enumerate(MODELS):
        missing = still_missing_along(here.probability[:1], order[None], model)[0]
        ax.plot(looks, 1 - missing[1:] / missing[:-1], "o-", color=unit_rgb(run_colour(i)), markersize=3, label=model)
    ax.set_xlabel("look, most probable container first; all before it were empty")
    ax.set_ylabel("chance that it is here")
    ax.set_ylim(0, 1.02)
    ax.legend()


def draw_consistent_worlds(ax: Axes) -> None:
    """Bounds, estimate and truth of every strategy, replayed over one log."""
    wanted = ReplayRequest(
        strategies=strategies_named("all", with_truth=False), settings=ReplaySettings(with_truth=True)
    )
    rows: list[StoredReplay] = []
    for row in replay_log(LOG, wanted):
        if isinstance(row, LogFailed):
            raise SystemExit(f"{row.strategy}: {row.reason}")
        rows.append(row)
    grey, blue = "#b9bec6", unit_rgb(run_colour(0))
    for y, row in enumerate(reversed(rows)):
        assert row.bounds is not None
        ax.plot([row.bounds.lower, row.bounds.upper], [y, y], "|-", color=grey, linewidth=4, markersize=10)
        if row.estimate is not None and not row.exact:
            ax.plot(row.estimate.interval90, [y, y], color=blue, linewidth=1.6)
            ax.plot(row.estimate.mean, y, "o", color=blue, markersize=4)
        ax.plot(row.true_cost, y, "x", color="#d55e00", markersize=6, markeredgewidth=1.6)
    ax.set_yticks(range(len(rows)), [row.strategy for row in reversed(rows)])
    ax.set_xlabel("cost")
    ax.plot([], [], "|-", color=grey, linewidth=4, label="from lower to upper: every consistent world")
    ax.plot([], [], "o-", color=blue, markersize=4, label="estimate, and where nine of ten drawn worlds lie")
    ax.plot([], [], "x", color="#d55e00", markeredgewidth=1.6, linestyle="none", label="in the recorded truth")
    ax.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0))


FIGURES = {
    "found-by": (draw_found_by, (5.2, 3.0)),
    "belief-models": (draw_belief_models, (5.2, 3.0)),
    "consistent-worlds": (draw_consistent_worlds, (6.0, 3.2)),
}


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    with figure_style(), mpl.rc_context({"font.size": 9, "svg.fonttype": "path"}):
        for name, (draw, size) in FIGURES.items():
            figure = Figure(figsize=size)
            draw(figure.add_subplot())
            figure.patch.set_facecolor("white")
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
            print(folder / f"{name}.svg")


if __name__ == "__main__":
    main()
