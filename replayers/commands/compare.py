"""`lios compare`: compares strategies over replayed logs, with what is certain and what is sampled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from replayers.batch.claims import Judgement
    from replayers.batch.compare import RunInSeveralLogs, StrategyComparison
    from replayers.batch.store import StoredReplay

JOIN = "Join the parts, and replay the whole: lios log merge PART... -o WHOLE.mcap, lios replay WHOLE.mcap -o DIR"


def compare(
    folder: Annotated[Path, Argument(help="A folder of replays, made by lios replay -o DIR.")],
    match: Annotated[str, Option("-k", help="Only pairs whose names contain this text.")] = "",
    frames: Annotated[
        bool, Option("--frames", help="Write replays.parquet and steps.parquet into the folder.")
    ] = False,
    fail_if: Annotated[
        list[str] | None,
        Option(
            "--fail-if",
            help='Exit with 1 if this is shown: "A > B" (A costs more), with "by bounds" or "by interval" (default) '
            "after it; repeat for several.",
        ),
    ] = None,
    junit: Annotated[Path | None, Option("--junit", help="Write the outcome of --fail-if as JUnit XML.")] = None,
    seed: Annotated[int, Option("--seed", help="Seed of the intervals.")] = 0,
    json: Json = False,
) -> None:
    """Compare strategies over replayed logs.

    wins, loses and equal hold in every world that agrees with the log; the rest is undecided. Intervals resample
    houses; with only one house they resample its logs, are widened, and say nothing about other houses. If the
    folder also holds replays with --misses K, the output says how many overlooked items each certain claim
    survives.

    Examples:

        lios compare replays/

        lios compare replays/ -k model-lios --frames --json

        lios compare replays/ --fail-if "conditioned-lios > model-lios by bounds" --junit claims.xml
    """
    import numpy as np

    from replayers.batch.beliefs_apart import named_by_estimator
    from replayers.batch.breakdown import breakdowns, fewest_misses, in_words
    from replayers.batch.claims import judge, parse_claim
    from replayers.batch.compare import changed_houses, names_of, runs_once
    from replayers.batch.compare import compare as compared
    from replayers.batch.store import replays_in
    from replayers.commands.losses import end_with_losses
    from replayers.runs.gaps import LogLosses
    from workbench.errors import BadValue, MalformedFile
    from workbench.terminal import counted, emit_json, say

    claims = [parse_claim(text) for text in fail_if or ()]
    if junit is not None and not claims:
        raise BadValue("--junit", str(junit), "given together with --fail-if")
    if frames:
        import_module("replayers.tables.arrow")  # refuses where Parquet cannot be written
    skipped: list[MalformedFile] = []
    stored = tuple(replays_in(folder, on_skipped=skipped.append))
    found = named_by_estimator(stored)
    records, several = runs_once(fewest_misses(found))
    for error in skipped:
        say(f"skipped {error}")
    if not found:
        raise MalformedFile(folder, "no replays in this folder", "Make some: lios replay LOG... -o DIR")
    if not records:
        raise MalformedFile(folder, several[0].words, JOIN)
    pairs = compared(records, rng=np.random.default_rng(seed))
    judged = [judge(claim, pairs, replayed=[record.strategy for record in records]) for claim in claims]
    met = tuple(pair for pair in pairs if match.lower() in f"{pair.a} {pair.b}".lower())
    if pairs and not met:
        names = sorted({name for pair in pairs for name in (pair.a, pair.b)})
        say(f"No pair's names contain {match!r}. There are: {', '.join(names)}.")
    if not pairs:
        say(_no_pair(records))
    pairs = met
    if frames:
        from replayers.batch.replay_tables import replays_frame, steps_frame
        from workbench.files import atomic

        for name, frame in (("replays", replays_frame(stored)), ("steps", steps_frame(stored))):
            with atomic(folder / f"{name}.parquet") as draft:
                frame.to_parquet(draft)
    lost = LogLosses(
        lost={record.log: record.lost for record in records if record.lost},
        cut_off=tuple(sorted({record.log for record in records if not record.complete_log})),
    )
    imagined = sorted({record.log for record in records if record.imputed})
    corrected = {record.log: record.corrections for record in records if record.corrections}
    changed, broken, unlike = changed_houses(records), _broken(records), _not_reproduced(records)
    rows, survived = [_row(pair) for pair in pairs], breakdowns(pairs, found)
    if json:
        emit_json({"rows": rows, "changed_houses": changed, "replays": len(found), "broken": broken,
                   "not_reproduced": unlike,
                   "runs_in_several_logs": [_several(run) for run in several],
                   "imagined_logs": imagined, "corrected": corrected, "lost": lost.lost, "cut_off": lost.cut_off,
                   "breakdowns": [asdict(one) for one in survived],
                   "skipped": [str(error) for error in skipped],
                   "claims": [_claim(j) for j in judged], "seed": seed})  # fmt: skip
        _settle(judged, junit)
        end_with_losses(lost)
        return
    _tell(rows, changed, broken)
    for line in in_words(survived):
        say(line)
    for run in several:
        say(f"note: {run.words}" + ("" if run.kept else f"; they are left out. {JOIN}"))
    if imagined:
        say(f"note: {counted(len(imagined), 'log')} of imagined worlds: what lies in some containers is imputed, "
            f"nobody saw it: {names_of(imagined)}")  # fmt: skip
    if corrected:
        what = "; ".join(f"{Path(log).name}: {', '.join(words)}" for log, words in corrected.items())
        were = f"{counted(len(corrected), 'log')} {'was' if len(corrected) == 1 else 'were'}"
        say(f"note: {were} corrected by people, which count as certain: {what}")
    for log, reason in unlike.items():
        say(f"note: {log} is left out: {reason}")
    if frames:
        say(f"Wrote {folder / 'replays.parquet'} and {folder / 'steps.parquet'}")
    for judgement in judged:
        say(judgement.words)
    _settle(judged, junit)
    end_with_losses(lost)


def _settle(judged: Sequence[Judgement], junit: Path | None) -> None:
    """Write the judgements where they are wanted.

    Raises:
        Failed: a claim of --fail-if holds.
    """
    from replayers.batch.claims import junit_xml
    from workbench.errors import Failed
    from workbench.files import write_text

    if junit is not None:
        write_text(junit, junit_xml(judged))
    shown = [judgement.words for judgement in judged if judgement.holds]
    if shown:
        raise Failed("; ".join(shown))


def _claim(judgement: Judgement) -> dict[str, Any]:
    from replayers.counterfactual.estimates.intervals import finite

    return {
        "claim": judgement.claim.text,
        "by": judgement.claim.evidence,
        "holds": judgement.holds,
        "difference_low": finite(judgement.low),
        "difference_high": finite(judgement.high),
    }


def _several(run: RunInSeveralLogs) -> dict[str, Any]:
    incomplete = [{"log": log, "lacks": lacks} for log, lacks in run.incomplete]
    return {"run_id": run.run_id, "logs": run.logs, "kept": run.kept, "incomplete": incomplete}


def _no_pair(records: Sequence[StoredReplay]) -> str:
    """Why no two strategies can be compared, and what to do."""
    names = sorted({record.strategy for record in records})
    if len(names) == 1:
        alone = f"{names[0]} is the only strategy here"
        return f"Nothing to compare: {alone}. Replay others: lios replay LOG... -s all -o DIR"
    return (
        f"Nothing to compare: no two of {', '.join(names)} were replayed over the same log with an outcome. "
        "Replay them together: lios replay LOG... -s all -o DIR"
    )


def _tell(rows: list[dict[str, Any]], changed: Sequence[str], broken: list[dict[str, Any]]) -> None:
    """The table, and what to know when reading it."""
    from workbench.evaluation.statistics import intervals_in_words
    from workbench.terminal import emit_table, say

    if rows:
        title = "a against b; negative differences mean that a is cheaper"
        minor = ("true difference", "drawn difference", "chance a is cheaper", "equal")
        emit_table([_shown(row) for row in rows], title=title, minor=minor)
        drew = [row[f"{kind}_ci95_resamples"] for row in rows for kind in ("drawn", "true")]
        if words := intervals_in_words(kind for kind in drew if kind):
            say(words)
    for place in changed:
        say(f"note: {place} differs between logs (plan or travel costs); its versions count as different houses")
    for one in broken:
        say(
            f"note: {one['strategy']} broke on {one['logs']} of {one['replays']} logs; "
            f"they are left out of its pairs: {one['reason']}"
        )


def _broken(records: Sequence[StoredReplay]) -> list[dict[str, Any]]:
    """Strategies that broke on some of their logs: on how many, and why on the first."""
    ran = Counter(r.strategy for r in records)
    of = {name: [r for r in records if r.strategy == name and r.status == "planner-failed"] for name in ran}
    return [
        {"strategy": name, "logs": len(broke), "replays": ran[name], "reason": broke[0].reason}
        for name, broke in of.items()
        if broke
    ]


def _not_reproduced(records: Sequence[StoredReplay]) -> dict[str, str]:
    """Logs on which the recorded strategy does not do what was recorded, with the reasons: they are in no pair."""
    return {r.log: r.reason for r in records if r.status == "not-reproduced"}


def _row(pair: StrategyComparison) -> dict[str, Any]:
    from replayers.counterfactual.estimates.intervals import finite

    return {
        "a": pair.a,
        "b": pair.b,
        "logs": pair.logs,
        "houses": pair.houses,
        "wins": pair.wins,
        "loses": pair.loses,
        "equal": pair.equal,
        "undecided": pair.undecided,
        "difference_lower": finite(pair.least),
        "difference_upper": finite(pair.most),
        "drawn_difference": pair.drawn.value if pair.drawn else None,
        "drawn_ci95": pair.drawn.interval if pair.drawn and pair.drawn.trials > 1 else None,
        "drawn_ci95_resamples": pair.drawn.resampled("houses", "logs") if pair.drawn else None,
        "chance_a_cheaper": pair.chance,
        "true_difference": pair.true.value if pair.true else None,
        "true_ci95": pair.true.interval if pair.true and pair.true.trials > 1 else None,
        "true_ci95_resamples": pair.true.resampled("houses", "logs") if pair.true else None,
        "by_log": [
            {
                "log": d.log,
                "verdict": d.verdict,
                "lower": finite(d.least),
                "upper": finite(d.most),
                "paired": d.paired,
                "chance_a_cheaper": d.chance[0] if d.chance else None,
                "true": d.true,
            }
            for d in pair.differences
        ],
    }


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    shown = {name: row[name] for name in ("a", "b", "logs", "wins", "equal", "undecided", "loses")}
    shown["certain difference"] = _range(row["difference_lower"], row["difference_upper"])
    shown["drawn difference"] = _interval(row["drawn_difference"], row["drawn_ci95"])
    shown["chance a is cheaper"] = row["chance_a_cheaper"]
    if row["true_difference"] is not None:
        shown["true difference"] = _interval(row["true_difference"], row["true_ci95"])
    return shown


def _range(least: float | None, most: float | None) -> str:
    if least is None:
        return "unknown" if most is None else f"at most {most:.1f}"
    return f"at least {least:.1f}" if most is None else f"{least:.1f} to {most:.1f}"


def _interval(value: float | None, ci: tuple[float, float] | None) -> str | None:
    if value is None:
        return None
    return f"{value:.1f}" if ci is None else f"{value:.1f} ({ci[0]:.1f} to {ci[1]:.1f})"
