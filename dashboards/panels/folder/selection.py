"""Panel of a folder of trials: which strategy to drive next, and after which trial what was known."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from dashboards.model.selection import FolderSelection
from dashboards.panels.markup import breakable, html, name, percent, table, text
from replayers.selection.campaign_logs import TrialGroup
from replayers.selection.verdict import SelectionVerdict
from replayers.selection.verdict_text import at_most, mean_cost, out_of_choice, standing_words, summary

MAX_TRIALS = 100
"""Trials that are listed, the latest."""
MAX_LEFT_OUT = 5


def selection(found: FolderSelection, folder: Path) -> Markup:
    """For each group of trials a sentence, the standing of every strategy, and what was known after each trial."""
    if not found.groups:
        return html(
            '<div class="lp"><h3>Drive next</h3><p class="muted">No replays of two strategies are kept here. '
            "Make them: <code>lios select {} -o {}</code></p>{}</div>",
            text(folder.name),
            text(f"{folder.name}/replays"),
            _left_out(found),
        )
    groups = Markup("").join(_group(k, *group, alpha=found.alpha) for k, group in enumerate(found.groups))
    return html('<div class="lp"><h3>Drive next</h3>{}{}{}</div>', _believed(found), groups, _left_out(found))


def _believed(found: FolderSelection) -> Markup:
    """Whose beliefs the candidates follow, where that is known."""
    if not found.estimators:
        return Markup("")
    words = Markup(", ").join(name(one) for one in found.estimators)
    return html('<p class="muted">As <code>lios select --estimator</code> {} answered last here.</p>', words)


def _group(number_of: int, group: TrialGroup, verdicts: tuple[SelectionVerdict, ...], *, alpha: float) -> Markup:
    last = verdicts[-1]
    broke = Markup("").join(
        html(
            '<p class="warn">Left out of the choice: {} broke on {} of these logs: {}</p>',
            name(strategy),
            len(logs),
            text(why),
        )
        for strategy, (logs, why) in sorted(group.broke.items())
    )
    return html(
        "<p><b>{}</b>: {} trials. {}</p>{}{}{}",
        text(group.name),
        len(verdicts),
        text(summary(last, alpha=alpha)),
        _standings(number_of, last),
        _trials(number_of, group, verdicts),
        broke,
    )


def _standings(number_of: int, last: SelectionVerdict) -> Markup:
    rows = [
        [
            name(s.strategy),
            text(mean_cost(s)),
            "–" if s.chance_best is None else percent(s.chance_best),
            text(standing_words(s.strategy, last)),
        ]
        for s in last.standings
    ]
    head = ("strategy", "mean cost", "best", "standing")
    hints = {"best": "share of resampled trials and worlds in which it is the cheapest"}
    return table(head, rows, key=f"standings{number_of}", classes=("", "n", "n", ""), hints=hints)


def _trials(number_of: int, group: TrialGroup, verdicts: tuple[SelectionVerdict, ...]) -> Markup:
    rows = [
        [
            str(v.trials),
            breakable(log.name),
            name(v.next),
            Markup(", ").join(name(e.strategy) for e in v.by_proof) or text("none"),
            text(at_most(v.regret_so_far)),
        ]
        for v, log in list(zip(verdicts, group.logs, strict=True))[-MAX_TRIALS:]
    ]
    head = ("trial", "log", "drive next", "out by proof", "regret")
    hints = {"regret": "the most, per trial, by which the one to drive next may have cost more than any other so far"}
    return table(head, rows, key=f"trials{number_of}", classes=("n", "", "", "", "n"), hints=hints)


def _left_out(found: FolderSelection) -> Markup:
    lines = found.left_out[:MAX_LEFT_OUT]
    more = len(found.left_out) - len(lines)
    out = Markup("").join(html('<p class="warn">{}</p>', text(line)) for line in out_of_choice(found.not_replayed))
    listed = Markup("").join(html('<p class="muted">left out: {}</p>', text(line)) for line in lines)
    return out + listed + (html('<p class="muted">and {} more</p>', more) if more else Markup(""))
