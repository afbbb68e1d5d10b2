"""All figures of a task evaluation, drawn into a folder as PNG and PDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from workbench.evaluation.figures.planning_time import draw_planning_time
from workbench.evaluation.figures.style import new_figure, save, save_whole
from workbench.evaluation.figures.task_bars import draw_task_bars
from workbench.evaluation.figures.task_scatter import draw_task_scatter
from workbench.evaluation.tasks.names import scenario_file_name
from workbench.evaluation.tasks.rows import TaskRow

BASELINES = ("opt-greedy", "pes-greedy", "opt-lios", "pes-lios")
SCATTERS = (
    *(("model-lios", baseline) for baseline in BASELINES),
    ("conditioned-lios", "model-lios"),
    ("scout-lios", "conditioned-lios"),
)


def draw_task_figures(rows: Sequence[TaskRow], lines: Sequence[Mapping[str, Any]], folder: Path) -> list[Path]:
    """Draw every figure that the rows have data for; returns the PNG files."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for value in ("mean_cost", "success_rate"):
        figure, axes = new_figure(7.2, 3.2)
        draw_task_bars(axes[0], lines, value=value)
        written.append(_save(figure, folder / f"{value}.png"))
    figure, axes = new_figure(4.2, 3.0)
    draw_planning_time(axes[0], _seconds(rows), share_of_belief=_share_of_belief(rows))
    written.append(_save(figure, folder / "planning_time.png"))
    for scenario in dict.fromkeys(row.scenario for row in rows):
        path = folder / f"scatter_{scenario_file_name(scenario)}.png"
        if _scatter(scenario, [row for row in rows if row.scenario == scenario], path):
            written.append(path)
    return written


def _scatter(scenario: str, rows: list[TaskRow], path: Path) -> bool:
    costs = {name: {r.trial: r.cost for r in rows if r.strategy == name} for name in {r.strategy for r in rows}}
    shown = [(a, b) for a, b in SCATTERS if a in costs and b in costs and costs[a].keys() & costs[b].keys()]
    if not shown:
        return False
    figure, axes = new_figure(2.5 * len(shown), 2.8, columns=len(shown))
    for ax, (ours, theirs) in zip(axes, shown, strict=True):
        trials = sorted(costs[ours].keys() & costs[theirs].keys())
        baseline = np.array([costs[theirs][t] for t in trials])
        draw_task_scatter(ax, baseline, np.array([costs[ours][t] for t in trials]), names=(theirs, ours))
    _save(figure, path)
    return True


def _seconds(rows: Sequence[TaskRow]) -> dict[str, np.ndarray]:
    found: dict[str, list[float]] = {}
    for row in rows:
        if row.strategy != "oracle":
            times = [b + p for b, p in zip(row.belief_s, row.planning_s, strict=True)]
            found.setdefault(row.scenario, []).extend(times)
    return {scenario: np.array(times) for scenario, times in found.items()}


def _share_of_belief(rows: Sequence[TaskRow]) -> float | None:
    belief, planning = sum(sum(r.belief_s) for r in rows), sum(sum(r.planning_s) for r in rows)
    return belief / (belief + planning) if belief + planning > 0 else None


def _save(figure: Figure, path: Path) -> Path:
    save_whole(figure, path.with_suffix(".pdf"), metadata={"CreationDate": None})
    return save(figure, path)
