"""Results kept one by one: what is run again, in which order they come, and what a torn file does."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

import pytest

from workbench.evaluation.stored_results import EvaluationInProgress, StoredResults, content_of, key_of, run_resumable


def run_of(units: list[int], path: Path, ran: list[int]) -> Iterator[int]:
    """Negates units, and notes which ones it ran."""

    def run(missing: Iterable[int]) -> Iterator[int]:
        for unit in missing:
            ran.append(unit)
            yield -unit

    with StoredResults(path, int) as kept:
        yield from run_resumable(units, kept, key=str, run=run)


def test_what_is_there_is_not_run_again_and_the_order_stays(tmp_path: Path) -> None:
    path, ran = tmp_path / "kept.jsonl", list[int]()
    stopped = run_of([1, 2, 3, 4], path, ran)
    assert list(islice(stopped, 2)) == [-1, -2]
    stopped.close()
    assert list(run_of([5, 1, 6, 2, 3], path, ran)) == [-5, -1, -6, -2, -3]
    assert ran == [1, 2, 5, 6, 3]
    assert list(run_of([2, 1], path, ran)) == [-2, -1]
    assert ran == [1, 2, 5, 6, 3]


def test_a_torn_line_is_run_again(tmp_path: Path) -> None:
    path, ran = tmp_path / "kept.jsonl", list[int]()
    assert list(run_of([1, 2], path, ran)) == [-1, -2]
    path.write_bytes(path.read_bytes()[:-4])
    assert list(run_of([1, 2], path, ran)) == [-1, -2]
    assert list(run_of([1, 2], path, ran)) == [-1, -2]
    assert ran == [1, 2, 2]


def test_two_do_not_write_at_once(tmp_path: Path) -> None:
    with StoredResults(tmp_path / "kept.jsonl", int), pytest.raises(EvaluationInProgress, match="another evaluation"):
        StoredResults(tmp_path / "kept.jsonl", int)


def test_keys_differ_with_every_part_and_with_the_code_of_a_policy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert key_of(1, "a") == key_of(1, "a") != key_of(1, "b")
    assert content_of("lios") == "lios"
    monkeypatch.chdir(tmp_path)
    Path("a_policy_of_mine.py").write_text("A = 1")
    before = content_of("a_policy_of_mine:A")
    Path("a_policy_of_mine.py").write_text("A = 2")
    assert content_of("a_policy_of_mine:A") != before
    assert content_of("a_policy_of_mine.py") == content_of("a_policy_of_mine:A")
    assert content_of("no_such_module:A") == "no_such_module:A"
