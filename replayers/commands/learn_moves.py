"""`lios learn-moves`: learns how often things move, from logs of a household or episodes of rearrangement."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import Force, Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from workbench.beliefs.memory.move_rates import MoveRates, RateRow


def learn_moves(
    sources: Annotated[list[Path], Argument(help="Logs of one place, or folders of them; or one file of episodes.")],
    known: Annotated[Path | None, Option("--rates", help="Rates to start from; default: the shipped ones.")] = None,
    output: Annotated[Path, Option("--output", "-o", help="The table to write, for --rates.")] = Path("rates.csv"),
    force: Force = False,
    json: Json = False,
) -> None:
    """Learn how often things move, per item type, in moves per day.

    In logs, an item that was seen in one run and is seen again or gone in a later one shows how often things move
    in this household, and how often items of its type do. A file of episodes (.jsonl, .jsonl.gz) has one object
    per line with "scene" and "moves"; an episode counts as one day.

    Examples:

        lios learn-moves logs/ -o rates.csv && lios record --find mug --memory logs/ --rates rates.csv -o run.mcap

        lios learn-moves ithor_moves_2023.jsonl.gz -o rates.csv
    """
    from workbench.beliefs.memory.move_rates import OTHERS, read_rates, shipped_rates, write_rates
    from workbench.errors import BadValue, OutputExists
    from workbench.terminal import emit_json, emit_table, say

    if output.exists() and not force:
        raise OutputExists(output)
    episodes = _episodes_among(sources)
    if episodes is not None:
        if known is not None:
            raise BadValue("--rates", str(known), "left out with a file of episodes, which departs from nothing")
        from workbench.beliefs.memory.episodes import rates_from_episodes

        rows = rates_from_episodes(episodes)
    else:
        rows = _from_logs(sources, shipped_rates() if known is None else read_rates(known))
    write_rates(output, rows)
    others = next(row for row in rows if row.item_type == OTHERS)
    if json:
        emit_json({"file": str(output), "rows": [_values(row) for row in rows]})
        return
    seen = sorted((row for row in rows if row.moves and row is not others), key=lambda row: -row.moves)
    emit_table([_values(row) for row in (others, *seen[:12])])
    say(f"{others.moves:g} moves in {others.days:.1f} item-days. Written to {output}; use it: --rates {output}")


def _episodes_among(sources: list[Path]) -> Path | None:
    """The file of episodes, where that is what is given."""
    first, *others = sources
    return first if not others and first.name.endswith((".jsonl", ".jsonl.gz")) else None


def _from_logs(sources: list[Path], known: MoveRates) -> tuple[RateRow, ...]:
    from replayers.memory.collect import NoRepeatedLooks, read_history
    from workbench.beliefs.memory.fit_rates import fit_rates
    from workbench.beliefs.memory.memory import intervals
    from workbench.terminal import say

    history = read_history(sources)
    for note in history.notes:
        say(f"note: {note}")
    found = intervals(history.looks)
    if not any(interval.days > 0 for interval in found):
        raise NoRepeatedLooks(", ".join(map(str, sources)))
    return fit_rates(found, known)


def _values(row: RateRow) -> dict[str, object]:
    return {"item_type": row.item_type, "moves_per_day": row.rate, "moves": row.moves, "days": row.days}
