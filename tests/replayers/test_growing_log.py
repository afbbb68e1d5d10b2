"""A growing log: each reading holds what reading the file from its start would, whatever part is on disk."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
from growing import grown
from sample_logs import toy_info, toy_options, write_toy_log

from recorders.run_recorder import RunRecorder
from replayers.runs.growing_log import GrowingLog
from replayers.runs.run import Run, read
from workbench.errors import FileMissing, LiosError


def _held(run: Run) -> dict[str, object]:
    """All that a run holds but how its file ends."""
    left_out = {"path", "damage", "sha256_read"}
    return {f.name: getattr(run, f.name) for f in fields(run) if f.name not in left_out}


def test_every_beginning_reads_as_from_its_start(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    growing = GrowingLog(tmp_path / "growing.mcap")
    lengths: list[int] = []
    found = None
    for copy in grown(log, growing.path):
        try:
            whole = read(copy)
        except LiosError:
            with pytest.raises(type(_error_of(copy))):
                growing.read()
            continue
        found = growing.read()
        assert found is not None
        assert _held(found) == _held(whole)
        assert growing.read() is None
        lengths.append(len(found.observations) + len(found.actions))
    assert lengths == sorted(lengths)
    assert lengths[0] < lengths[-1]
    assert found is not None
    assert found.complete
    assert found.sha256 == read(log).sha256


def _error_of(path: Path) -> LiosError:
    try:
        read(path)
    except LiosError as error:
        return error
    raise AssertionError("it can be read")


def test_half_a_record_is_left_for_the_next_reading(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    data = log.read_bytes()
    growing = GrowingLog(tmp_path / "growing.mcap")
    ends = [copy.stat().st_size for copy in grown(log, tmp_path / "ends.mcap")]
    growing.path.write_bytes(data[: ends[-2]])
    first = growing.read()
    growing.path.write_bytes(data[: ends[-2] + 40])
    half = growing.read()
    assert first is not None
    assert half is not None
    assert _held(half) == _held(first)
    assert half.damage == ()
    growing.path.write_bytes(data)
    last = growing.read()
    assert last is not None
    assert last.outcome == read(log).outcome


def test_a_log_that_is_replaced_is_read_anew(tmp_path: Path) -> None:
    growing = GrowingLog(write_toy_log(tmp_path / "run.mcap"))
    assert growing.read() is not None
    options = {**toy_options(), "info": toy_info(run_id="another", strategy="pes-greedy")}
    with RunRecorder(growing.path, force=True, **options):  # type: ignore[arg-type]
        pass
    found = growing.read()
    assert found is not None
    assert found.info.run_id == "another"
    assert found.actions == ()


def test_no_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileMissing):
        GrowingLog(tmp_path / "no.mcap").read()
