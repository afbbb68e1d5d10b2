"""The result rows of `lios evaluate tasks`, read without importing the code that runs trials."""

from __future__ import annotations

from pathlib import Path

import msgspec

from workbench.errors import MalformedFile

TRIALS_FILE, SETTINGS_FILE = "trials.jsonl", "settings.json"


class TaskRow(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one trial.

    Attributes:
        cost: the charged cost: the run's own cost if done, the failure cost otherwise.
        predicted_cost: expected cost of the first plan; None without a plan.
        estimator: the estimator with a hash of its weights.
        optimal: share of plans proven optimal over the locations considered.
        belief_s, planning_s: wall-clock time of every decision in seconds.
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
    """The rows of a trials file; of a repeated trial, the last row.

    Args:
        torn_is_fine: ignore an incomplete last line, as left by a killed process.

    Raises:
        MalformedFile: any other line is not a trial.
    """
    rows: dict[tuple[str, int, str], TaskRow] = {}
    lines = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        try:
            row = msgspec.json.decode(line, type=TaskRow)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
            if torn_is_fine and number == len(lines) - 1:
                continue
            raise MalformedFile(f"{path}:{number + 1}", f"no trial: {error}", "Remove the line") from error
        rows[row.scenario, row.trial, row.strategy] = row
    return list(rows.values())
