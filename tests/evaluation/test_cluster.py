"""Work on a Dask cluster of this machine: what comes back, and one line for what can be wrong with it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

import pytest

from workbench.errors import BadValue, InputError
from workbench.evaluation import cluster
from workbench.evaluation.cluster import (
    FolderNotShared,
    WorkerImportFailed,
    WorkerVersionDiffers,
    in_order_on_cluster,
    on_cluster,
    run_in_order,
)

pytest.importorskip("distributed", reason="dask.distributed is not installed")
pytestmark = pytest.mark.filterwarnings("ignore")


def negated(number: int) -> int:
    return -number


def slept(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def without_a_package(number: int) -> int:
    raise ModuleNotFoundError(f"no module for {number}")


def refused(number: int) -> int:
    raise BadValue("the number", number, "another")


class NobodyThere:
    """A client of a scheduler that has no worker, then one."""

    def __init__(self, workers: Sequence[int]) -> None:
        self._workers = list(workers)

    def scheduler_info(self) -> dict[str, dict[str, int]]:
        now = self._workers.pop(0) if len(self._workers) > 1 else self._workers[0]
        return {"workers": {str(i): i for i in range(now)}}


@pytest.mark.slow
def test_results_carry_the_index_of_their_unit() -> None:
    assert sorted(on_cluster(negated, [3, 1, 2], scheduler="local", workers=1)) == [(0, -3), (1, -1), (2, -2)]


@pytest.mark.slow
def test_results_come_in_the_order_of_the_units() -> None:
    made = in_order_on_cluster(slept, [0.5, 0.0, 0.1], scheduler="local", workers=2)
    assert list(made) == [0.5, 0.0, 0.1]


def test_a_worker_without_the_folder_says_so(tmp_path: Path) -> None:
    with pytest.raises(FolderNotShared, match="not-there"):
        cluster._in_folder(str(tmp_path / "not-there"), negated, 1)


@pytest.mark.slow
def test_errors_of_the_work_arrive_as_they_are() -> None:
    with pytest.raises(BadValue, match="the number"):
        list(on_cluster(refused, [1], scheduler="local", workers=1))
    with pytest.raises(WorkerImportFailed, match="Install lios-workbench"):
        list(on_cluster(without_a_package, [1], scheduler="local", workers=1))


@pytest.mark.slow
def test_a_worker_of_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "__version__", "99.0")
    with pytest.raises(WorkerVersionDiffers, match=r"this machine 99\.0"):
        list(on_cluster(negated, [1], scheduler="local", workers=1))


def test_an_address_without_a_scheduler_is_one_line() -> None:
    with pytest.raises(InputError, match="no Dask scheduler answers at nowhere"):
        list(on_cluster(negated, [1], scheduler="nowhere://127.0.0.1:1", workers=1))


def test_a_word_while_no_worker_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(cluster, "LOOK_EVERY_S", 0.01)
    monkeypatch.setattr(cluster, "say", said.append)
    with cluster._warning_without_workers(NobodyThere([2, 0, 0, 1]), "tcp://here"):
        end = time.monotonic() + 60
        while len(said) < 2 and time.monotonic() < end:
            time.sleep(0.01)
    assert said == ["No worker is at tcp://here: waiting for one.", "Workers are available again."]


def test_units_are_taken_as_they_are_needed() -> None:
    taken: list[int] = []

    def units() -> Iterator[int]:
        for number in range(1000):
            taken.append(number)
            yield number

    assert list(islice(run_in_order(negated, units()), 3)) == [0, -1, -2]
    assert len(taken) == 3


@pytest.mark.slow
def test_many_units_are_not_handed_out_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "MIN_AHEAD", 4)
    most, taken, given = 0, 0, 0

    def units() -> Iterator[int]:
        nonlocal most, taken
        for number in range(50):
            taken += 1
            most = max(most, taken - given)
            yield number

    for index, result in on_cluster(negated, units(), scheduler="local", workers=1):
        given += 1
        assert result == -index
    assert given == 50
    assert most <= 6
