"""The trials of a task evaluation: which there are, and which are still to be run.

The result uses rows sorted by scenario, strategy and trial, so that it does not depend on the distribution of work.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue, Unsupported
from workbench.evaluation.beliefs.fold_weights import FoldEstimators, Folds, FoldSplit, make_folds, require_trainable
from workbench.evaluation.splits import effective_split, split_indices
from workbench.evaluation.tasks.cell_filter import CellFilter, cell_filter
from workbench.evaluation.tasks.rows import TaskRow
from workbench.evaluation.tasks.trials import EventHook, TrialKey, supported_houses, trial_keys
from workbench.evaluation.tasks.workers import Unit
from workbench.planning.scenarios.paper import SCENARIOS, is_scenario_file, scenario_name
from workbench.planning.strategies import STRATEGIES, canonical_name, resolved_name
from workbench.plugins import NameOrigin
from workbench.worlds.procthor.house_files import house_lines
from workbench.worlds.procthor.load import house_name

PAPER_STRATEGIES = ("opt-greedy", "pes-greedy", "opt-lios", "pes-lios", "model-lios")


class TaskRequest(msgspec.Struct, frozen=True, kw_only=True):
    """The settings of a task evaluation; the same settings give the same rows.

    Attributes:
        houses: the file; "" for the shipped ones.
        split: part of a shared file; ignored with folds.
        scenarios, strategies: names, in the table's order.
        estimator: estimator of our strategies and plug-ins; paper_estimator: estimator of the paper's five.
        folds: number of cross-validation folds over the training houses; 0 for none.
        also: files of training-only houses, with folds.
        miss_rate: the chance that a look misses an item.
        sees_m: how far the robot sees open furniture in passing, in metres; 0 for not at all.
    """

    houses: str = ""
    split: str = "test"
    scenarios: tuple[str, ...]
    strategies: tuple[str, ...]
    trials: int = 100
    seed: int = 0
    estimator: str = "best"
    paper_estimator: str = "fcnn"
    assets: str = ""
    folds: int = 0
    also: tuple[str, ...] = ()
    miss_rate: float = 0.0
    sees_m: float = 0.0

    @property
    def fold_settings(self) -> Folds | None:
        """The settings of folds; None without folds."""
        return Folds(count=self.folds, also=tuple(Path(path) for path in self.also)) if self.folds else None

    @property
    def house_description(self) -> str:
        """A description of the evaluated houses."""
        return self.fold_settings.split if self.fold_settings else effective_split(self.houses, self.split)

    def fold_split(self) -> FoldSplit | None:
        """The houses in folds; None without folds. Raises InputError as make_folds."""
        folds = self.fold_settings
        if folds is None:
            return None
        assets = Path(self.assets) if self.assets else None
        return make_folds(Path(self.houses), folds, assets=assets, seed=self.seed)

    def estimators(self) -> tuple[str, ...]:
        """The estimator names in use."""
        return tuple(dict.fromkeys(self.estimator_of(name) for name in self.strategies))

    def require_estimators(self) -> None:
        """Check the estimators.

        Raises:
            InputError: an estimator does not exist or, with folds, cannot be trained.
        """
        if self.folds:
            require_trainable(self.estimators())
        else:
            for name in self.estimators():
                estimator(name, origin=NameOrigin.USER)

    def estimator_of(self, strategy: str) -> str:
        name = canonical_name(strategy.partition("@")[0])
        return self.paper_estimator if name in PAPER_STRATEGIES else self.estimator


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedTrials:
    """All trials of a request, and the houses that could not support a scenario, with the reason."""

    keys: tuple[TrialKey, ...]
    refused: tuple[tuple[str, str, str], ...]
    """Refused houses as (scenario, house, what it lacks)."""
    houses: dict[str, int]
    """Number of houses that support each scenario."""


class NoSupportingHouse(Unsupported):
    """No house supports any of the scenarios."""

    def __init__(self, request: TaskRequest) -> None:
        super().__init__(
            f"no house of {request.houses} ({request.house_description}) supports {', '.join(request.scenarios)}. "
            "Give other houses, another --split or other --scenarios."
        )


def scenario_list(names: str) -> tuple[str, ...]:
    """Scenarios from "all" or names separated by commas, validated."""
    if names.strip().lower() == "all":
        return SCENARIOS
    listed = tuple(name.strip() for name in names.split(",") if name.strip())
    if not listed:
        raise BadValue("scenarios", names, "all, or names separated by commas")
    return tuple(dict.fromkeys(name if is_scenario_file(name) else scenario_name(name) for name in listed))


def strategy_list(names: str) -> tuple[str, ...]:
    """Strategies from "all", "paper" or names separated by commas; the oracle is always included, last among the
    built-in ones."""
    from workbench.planning.strategies import strategy as strategy_named

    if names.strip().lower() == "all":
        return tuple(STRATEGIES)
    listed = tuple(name.strip() for name in names.split(",") if name.strip())
    if not listed:
        raise BadValue("strategies", names, "all, paper, or names separated by commas")
    chosen: list[str] = []
    for name in listed:
        if name.lower() == "paper":
            chosen += PAPER_STRATEGIES
            continue
        resolved = resolved_name(name)
        if resolved.partition("@")[0] != "oracle":
            strategy_named(name, origin=NameOrigin.USER)
        chosen.append(resolved)
    return tuple(dict.fromkeys((*chosen, "oracle")))


def plan_trials(request: TaskRequest, fold_split: FoldSplit | None = None) -> PlannedTrials:
    """All trials of a request. Houses that cannot support a scenario are reported, not skipped silently.

    Args:
        fold_split: the houses in folds, for a request with folds.
    """
    path = Path(request.houses)
    count = sum(1 for _ in house_lines(path))
    if fold_split is None:
        indices = split_indices(path, request.split, houses=count)
    else:
        judged = fold_split.fold_of()
        indices = tuple(k for k in range(count) if house_name(path, k) in judged)
    if not indices:
        raise BadValue("houses", f"{path} ({request.split})", "a file with houses in that split")
    keys: list[TrialKey] = []
    refused: list[tuple[str, str, str]] = []
    houses: dict[str, int] = {}
    assets = Path(request.assets) if request.assets else None
    for scenario in request.scenarios:
        fine, others = supported_houses(scenario, request.houses, indices, assets=assets, seed=request.seed)
        houses[scenario] = len(fine)
        refused += [(scenario, other.house, other.lacks) for other in others]
        keys += trial_keys(scenario, request.houses, fine, trials=request.trials, seed=request.seed)
    return PlannedTrials(keys=tuple(keys), refused=tuple(refused), houses=houses)


def remaining_units(
    request: TaskRequest,
    keys: Iterable[TrialKey],
    done: Iterable[TaskRow],
    event_hook: EventHook | None,
    meant: CellFilter = cell_filter(""),
    fold_estimators: FoldEstimators | None = None,
) -> list[Unit]:
    """The remaining work of the selected cells.

    Args:
        fold_estimators: weights by house, of a request with folds.
    """
    weights = fold_estimators or FoldEstimators()
    have = {(row.scenario, row.trial, row.strategy) for row in done}
    units: list[Unit] = []
    for key in keys:
        names = tuple(
            n for n in request.strategies if meant(key.scenario, n) and (key.scenario, key.trial, n) not in have
        )
        if names:
            house = house_name(Path(key.houses), key.house_index)
            pairs = tuple((name, weights.of(request.estimator_of(name), house)) for name in names)
            units.append(
                Unit(
                    key=key,
                    strategies=pairs,
                    assets=request.assets,
                    event_hook=event_hook,
                    miss_rate=request.miss_rate,
                    sees_m=request.sees_m,
                )
            )
    return units


def wanted_rows(
    request: TaskRequest, keys: Iterable[TrialKey], rows: Iterable[TaskRow], meant: CellFilter = cell_filter("")
) -> list[TaskRow]:
    """The rows of the selected cells of a request, in a deterministic order."""
    order = {(key.scenario, key.trial): i for i, key in enumerate(keys)}
    names = {name: i for i, name in enumerate(request.strategies)}
    chosen = [
        r for r in rows if (r.scenario, r.trial) in order and r.strategy in names and meant(r.scenario, r.strategy)
    ]
    return sorted(chosen, key=lambda r: (order[r.scenario, r.trial], names[r.strategy]))
