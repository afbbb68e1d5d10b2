"""Tables have the declared rows and types, for one log or many, and a bad log does not break the others."""

from __future__ import annotations

import json
from pathlib import Path

import duckdb
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from sample_logs import T0, killed_toy_log, toy_info, toy_options, write_toy_log
from toy import COUNTER, FRIDGE, TABLE

import replayers
from recorders.run_recorder import RunRecorder
from replayers.log_tools.listing import cache_path, row_of, rows_of
from replayers.tables.frames import NoLogs, Tables
from replayers.tables.schemas import SCHEMAS
from workbench import cli
from workbench.log_schema.events import NANO


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_toy_log(tmp_path / "a.mcap")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three runs, one of them killed, and one file that is no log."""
    where = tmp_path / "logs"
    for number in range(2):
        info = toy_info(run_id=f"run{number}", strategy=("model-lios", "opt-greedy")[number])
        (where / str(number)).mkdir(parents=True)
        options = toy_options() | {"info": info}
        from sample_logs import toy_events

        with RunRecorder(where / str(number) / "run.mcap", **options) as recorder:
            for event in toy_events():
                recorder.record(event)
    killed_toy_log(where / "killed.mcap")
    (where / "broken.mcap").write_bytes(b"not a log")
    return where


def test_tables_of_a_run_worked_out_by_hand(log: Path):
    tables = replayers.read(log).tables
    assert tables.runs.loc[0, "cost"] == 11.0
    assert tables.runs.loc[0, "status"] == "done"
    assert bool(tables.runs.loc[0, "complete"])
    assert list(tables.decisions["decision"]) == [1, 2, 3]
    assert list(tables.decisions["look_first"][:2]) == [TABLE, COUNTER]
    assert pd.isna(tables.decisions["look_first"][2])
    assert tables.decisions["planning_s"].sum() == pytest.approx(0.006)
    assert list(tables.observations["container"]) == [FRIDGE, TABLE, COUNTER]
    assert list(tables.observations["item_types"][1]) == ["Plate", "Bread", "Bowl"]
    assert list(tables.beliefs["probability"]) == [0.4, 0.6, 0.9]
    assert list(tables.beliefs["container"]) == [COUNTER, TABLE, COUNTER]
    assert list(tables.find_costs["cost"]) == [9.25, 9.25]
    assert list(tables.plans["action"]) == ["find", "find", "pick", "move"]
    assert list(tables.actions["cost"]) == [1.0, 0.0, 3.0, 0.0, 5.0, 2.0]
    assert tables.actions["cost"].sum() == tables.runs.loc[0, "own_cost"]
    assert tables.actions["start"][0] == pd.Timestamp(T0, tz="UTC")
    assert len(tables.poses) > 10
    assert list(tables.poses.columns) == SCHEMAS["poses"].names


def test_every_column_has_its_type_and_its_description(log: Path):
    tables = replayers.read(log).tables
    for name, schema in SCHEMAS.items():
        table = tables.arrow(name)
        assert table.schema.names == schema.names
        assert table.schema.types == schema.types
        assert all((field.metadata or {}).get(b"doc") for field in table.schema)
        frame = getattr(tables, name)
        assert list(frame.columns) == schema.names
        for field in schema:
            if str(field.type).startswith("timestamp"):
                assert str(frame[field.name].dtype) == "datetime64[ns, UTC]"
    assert tables.runs["strategy"].dtype == "category"
    assert str(tables.actions["index"].dtype) == "Int64"


def test_a_frame_is_what_arrow_itself_would_make_of_the_table(log: Path):
    """Missing values, empty tables and texts included; only categories without a word are text and not objects."""
    types = {pa.string(): pd.StringDtype("pyarrow"), pa.int64(): pd.Int64Dtype(), pa.bool_(): pd.BooleanDtype()}
    whole, killed = replayers.read(log).tables, replayers.read(killed_toy_log(log.with_name("k.mcap"))).tables
    for tables in (whole, killed):
        for name in SCHEMAS:
            frame, table = getattr(tables, name), tables.arrow(name)
            theirs = table.to_pandas(types_mapper=types.get, use_threads=False)
            empty = [n for n in table.column_names if pa.types.is_dictionary(table.schema.field(n).type)
                     and not len(theirs[n].cat.categories)]  # fmt: skip
            pd.testing.assert_frame_equal(frame.drop(columns=empty), theirs.drop(columns=empty))
            assert all(str(frame[n].cat.categories.dtype) == "str" and frame[n].isna().all() for n in empty)
    assert killed.runs["status"].isna().all()


def test_a_notebook_shows_a_run_and_its_tables_in_one_line(folder: Path):
    run = replayers.read(next(iter(sorted(folder.rglob("*.mcap")))))
    many = replayers.read_many([run.path])
    assert repr(run).startswith(f"<Run {run.path}: ")
    assert repr(many) == f"<Tables of 1 log: {', '.join(SCHEMAS)}>"
    assert repr(run.tables) == repr(many)
    assert max(len(repr(run)), len(repr(many))) < 400


def test_columns_of_a_frame_can_be_changed(log: Path):
    actions = replayers.read(log).tables.actions
    actions.loc[0, "cost"] = 7.0
    actions.loc[0, "index"] = pd.NA
    assert actions["cost"][0] == 7.0
    assert actions["index"].isna().sum() == 1


def test_stamps_keep_every_nanosecond(tmp_path: Path):
    info = toy_info(started=type(toy_info().started).of(T0 + 123_456_789))
    with RunRecorder(tmp_path / "a.mcap", **(toy_options() | {"info": info})):
        pass
    assert replayers.read(tmp_path / "a.mcap").tables.runs["started"][0].value == T0 + 123_456_789


def test_one_log_read_whole_or_lazily_gives_the_same_tables(log: Path):
    whole, lazy = replayers.read(log).tables, replayers.read_many(log)
    for name in SCHEMAS:
        pd.testing.assert_frame_equal(getattr(whole, name), getattr(lazy, name))


def test_many_logs_and_a_bad_one(folder: Path):
    tables = replayers.read_many(folder)
    assert list(tables.runs["run_id"]) == ["run0", "run1", "0123456789ab"]
    assert list(tables.runs["complete"]) == [True, True, False]
    assert tables.actions.groupby("run_id", observed=True)["cost"].sum()["run1"] == 11.0
    assert len(tables.problems) == 1
    assert "broken.mcap" in tables.problems[0].path
    merged = tables.decisions.merge(tables.runs, on="run_id")
    assert len(merged) == 3 + 3 + 1 or len(merged) == 3 + 3 + 2


def test_patterns_folders_and_files_find_the_same(folder: Path):
    whole = {str(source.log) for source in replayers.read_many(folder).sources}
    assert {str(s.log) for s in replayers.read_many(str(folder / "**")).sources} == whole
    assert len(replayers.read_many(str(folder / "*" / "run.mcap")).sources) == 2
    with pytest.raises(NoLogs):
        replayers.read_many(folder / "nothing*")


def test_no_runs_give_empty_tables_with_all_columns():
    for name, schema in SCHEMAS.items():
        assert list(getattr(Tables([]), name).columns) == schema.names


def test_duckdb_and_pandas_read_the_export(folder: Path, tmp_path: Path):
    out = tmp_path / "tables"
    assert cli.run(["export", str(folder), "-o", str(out)]) == 3, "broken.mcap was left out"
    (cost,) = duckdb.sql(f"select sum(cost) from '{out}/actions.parquet' where run_id = 'run0'").fetchall()[0]
    assert cost == 11.0
    frame = pd.read_parquet(out / "observations.parquet")
    assert list(frame["item_types"][1]) == ["Plate", "Bread", "Bowl"]
    schema = pq.read_schema(out / "actions.parquet")
    assert schema.field("travel_m").metadata[b"doc"] == b"metres walked"


def test_a_partitioned_export_is_one_data_set(folder: Path, tmp_path: Path):
    out = tmp_path / "tables"
    assert cli.run(["export", str(folder), "-o", str(out), "--partition-by", "strategy,run_id", "-t", "actions"]) == 3
    assert (out / "actions" / "strategy=opt-greedy" / "run_id=run1").is_dir()
    rows = duckdb.sql(
        f"select strategy, count(*) n from read_parquet('{out}/actions/**/*.parquet', hive_partitioning=true) "
        "group by strategy order by strategy"
    ).fetchall()
    assert [name for name, _ in rows] == ["model-lios", "opt-greedy"]
    assert rows[1][1] == 6


def test_csv_holds_lists_as_json(log: Path, tmp_path: Path):
    out = tmp_path / "csv"
    assert cli.run(["export", str(log), "-o", str(out), "--format", "csv", "-t", "observations", "-t", "runs"]) == 0
    frame = pd.read_csv(out / "observations.csv")
    assert json.loads(frame["items"][0]) == ["Egg|1", "Tomato|1", "Apple|1"]
    assert {p.name for p in out.iterdir()} == {"observations.csv", "runs.csv"}


def test_an_export_replaces_nothing_unless_forced(log: Path, tmp_path: Path):
    out = tmp_path / "tables"
    out.mkdir()
    (out / "mine.txt").write_text("x")
    assert cli.run(["export", str(log), "-o", str(out)]) == 2
    assert (out / "mine.txt").exists()
    assert cli.run(["export", str(log), "-o", str(out), "--force"]) == 0
    assert (out / "mine.txt").read_text() == "x", "only tables are replaced"
    assert len(list(out.iterdir())) == 1 + len(SCHEMAS)
    assert cli.run(["export", str(log), "-o", str(out / "mine.txt"), "--force"]) == 2
    assert (out / "mine.txt").read_text() == "x"


def test_a_row_of_the_list_comes_from_the_index(log: Path):
    row = row_of(log)
    assert (row.place, row.scenario, row.strategy, row.status, row.cost) == (
        "toy",
        "find",
        "model-lios",
        "done",
        11.0,
    )
    assert row.duration_s == 15.0
    assert row.closed
    assert row.started_ns == T0
    assert row.duration_s * NANO == 15 * NANO


def test_a_list_is_remembered_until_a_log_changes(folder: Path, capsys: pytest.CaptureFixture[str]):
    from replayers.log_tools import info as describe
    from replayers.log_tools import listing

    memory = cache_path(folder)
    paths = sorted(folder.rglob("*.mcap"))
    first = rows_of(paths, memory=memory)
    read: list[Path] = []

    def told(new):
        for path in new:
            read.append(path)
            yield path

    assert rows_of(paths, memory=memory, progress=told) == first
    assert read == []
    write_toy_log(folder / "broken.mcap", force=True)
    again = rows_of(paths, memory=memory, progress=told)
    assert read == [folder / "broken.mcap"]
    assert [row.problem for row in again] == ["", "", "", "cut off: its end is missing"]
    assert listing.row_of is row_of
    assert describe.describe is not None


def test_the_list_command_filters_and_sorts(folder: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.run(["list", str(folder), "--json", "--strategy", "opt-greedy"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["run_id"] == "run1"
    assert cli.run(["list", str(folder), "--json", "--sort", "cost"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [r["cost"] for r in rows] == [11.0, 11.0, None, None]
    assert cli.run(["list", str(folder)]) == 0
    assert "2 with a problem" in capsys.readouterr().err


def test_info_tells_of_logs_that_are_whole_and_of_those_that_are_not(
    log: Path, folder: Path, capsys: pytest.CaptureFixture[str]
):
    assert cli.run(["info", str(log), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["closed"]
    assert told["run"]["strategy"] == "model-lios"
    assert told["outcome"]["status"] == "done"
    assert {c["topic"]: c["messages"] for c in told["channels"]}["/search/plan"] == 3
    assert told["duration_s"] == 15.0
    assert cli.run(["info", str(folder / "killed.mcap")]) == 0
    assert "not closed" in capsys.readouterr().out
    assert cli.run(["info", str(folder / "broken.mcap")]) == 2


def test_what_an_undecided_replay_had_spent_is_not_listed_as_its_cost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = Path(__file__).resolve().parents[2] / "logs"
    words = ["replay", str(logs / "find-conditioned-lios.mcap"), "-s", "opt-greedy,conditioned-lios"]
    assert cli.run([*words, "-o", str(tmp_path)]) == 0
    capsys.readouterr()
    assert cli.run(["list", str(tmp_path), "--json"]) == 0
    listed = {row["strategy"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert (listed["opt-greedy"]["status"], listed["opt-greedy"]["cost"]) == ("undetermined", None)
    assert listed["conditioned-lios"]["cost"] == pytest.approx(30.95, abs=0.01)
