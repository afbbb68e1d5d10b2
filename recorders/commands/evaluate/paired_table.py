"""Rows that compare two ways of running the same trials, as a file, JSON or a table: what `lios evaluate search`
answers with --memory and --sees, and `lios evaluate tasks` with --memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple


class PairedTable(NamedTuple):
    """How an answer is shown.

    Attributes:
        title: what stands above the table.
        columns: the columns in their order.
        row: a row as shown, from one of the answer.
    """

    title: str
    columns: Sequence[str]
    row: Callable[[dict[str, Any]], dict[str, object]]


def require_free(file: Path | None, *, force: bool) -> None:
    """Check that a file may be written.

    Raises:
        OutputExists: it is there, and `force` was not given.
    """
    from workbench.errors import OutputExists

    if file is not None and file.exists() and not force:
        raise OutputExists(file)


def skipped_rows(skipped: Iterable[tuple[str, str]]) -> list[dict[str, str]]:
    """Houses that were left out and why, as an answer has them."""
    return [{"house": house, "reason": reason} for house, reason in skipped]


def answer_with(answer: dict[str, Any], table: PairedTable, file: Path | None, *, json: bool) -> None:
    """Write an answer to a file, if one is given, and print it as JSON or as a table."""
    import msgspec

    from workbench.files import write_atomically
    from workbench.terminal import emit_json

    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, msgspec.json.format(msgspec.json.encode(answer), indent=2) + b"\n")
    emit_json(answer) if json else _print(answer, table, file)


def _print(answer: dict[str, Any], table: PairedTable, file: Path | None) -> None:
    from workbench.evaluation.statistics import intervals_in_words
    from workbench.terminal import emit_table, say

    shown = [table.row(row) for row in answer["rows"]]
    emit_table(shown, columns=table.columns, title=f"{table.title} ({answer['split']})")
    if words := intervals_in_words(row["ci95_resamples"] for row in answer["rows"]):
        say(words)
    for skipped in answer["skipped"]:
        say(f"left out: {skipped['house']}: {skipped['reason']}")
    if file is not None:
        say(f"Written to {file}")
