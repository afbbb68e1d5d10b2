"""Report of an evaluation of tasks: the table, the pairs and the figures, in one HTML file."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
from markupsafe import Markup

from dashboards.figures.style import PAGE_IN, figure_style
from dashboards.figures.trajectory import draw_trajectory
from dashboards.model.timeline import timeline_of
from dashboards.panels.markup import html, text
from replayers.runs.run import Run, read
from workbench.errors import NotFound
from workbench.evaluation.figures.style import save_whole
from workbench.evaluation.figures.task_figures import draw_task_figures
from workbench.evaluation.statistics import ends_in_words, intervals_in_words
from workbench.evaluation.tasks.names import scenario_file_name, scenario_title, strategy_title
from workbench.evaluation.tasks.rows import SETTINGS_FILE, TRIALS_FILE, TaskRow, read_rows
from workbench.evaluation.tasks.store import read_request
from workbench.evaluation.tasks.table import pairs, table
from workbench.files import write_atomically

EXAMPLE = ("model-lios", "opt-greedy", "conditioned-lios")
"""Strategies of an example trial, the first in focus."""
TITLE_LETTERS = 80
"""Characters that fit above the picture of an example."""


class NoEvaluation(NotFound):
    """A folder that is not the output of an evaluation of tasks."""

    def __init__(self, folder: Path, lacks: str) -> None:
        super().__init__(f"{folder}: not an evaluation of tasks (no {lacks}). Make one: lios evaluate tasks -o DIR.")


class NoTrialsReported(NotFound):
    """An evaluation that was stopped before its first trial, or that no house supports."""

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder}: the evaluation holds no trial. Run it again: lios evaluate tasks -o {folder}.")


def write_report(folder: Path) -> tuple[Path, list[Path]]:
    """Writes report.html and figures/ beside the trials; returns the page and the figures.

    Raises:
        NoEvaluation: the folder holds no evaluation of tasks.
        NoTrialsReported: it holds no trial.
        MalformedFile: its files are damaged.
    """
    for name in (SETTINGS_FILE, TRIALS_FILE):
        if not (folder / name).exists():
            raise NoEvaluation(folder, name)
    request = read_request(folder / SETTINGS_FILE)
    names = {name: i for i, name in enumerate(request.strategies)}
    scenarios = {name: i for i, name in enumerate(request.scenarios)}
    rows = read_rows(folder / TRIALS_FILE, torn_is_fine=True)
    if not rows:
        raise NoTrialsReported(folder)
    last = len(names) + len(scenarios)
    rows.sort(key=lambda r: (scenarios.get(r.scenario, last), r.trial, names.get(r.strategy, last), r.strategy))
    lines = table(rows, seed=request.seed)
    figures = draw_task_figures(rows, lines, folder / "figures")
    figures += _examples(rows, folder)
    page = folder / "report.html"
    html = _html(request.houses, rows, lines, pairs(rows, seed=request.seed), figures)
    write_atomically(page, html.encode())
    return page, figures


def _examples(rows: Sequence[TaskRow], folder: Path) -> list[Path]:
    """For each scenario with recorded logs, the trial with the median gain: annotated paths from above."""
    from matplotlib.figure import Figure

    drawn: list[Path] = []
    for scenario in dict.fromkeys(row.scenario for row in rows):
        logs = _logs_of(rows, scenario, folder)
        trial = _typical(rows, scenario, set(logs))
        timelines = [
            timeline_of(logs[name, trial]) for name in EXAMPLE if trial is not None and (name, trial) in logs
        ]
        if not timelines:
            continue
        with figure_style():
            figure = Figure(figsize=(PAGE_IN * 0.7, PAGE_IN * 0.6), layout="constrained")
            ax = figure.add_subplot()
            draw_trajectory(ax, timelines)
            costs = ", ".join(
                f"{strategy_title(t.run.info.strategy)} {t.run.outcome.cost:.0f}"
                for t in timelines
                if t.run.outcome is not None
            )
            ax.set_title("\n".join([*wrap(timelines[0].task_words, TITLE_LETTERS), costs]), fontsize=7)
            path = folder / "figures" / f"example_{scenario_file_name(scenario)}.png"
            save_whole(figure, path, dpi=200, metadata={"Software": None})
            save_whole(figure, path.with_suffix(".pdf"), metadata={"CreationDate": None})
        drawn.append(path)
    return drawn


def _logs_of(rows: Sequence[TaskRow], scenario: str, folder: Path) -> dict[tuple[str, int], Run]:
    """The recorded runs of the rows, by strategy and trial; logs of other evaluations are ignored."""
    from recorders.task_trials import log_path

    found: dict[tuple[str, int], Run] = {}
    for row in rows:
        path = log_path(folder / "logs", scenario, row.trial, row.strategy)
        if row.scenario == scenario and row.strategy in EXAMPLE and path.exists():
            run = read(path)
            same = (run.info.place, run.info.seed, run.info.estimator) == (row.house, row.seed, row.estimator)
            if same and run.outcome is not None:
                found[row.strategy, row.trial] = run
    return found


def _typical(rows: Sequence[TaskRow], scenario: str, recorded: set[tuple[str, int]]) -> int | None:
    costs = {(r.strategy, r.trial): r.cost for r in rows if r.scenario == scenario}
    have = sorted(trial for name, trial in recorded if name == EXAMPLE[0])
    gains = [(costs.get((EXAMPLE[1], t), 0.0) - costs.get((EXAMPLE[0], t), 0.0), t) for t in have]
    return sorted(gains)[len(gains) // 2][1] if gains else None


def _html(
    houses: str,
    rows: Sequence[TaskRow],
    lines: Sequence[Mapping[str, Any]],
    compared: Sequence[Mapping[str, Any]],
    figures: Sequence[Path],
) -> Markup:
    seconds = np.array([b + p for r in rows for b, p in zip(r.belief_s, r.planning_s, strict=True)] or [0.0])
    intro = (
        f"{len(rows)} runs in houses of {Path(houses).name}; {len(seconds)} decisions, "
        f"median {1e3 * float(np.median(seconds)):.1f} ms, "
        f"95th percentile {1e3 * float(np.quantile(seconds, 0.95)):.0f} ms. "
        f"Costs are in metres and their equivalents; {intervals_in_words(line['ci95_resamples'] for line in lines)}."
    )
    parts = [
        Markup("<h1>Task planning with missing objects</h1>"),
        html("<p>{}</p>", intro),
        _table(lines),
        _pairs(compared),
    ]
    for path in figures:
        image = base64.b64encode(path.read_bytes()).decode()
        name = text(path.stem.replace("_", " "))
        picture = html('<img alt="{}" src="data:image/png;base64,{}">', name, image)
        parts.append(html("<figure>{}<figcaption>{}</figcaption></figure>", picture, name))
    body = Markup("\n").join(parts)
    head = html('<html lang="en"><meta charset="utf-8"><title>Task planning</title>\n{}', _STYLE)
    return html("<!doctype html>\n{}\n{}\n</html>\n", head, body)


_STYLE = Markup("""<style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; display: block; overflow-x: auto }
td, th { padding: .25rem .6rem; border-bottom: 1px solid #ddd; text-align: right }
td:first-child, th:first-child { text-align: left } .best { font-weight: 700 }
.costs { font-size: 13px } .costs td, .costs th { padding: .25rem .35rem; white-space: nowrap; vertical-align: top }
.costs th[colspan] { text-align: center; white-space: normal } .costs tr:nth-child(2) th { text-align: right }
.costs td:nth-child(3n+2) { border-left: 1px solid #eee }
.interval { color: #777; font-size: 85% } figure { margin: 2rem 0 } img { max-width: 100% }
</style>""")


def _table(lines: Sequence[Mapping[str, Any]]) -> Markup:
    scenarios = list(dict.fromkeys(line["scenario"] for line in lines))
    strategies = list(dict.fromkeys(line["strategy"] for line in lines))
    cells = {(line["scenario"], line["strategy"]): line for line in lines}
    best = {
        s: min(c["mean_cost"] for (scenario, name), c in cells.items() if scenario == s and name != "oracle")
        for s in scenarios
        if any(scenario == s and name != "oracle" for scenario, name in cells)
    }
    head = Markup("").join(html("<th colspan=3>{}</th>", scenario_title(s)) for s in scenarios)
    below = Markup("<th>cost</th><th>succ.</th><th>replan</th>") * len(scenarios)
    out = [html("<table class=costs><tr><th rowspan=2>Strategy</th>{}</tr><tr>{}</tr>", head, below)]
    for name in strategies:
        row = [html("<td>{}</td>", strategy_title(name))]
        for s in scenarios:
            line = cells.get((s, name))
            if line is None:
                row.append(Markup("<td>-</td><td>-</td><td>-</td>"))
                continue
            mark = Markup(' class="best"') if name != "oracle" and line["mean_cost"] <= best[s] else ""
            ends = ends_in_words(line["ci95"], ".0f")
            row.append(
                html(
                    "<td{}>{:.1f}<br><span class=interval>{}</span></td><td>{:.0f} %</td><td>{:.0f} ms</td>",
                    mark,
                    line["mean_cost"],
                    ends,
                    100 * line["success_rate"],
                    1000.0 * line["replan_p50_s"],
                )
            )
        out.append(html("<tr>{}</tr>", Markup("").join(row)))
    return Markup("\n").join([*out, Markup("</table>")])


def _pairs(compared: Sequence[Mapping[str, Any]]) -> Markup:
    out = [Markup("<h2>Paired differences</h2><table><tr><th>Scenario</th><th>Strategy</th><th>against</th>")]
    out.append(Markup("<th>difference</th><th>share</th><th>better</th><th>worse</th></tr>"))
    for pair in compared:
        share = ends_in_words(pair["share_ci95"], "+.1f", scale=100)
        out.append(
            html(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:+.2f}</td><td>{:+.1f} % <span "
                "class=interval>{}</span></td><td>{:.0f} %</td><td>{:.0f} %</td></tr>",
                scenario_title(pair["scenario"]),
                strategy_title(pair["a"]),
                strategy_title(pair["b"]),
                pair["difference"],
                100 * pair["share"],
                share,
                100 * pair["a_wins"],
                100 * pair["b_wins"],
            )
        )
    return Markup("\n").join([*out, Markup("</table>")])
