"""The figures of the object-search experiment: those of the paper and further ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.evaluation.figures.cost_scatter import draw_cost_scatter
from workbench.evaluation.figures.gap_closed import draw_gap_closed
from workbench.evaluation.figures.predicted_cost import draw_predicted_cost
from workbench.evaluation.figures.search_map import draw_search_map
from workbench.evaluation.figures.style import colour_of, new_figure, save
from workbench.evaluation.figures.worked_example import draw_worked_example
from workbench.evaluation.search.report import SearchReport
from workbench.evaluation.search.table import GREEDY, KINDS, Costs, rows
from workbench.evaluation.search.trials import ORACLE, PAPER_POLICY, SearchTrial
from workbench.plugins import NameOrigin
from workbench.worlds.house import House
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.maps.navigation import navigate


def draw_all(report: SearchReport, folder: Path) -> list[Path]:
    """Draw every figure of a report as PNG files into a folder, created if needed."""
    folder.mkdir(parents=True, exist_ok=True)
    costs = report.costs
    drawn = [_scatter(costs, folder), _gap(costs, report.request.seed, folder), _worked(folder)]
    predicting = [p for p in costs.policies if np.isfinite(costs.predicted[costs.policies.index(p)]).all()]
    if predicting:
        drawn.append(_predicted(costs, predicting, folder))
    example = example_query(costs, report.trials)
    if example is not None:
        drawn.append(_map(report, example, folder))
    return drawn


def best_policy(costs: Costs) -> str:
    """The policy of least mean cost among those that do not know the true house."""
    names = [p for p in costs.policies if p != ORACLE]
    return min(names, key=lambda name: float(costs.of(name).mean()))


def example_query(costs: Costs, trials: tuple[SearchTrial, ...]) -> tuple[SearchTrial, SearchTrial] | None:
    """Greedy's trial and the best policy's of the query whose saving is nearest to the mean; None without a saving.

    The best policy searches at least two containers there, so that the map shows a route.
    """
    best = best_policy(costs)
    if best == GREEDY:
        return None
    greedy = [t for t in trials if t.policy == GREEDY]
    ours = [t for t in trials if t.policy == best]
    mean = 1 - costs.of(best).mean() / costs.of(GREEDY).mean()
    pairs = [(a, b) for a, b in zip(greedy, ours, strict=True) if len(b.order) >= 2 and a.cost > b.cost]
    return min(pairs, key=lambda pair: abs(1 - pair[1].cost / pair[0].cost - mean), default=None)


def _scatter(costs: Costs, folder: Path) -> Path:
    best = best_policy(costs)
    names = list(dict.fromkeys(n for n in (PAPER_POLICY, best) if n in costs.policies))
    figure, axes = new_figure(4.2 * len(names), 4.4, columns=len(names))
    for ax, name in zip(axes, names, strict=True):
        draw_cost_scatter(ax, costs.of(GREEDY), costs.of(name), kinds=costs.kinds, name=name)
    return save(figure, folder / "scatter_against_greedy.png")


def _gap(costs: Costs, seed: int, folder: Path) -> Path:
    kinds = [kind for kind in KINDS if kind in costs.kinds]
    parts = [("all items", costs), *((kind, costs.only(kind)) for kind in kinds if len(kinds) > 1)]
    figure, axes = new_figure(4.0 * len(parts), 2.4, columns=len(parts))
    for ax, (title, part) in zip(axes, parts, strict=True):
        draw_gap_closed(ax, rows(part, seed=seed), title=f"{title} ({len(part.houses)} queries)")
    return save(figure, folder / "gap_closed.png")


def _predicted(costs: Costs, names: list[str], folder: Path) -> Path:
    best = min(names, key=lambda name: float(costs.of(name).mean()))
    place = costs.policies.index(best)
    shown = [("Eq. 1", costs.predicted[place]), ("corrected", costs.corrected[place])]
    shown = [(label, values) for label, values in shown if np.isfinite(values).all()]
    figure, axes = new_figure(4.2 * len(shown), 4.4, columns=len(shown))
    for ax, (label, values) in zip(axes, shown, strict=True):
        draw_predicted_cost(ax, values, costs.of(best), name=f"{best}, {label}", colour=colour_of(best))
    return save(figure, folder / "predicted_against_realised.png")


def _worked(folder: Path) -> Path:
    figure, axes = new_figure(9.0, 4.0, columns=2)
    draw_worked_example(axes[0], model="independent")
    draw_worked_example(axes[1], model="exists")
    return save(figure, folder / "worked_example.png")


def _map(report: SearchReport, example: tuple[SearchTrial, SearchTrial], folder: Path) -> Path:
    house = _house(report, example[0].house)
    navigation = navigate(house.plan)
    chosen = report.experiment.estimator_for(example[1].policy, house.plan.name)
    believed = estimator(chosen, origin=NameOrigin.USER).believe(
        knowledge_at_start(house.plan, navigation.travel, {}), (example[0].item_type,)
    )
    figure, axes = new_figure(10.0, 5.0, columns=2)
    for ax, trial in zip(axes, example, strict=True):
        looks = f"{len(trial.order)} look" + ("s" if len(trial.order) != 1 else "")
        draw_search_map(
            ax,
            house,
            navigation,
            trial.item_type,
            trial.order,
            belief=believed,
            title=f"{trial.policy} finds {trial.item_type}: cost {trial.cost:.1f}, {looks}",
            colour=colour_of(trial.policy),
        )
    return save(figure, folder / "example_trial.png")


def _house(report: SearchReport, name: str) -> House:
    for house in report.request.chosen_houses():
        if house.plan.name == name:
            return house
    raise LookupError(name)
