"""What does an evaluation of tasks look like on one page? The table, the pairs and the figures, in one HTML file."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from dashboards.figures.style import PAGE_IN, figure_style
from dashboards.figures.trajectory import draw_trajectory
from dashboards.timeline import timeline_of
from replayers.run import read
from workbench.errors import NotFound
from workbench.evaluation.figures.task_figures import draw_task_figures
from workbench.evaluation.task_experiment import read_request
from workbench.evaluation.task_rows import SETTINGS_FILE, TRIALS_FILE, TaskRow, read_rows
from workbench.evaluation.task_table import pairs, table
from workbench.planning.scenarios import PAPER_TITLES
from workbench.planning.strategies import PAPER_NAMES

EXAMPLE = ("model-lios", "opt-greedy", "conditioned-lios")
"""Strategies of an example trial, the first in focus."""


class NoEvaluation(NotFound):
    """A folder that is no output of an evaluation of tasks."""

    def __init__(self, folder: Path, lacks: str) -> None:
        super().__init__(
            f"{folder}: no evaluation of tasks is there (no {lacks}). Make one: lios evaluate tasks -o DIR."
        )


def write_report(folder: Path) -> tuple[Path, list[Path]]:
    """Writes report.html and figures/ beside the trials; returns the page and the figures.

    Raises:
        NoEvaluation: the folder holds no evaluation of tasks.
        MalformedFile: its files are damaged.
    """
    for name in (SETTINGS_FILE, TRIALS_FILE):
        if not (folder / name).exists():
            raise NoEvaluation(folder, name)
    request = read_request(folder / SETTINGS_FILE)
    names = {name: i for i, name in enumerate(request.strategies)}
    scenarios = {name: i for i, name in enumerate(request.scenarios)}
    rows = read_rows(folder / TRIALS_FILE, torn_is_fine=True)
    last = len(names) + len(scenarios)
    rows.sort(key=lambda r: (scenarios.get(r.scenario, last), r.trial, names.get(r.strategy, last), r.strategy))
    lines = table(rows, seed=request.seed)
    figures = draw_task_figures(rows, lines, folder / "figures")
    figures += _examples(rows, folder)
    page = folder / "report.html"
    page.write_text(_html(request.houses, rows, lines, pairs(rows, seed=request.seed), figures), encoding="utf-8")
    return page, figures


def _examples(rows: Sequence[TaskRow], folder: Path) -> list[Path]:
    """For each scenario with recorded logs, the trial with the median gain: annotated ways from above."""
    from matplotlib.figure import Figure

    from recorders.task_recording import log_path

    drawn: list[Path] = []
    for scenario in dict.fromkeys(row.scenario for row in rows):
        trial = _typical(rows, scenario, folder)
        logs = [] if trial is None else [log_path(folder / "logs", scenario, trial, name) for name in EXAMPLE]
        timelines = [timeline_of(read(path)) for path in logs if path.exists()]
        if not timelines:
            continue
        with figure_style():
            figure = Figure(figsize=(PAGE_IN * 0.7, PAGE_IN * 0.6), layout="constrained")
            ax = figure.add_subplot()
            draw_trajectory(ax, timelines)
            costs = ", ".join(
                f"{PAPER_NAMES.get(t.run.info.strategy, t.run.info.strategy)} {t.run.outcome.cost:.0f}"
                for t in timelines
                if t.run.outcome is not None
            )
            ax.set_title(f"{timelines[0].task_words}\n{costs}", fontsize=7)
            path = folder / "figures" / f"example_{log_path(folder, scenario, 0, '').parent.name}.png"
            figure.savefig(path, dpi=200, metadata={"Software": None})
            figure.savefig(path.with_suffix(".pdf"), metadata={"CreationDate": None})
        drawn.append(path)
    return drawn


def _typical(rows: Sequence[TaskRow], scenario: str, folder: Path) -> int | None:
    from recorders.task_recording import log_path

    costs = {(r.strategy, r.trial): r.cost for r in rows if r.scenario == scenario}
    trials = sorted({r.trial for r in rows if r.scenario == scenario})
    have = [t for t in trials if log_path(folder / "logs", scenario, t, EXAMPLE[0]).exists()]
    gains = [(costs.get((EXAMPLE[1], t), 0.0) - costs.get((EXAMPLE[0], t), 0.0), t) for t in have]
    return sorted(gains)[len(gains) // 2][1] if gains else None


def _html(
    houses: str,
    rows: Sequence[TaskRow],
    lines: Sequence[Mapping[str, Any]],
    compared: Sequence[Mapping[str, Any]],
    figures: Sequence[Path],
) -> str:
    seconds = np.array([b + p for r in rows for b, p in zip(r.belief_s, r.planning_s, strict=True)] or [0.0])
    intro = (
        f"{len(rows)} runs in houses of {escape(Path(houses).name)}; {len(seconds)} decisions, "
        f"median {1e3 * float(np.median(seconds)):.1f} ms, "
        f"95th percentile {1e3 * float(np.quantile(seconds, 0.95)):.0f} ms. "
        "Costs are in metres and their equivalents; intervals are 95 %, drawn over houses."
    )
    parts = ["<h1>Task planning with missing objects</h1>", f"<p>{intro}</p>", _table(lines), _pairs(compared)]
    for path in figures:
        image = base64.b64encode(path.read_bytes()).decode()
        name = escape(path.stem.replace("_", " "))
        picture = f'<img alt="{name}" src="data:image/png;base64,{image}">'
        parts.append(f"<figure>{picture}<figcaption>{name}</figcaption></figure>")
    body = "\n".join(parts)
    head = f'<html lang="en"><meta charset="utf-8"><title>Task planning</title>\n{_STYLE}'
    return f"<!doctype html>\n{head}\n{body}\n</html>\n"


_STYLE = """<style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; display: block; overflow-x: auto }
td, th { padding: .25rem .6rem; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child { text-align: left } .best { font-weight: 700 }
.interval { color: #777; font-size: 85% } figure { margin: 2rem 0 } img { max-width: 100% }
</style>"""


def _table(lines: Sequence[Mapping[str, Any]]) -> str:
    scenarios = list(dict.fromkeys(line["scenario"] for line in lines))
    strategies = list(dict.fromkeys(line["strategy"] for line in lines))
    cells = {(line["scenario"], line["strategy"]): line for line in lines}
    best = {
        s: min(c["mean_cost"] for (scenario, name), c in cells.items() if scenario == s and name != "oracle")
        for s in scenarios
        if any(scenario == s and name != "oracle" for scenario, name in cells)
    }
    head = "".join(f"<th>{escape(PAPER_TITLES.get(s, s))}</th><th>Succ.</th><th>Replan</th>" for s in scenarios)
    out = [f"<table><tr><th>Strategy</th>{head}</tr>"]
    for name in strategies:
        row = [f"<td>{escape(PAPER_NAMES.get(name, name))}</td>"]
        for s in scenarios:
            line = cells.get((s, name))
            if line is None:
                row.append("<td>-</td><td>-</td><td>-</td>")
                continue
            low, high = line["ci95"]
            mark = ' class="best"' if name != "oracle" and line["mean_cost"] <= best[s] else ""
            row.append(
                f"<td{mark}>{line['mean_cost']:.1f} <span class=interval>{low:.0f} to {high:.0f}</span></td>"
                f"<td>{100 * line['success_rate']:.0f} %</td><td>{1e3 * line['replan_p50_s']:.0f} ms</td>"
            )
        out.append(f"<tr>{''.join(row)}</tr>")
    return "\n".join([*out, "</table>"])


def _pairs(compared: Sequence[Mapping[str, Any]]) -> str:
    out = ["<h2>Paired differences</h2><table><tr><th>Scenario</th><th>Strategy</th><th>against</th>"]
    out.append("<th>difference</th><th>share</th><th>better</th><th>worse</th></tr>")
    for pair in compared:
        low, high = pair["share_ci95"]
        out.append(
            f"<tr><td>{escape(PAPER_TITLES.get(pair['scenario'], pair['scenario']))}</td>"
            f"<td>{escape(PAPER_NAMES.get(pair['a'], pair['a']))}</td>"
            f"<td>{escape(PAPER_NAMES.get(pair['b'], pair['b']))}</td><td>{pair['difference']:+.2f}</td>"
            f"<td>{100 * pair['share']:+.1f} % <span class=interval>{100 * low:+.1f} to {100 * high:+.1f}</span></td>"
            f"<td>{100 * pair['a_wins']:.0f} %</td><td>{100 * pair['b_wins']:.0f} %</td></tr>"
        )
    return "\n".join([*out, "</table>"])
