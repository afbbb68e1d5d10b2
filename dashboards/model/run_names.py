"""Names that distinguish runs shown together: the strategy, and what else differs among runs of one strategy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dashboards.palette import RUNS
from replayers.log_tools.log_paths import shown

if TYPE_CHECKING:
    from replayers.runs.run import Run


def run_names(runs: Sequence[Run]) -> list[str]:
    """One name for each run, in order.

    A name is the run's strategy. Where several runs share it, the first of estimator, seed, place, source (a replay)
    and file that differ among them are added, until all names differ; runs of the same file name get their number.
    Where more runs are shown than there are colours, all names begin with the run's number.
    """
    names = [run.info.strategy for run in runs]
    for part in (_estimator, _seed, _place, _replay, _file):
        again = Counter(names)
        same = {name: {part(r) for r, n in zip(runs, names, strict=True) if n == name} for name in again}
        names = [
            f"{name}{part(run)}" if again[name] > 1 and len(same[name]) > 1 else name
            for run, name in zip(runs, names, strict=True)
        ]
    if len(names) > len(RUNS):
        return [f"{i + 1}: {name}" for i, name in enumerate(names)]
    again = Counter(names)
    return [f"{name} #{i + 1}" if again[name] > 1 else name for i, name in enumerate(names)]


def _estimator(run: Run) -> str:
    return f", {run.info.estimator}"


def _seed(run: Run) -> str:
    return f", seed {run.info.seed}"


def _place(run: Run) -> str:
    return f", {run.info.place}"


def _replay(run: Run) -> str:
    return ", replay" if run.info.source == "replay" else ""


def _file(run: Run) -> str:
    return f", {shown(run.path.name)}"
