"""What did the trials of `lios evaluate tasks` give? The rows of its folder, read without what runs them."""

from __future__ import annotations

from pathlib import Path

import msgspec

from workbench.errors import MalformedFile

TRIALS_FILE, SETTINGS_FILE = "trials.jsonl", "settings.json"


class TaskRow(msgspec.Struct, frozen=True, kw_only=True):
    """What one trial gave.

    Attributes:
        cost: what is charged: the run's own cost when done, the failure cost otherwise.
        predicted_cost: what the first plan was expected to cost; None without a plan.
        estimator: what believed, with a hash of its weights.
        optimal: share of the plans that were proven optimal over the places they considered.
        belief_s, planning_s: wall-clock seconds of every decision.
    """

    scenario: str
    strategy: str
    estimator: str
    trial: int
    house: str
    house_index: int
    seed: int
    status: str
    success: bool
    cost: float
    own_cost: float
    searches: int
    travel_m: float
    decisions: int
    predicted_cost: float | None
    optimal: float
    reason: str
    title: str
    containers: int
    belief_s: tuple[float, ...]
    planning_s: tuple[float, ...]


def read_rows(path: Path, *, torn_is_fine: bool = False) -> list[TaskRow]:
    """The rows of a trials file, of a trial that was run again the last one.

    Args:
        torn_is_fine: a last line that was cut off by a kill is left out.

    Raises:
        MalformedFile: another line that is no trial.
    """
    rows: dict[tuple[str, int, str], TaskRow] = {}
    lines = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        try:
            row = msgspec.json.decode(line, type=TaskRow)
        except msgspec.MsgspecError as error:
            if torn_is_fine and number == len(lines) - 1:
                continue
            raise MalformedFile(f"{path}:{number + 1}", f"no trial: {error}", "Remove the line") from error
        rows[row.scenario, row.trial, row.strategy] = row
    return list(rows.values())
