"""`lios compare`: compares strategies over replayed logs, with what is certain and what is sampled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.options import Json

if TYPE_CHECKING:
    from replayers.comparing import Pair
    from replayers.stored_replays import StoredReplay


def compare(
    folder: Annotated[Path, typer.Argument(help="A folder of replays, made by lios replay -o DIR.")],
    match: Annotated[str, typer.Option("-k", help="Only pairs whose names contain this text.")] = "",
    frames: Annotated[
        bool, typer.Option("--frames", help="Write replays.parquet and steps.parquet into the folder.")
    ] = False,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the intervals.")] = 0,
    json: Json = False,
) -> None:
    """Compare strategies in pairs over replayed logs.

    wins, loses and equal hold in every world that is consistent with the log; the rest is undecided.

    Examples:

        lios compare replays/

        lios compare replays/ -k model-lios --frames --json
    """
    import numpy as np

    from replayers.comparing import changed_houses
    from replayers.comparing import compare as compared
    from replayers.stored_replays import replays_in
    from workbench.errors import MalformedFile
    from workbench.terminal import emit_json, say

    skipped: list[MalformedFile] = []
    records = list(replays_in(folder, on_skipped=skipped.append))
    for error in skipped:
        say(f"skipped {error}")
    if not records:
        raise MalformedFile(folder, "no replays in this folder", "Make some: lios replay LOG... -o DIR")
    pairs = compared(records, rng=np.random.default_rng(seed))
    met = tuple(pair for pair in pairs if match.lower() in f"{pair.a} {pair.b}".lower())
    if pairs and not met:
        names = sorted({name for pair in pairs for name in (pair.a, pair.b)})
        say(f"No pair's names contain {match!r}. There are: {', '.join(names)}.")
    pairs = met
    if frames:
        from replayers.replay_frames import replays_frame, steps_frame

        replays_frame(records).to_parquet(folder / "replays.parquet")
        steps_frame(records).to_parquet(folder / "steps.parquet")
    changed, broken = changed_houses(records), _broken(records)
    rows = [_row(pair) for pair in pairs]
    if json:
        emit_json({"rows": rows, "changed_houses": changed, "replays": len(records), "broken": broken,
                   "skipped": [str(error) for error in skipped], "seed": seed})  # fmt: skip
        return
    _tell(rows, changed, broken)
    if frames:
        say(f"Wrote {folder / 'replays.parquet'} and {folder / 'steps.parquet'}")


def _tell(rows: list[dict[str, Any]], changed: Sequence[str], broken: list[dict[str, Any]]) -> None:
    """The table, and what to know when reading it."""
    from workbench.terminal import emit_table, say

    if rows:
        emit_table([_shown(row) for row in rows], title="a against b; negative differences mean that a is cheaper")
    for place in changed:
        say(f"note: {place} differs between logs (plan or travel costs); its versions count as different houses")
    for one in broken:
        say(
            f"note: {one['strategy']} broke on {one['logs']} of {one['replays']} logs; "
            f"they are left out of its pairs: {one['reason']}"
        )


def _broken(records: list[StoredReplay]) -> list[dict[str, Any]]:
    """Strategies that broke on some of their logs: on how many, and why on the first."""
    ran = Counter(r.strategy for r in records)
    of = {name: [r for r in records if r.strategy == name and r.status == "planner-failed"] for name in ran}
    return [
        {"strategy": name, "logs": len(broke), "replays": ran[name], "reason": broke[0].reason}
        for name, broke in of.items()
        if broke
    ]


def _row(pair: Pair) -> dict[str, Any]:
    return {
        "a": pair.a,
        "b": pair.b,
        "logs": pair.logs,
        "houses": pair.houses,
        "wins": pair.wins,
        "loses": pair.loses,
        "equal": pair.equal,
        "undecided": pair.undecided,
        "difference_lower": pair.least,
        "difference_upper": pair.most,
        "drawn_difference": pair.drawn.value if pair.drawn else None,
        "drawn_ci95": pair.drawn.interval if pair.drawn else None,
        "chance_a_cheaper": pair.chance,
        "true_difference": pair.true.value if pair.true else None,
        "true_ci95": pair.true.interval if pair.true else None,
        "by_log": [
            {
                "log": d.log,
                "verdict": d.verdict,
                "lower": d.least,
                "upper": d.most,
                "paired": d.paired,
                "chance_a_cheaper": d.chance[0] if d.chance else None,
                "true": d.true,
            }
            for d in pair.differences
        ],
    }


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    shown = {name: row[name] for name in ("a", "b", "logs", "wins", "equal", "undecided", "loses")}
    shown["certain difference"] = f"{row['difference_lower']:.1f} to {row['difference_upper']:.1f}"
    shown["drawn difference"] = _interval(row["drawn_difference"], row["drawn_ci95"])
    shown["chance a is cheaper"] = row["chance_a_cheaper"]
    if row["true_difference"] is not None:
        shown["true difference"] = _interval(row["true_difference"], row["true_ci95"])
    return shown


def _interval(value: float | None, ci: tuple[float, float] | None) -> str | None:
    return None if value is None or ci is None else f"{value:.1f} ({ci[0]:.1f} to {ci[1]:.1f})"
