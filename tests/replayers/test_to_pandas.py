"""Columns become the frames that Arrow itself would make of them: of one log or many, with missing values."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_logs import killed_toy_log, toy_events, toy_info, toy_options, write_toy_log

import replayers
from recorders.run_recorder import RunRecorder
from replayers.tables import to_pandas as data_frames
from replayers.tables.column_types import CategoryColumn, NumberColumn, column_of
from replayers.tables.frames import Tables
from replayers.tables.schemas import NUMBER, SCHEMAS, TEXT, TIME, WHOLE, WORD, WORDS, YES
from workbench.log_schema.events import Stamp

LOGS = Path(__file__).resolve().parents[2] / "logs"
TYPES = {pa.string(): pd.StringDtype("pyarrow"), pa.int64(): pd.Int64Dtype(), pa.bool_(): pd.BooleanDtype()}
VALUES = {
    WORD: st.none() | st.sampled_from(["a", "b", "c", ""]),
    TEXT: st.none() | st.text("ab \0é日\U0001f600", max_size=3),
    WORDS: st.lists(st.sampled_from(["a", "b"]), max_size=3),
    WHOLE: st.none() | st.integers(-(2**63), 2**63 - 1),
    NUMBER: st.none() | st.floats(allow_nan=False),
    YES: st.none() | st.booleans(),
    TIME: st.integers(0, 2**62),
}


def in_arrow(values: list, kind: pa.DataType) -> pa.Array:
    """By Arrow alone."""
    return pa.array(values, pa.string()).dictionary_encode() if kind == WORD else pa.array(values, kind)


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("kind", VALUES, ids=str)
@given(data=st.data())
def test_a_column_is_what_arrow_makes_of_the_values(kind: pa.DataType, data: st.DataObject):
    values = data.draw(st.lists(VALUES[kind], max_size=12))
    cut = data.draw(st.integers(0, len(values)))
    theirs = in_arrow(values, kind)
    whole, cells = column_of(values, kind), type(column_of(values, kind))
    for ours in (whole, cells.joined([column_of(values[:cut], kind), column_of(values[cut:], kind)])):
        assert len(ours) == len(values)
        assert ours.to_arrow().type == kind
        assert ours.to_arrow().to_pylist() == theirs.to_pylist()
        if kind == WORD and not any(value is not None for value in values):
            continue  # pandas makes objects, not text, of no words
        want = pa.table({"x": theirs}).to_pandas(types_mapper=TYPES.get)["x"]
        pd.testing.assert_series_equal(pd.Series(ours.to_pandas(), name="x"), want)


def test_words_of_several_logs_share_one_vocabulary():
    one, two = CategoryColumn.of(["b", None, "a"]), CategoryColumn.repeated(["c", "a"], [2, 1])
    both = CategoryColumn.joined([one, two])
    assert both.words == ("b", "a", "c")
    assert both.codes.tolist() == [0, -1, 1, 2, 2, 1]


def test_what_is_missing_of_numbers_is_told_of_all_logs():
    both = NumberColumn.joined([NumberColumn.of([1, 2], WHOLE), NumberColumn.of([None], WHOLE)])
    assert both.to_arrow().to_pylist() == [1, 2, None]
    assert NumberColumn.of([None, 0.5], NUMBER).to_arrow().to_pylist() == [None, 0.5]
    assert np.isnan(NumberColumn.of([None, 0.5], NUMBER).to_pandas()[0])


def test_frames_of_many_logs_are_what_arrow_would_make(tmp_path: Path):
    write_toy_log(tmp_path / "a.mcap")
    killed_toy_log(tmp_path / "b.mcap")
    options = toy_options() | {"info": toy_info(run_id="other", place="elsewhere")}
    with RunRecorder(tmp_path / "c.mcap", **options) as recorder:
        for event in toy_events():
            recorder.record(event)
    tables = replayers.read_many(tmp_path)
    for name in SCHEMAS:
        theirs = tables.arrow(name).to_pandas(types_mapper=TYPES.get, use_threads=False)
        bare = [n for n in theirs if theirs[n].dtype == "category" and not len(theirs[n].cat.categories)]
        pd.testing.assert_frame_equal(getattr(tables, name).drop(columns=bare), theirs.drop(columns=bare))
    assert list(tables.runs["run_id"].cat.categories) == ["0123456789ab", "other"]


def test_frames_are_the_same_before_pandas_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Which has no constructor that takes columns as they are."""
    path = write_toy_log(tmp_path / "a.mcap")
    quick = replayers.read(path).tables
    monkeypatch.setattr(data_frames, "create_dataframe_from_blocks", None)
    plain = replayers.read(path).tables
    for name in SCHEMAS:
        pd.testing.assert_frame_equal(getattr(quick, name), getattr(plain, name))


def test_frames_do_not_share_what_users_may_name(tmp_path: Path):
    one, two = (replayers.read(write_toy_log(tmp_path / name)).tables.actions for name in ("a.mcap", "b.mcap"))
    one.columns.name = "mine"
    one["kind"] = 1
    assert two.columns.name is None
    assert replayers.read(tmp_path / "a.mcap").tables.actions.columns.name is None
    assert list(two.columns) == SCHEMAS["actions"].names


def test_a_number_beyond_64_bits_leaves_out_its_log_alone(tmp_path: Path):
    run = replayers.read(write_toy_log(tmp_path / "a.mcap"))
    late = replace(run, info=toy_info(started=Stamp(sec=2**62, nsec=0)))
    tables = Tables([*late.tables.sources, *run.tables.sources])
    assert len(tables.runs) == 1
    assert "beyond 64 bits" in tables.problems[0].reason


def test_a_run_with_tables_is_freed_at_once(tmp_path: Path):
    """Thousands of logs are read in a loop; what waits for the collector is a second of pauses and their memory."""
    run = replayers.read(write_toy_log(tmp_path / "a.mcap"))
    assert len(run.tables.actions)
    gone = weakref.ref(run)
    gc.disable()
    try:
        del run
        assert gone() is None
    finally:
        gc.enable()


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("path", sorted(LOGS.glob("*.mcap")), ids=lambda path: path.stem)
def test_sample_logs_read_whole_or_table_by_table_are_the_same(path: Path):
    whole, lazy = replayers.read(path).tables, replayers.read_many(path)
    for name in SCHEMAS:
        pd.testing.assert_frame_equal(getattr(whole, name), getattr(lazy, name))
