"""Strategies compared world by world over replays."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from sample_logs import toy_place
from toy import BED, COUNTER, DESK, TABLE
from toy_logs import InOrder, simulated_log
from toy_replays import kept

import replayers
from replayers.batch.compare import (
    _difference_bounds,
    answers_compatible,
    changed_houses,
    compare,
    cost_difference,
    runs_once,
)
from replayers.batch.replay_rows import pair_rows
from replayers.batch.store import (
    write_replay,
)
from replayers.counterfactual.results import Assignment, WorldGroup
from workbench.cli import run as lios
from workbench.log_schema.place import house_sha256
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START


def test_by_hand_a_difference_in_the_same_world(tmp_path: Path) -> None:
    """Bed first: 17 or, without a mug there, 6 + 6 + 3 + 5 + 2 = 22 by table and counter. Desk first: 7 + 5 + 7 = 19
    or 7 + 6 + 3 + 5 + 2 = 23. The difference is 17 - 19, 17 - 23, 22 - 19 or 22 - 23."""
    a = kept(InOrder((BED, TABLE, COUNTER), name="bed"), tmp_path)
    b = kept(InOrder((DESK, TABLE, COUNTER), name="desk"), tmp_path)
    apart = cost_difference(a, b)
    assert apart.paired
    assert (apart.least, apart.most) == (-6.0, 3.0)
    assert apart.verdict == "undecided"
    assert apart.chance is not None


def test_worlds_are_matched_so_that_common_luck_cancels(tmp_path: Path) -> None:
    """Both look into the bed first; without a mug there, one goes on to the counter, the other to the table first.
    Bounds side by side would say undecided: 17 to 19 against 17 to 22. In the same world the first is never worse."""
    a = kept(InOrder((BED, COUNTER), name="a"), tmp_path)
    b = kept(InOrder((BED, TABLE, COUNTER), name="b"), tmp_path)
    assert a.bounds is not None
    assert b.bounds is not None
    assert (a.bounds.lower, a.bounds.upper) == (17.0, 19.0)
    assert (b.bounds.lower, b.bounds.upper) == (17.0, 22.0)
    apart = cost_difference(a, b)
    assert (apart.least, apart.most) == (-3.0, 0.0)
    alone = cost_difference(msgspec.structs.replace(a, groups=()), b)
    assert not alone.paired
    assert (alone.least, alone.most) == (-5.0, 2.0)


def test_bounds_of_a_difference_are_those_over_all_pairs_of_groups() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        ends = np.sort(rng.integers(0, 30, (9, 2)).astype(np.float64), axis=1).tolist()
        groups = [WorldGroup(filled=(), least=least, most=most) for least, most in ends]
        a, b = groups[:4], groups[4:]
        together = rng.random((4, 5)) < 0.4
        together[0, 0] = True
        pairs = [(a[i], b[j]) for i, j in zip(*np.nonzero(together), strict=True)]
        expected = min(x.least - y.most for x, y in pairs), max(x.most - y.least for x, y in pairs)
        assert _difference_bounds(a, b, together) == expected


def test_rows_pair_the_strategies_of_each_log_and_no_others(tmp_path: Path) -> None:
    a = kept(InOrder((BED, COUNTER), name="a"), tmp_path)
    b, c = (kept(InOrder((BED, TABLE, COUNTER), name=name), tmp_path) for name in "bc")
    elsewhere = [msgspec.structs.replace(r, sha256="another", log="another.mcap") for r in (a, b)]
    rows = pair_rows([a, elsewhere[0], b, elsewhere[1], c])
    within = [(a.log, "a", "b"), (a.log, "a", "c"), (a.log, "b", "c")]
    assert [(row["log"], row["a"], row["b"]) for row in rows] == [*within, ("another.mcap", "a", "b")]
    for row, (x, y) in zip(rows, [(a, b), (a, c), (b, c), elsewhere], strict=True):
        apart = cost_difference(x, y)
        assert (row["difference_lower"], row["difference_upper"]) == (apart.least, apart.most)


def test_answers_agree_when_no_type_that_mattered_to_both_differs() -> None:
    def told(live: str, answer: str) -> Assignment:
        return Assignment(container="x", live=tuple(live), answer=tuple(answer))

    assert answers_compatible(told("ab", "a"), told("ab", "a"))
    assert not answers_compatible(told("ab", "a"), told("ab", ""))
    assert answers_compatible(told("a", "a"), told("b", "b"))
    assert not answers_compatible(told("ab", "ab"), told("b", ""))
    assert not answers_compatible(told("a", "aa"), told("a", "a"))


def test_pairs_count_certain_wins_and_cluster_by_house(tmp_path: Path) -> None:
    quick = kept(InOrder((TABLE, COUNTER), name="quick"), tmp_path)
    slow = kept(InOrder((BED, DESK, TABLE, COUNTER), name="slow"), tmp_path)
    elsewhere = [msgspec.structs.replace(r, sha256="2", place_sha256="changed") for r in (quick, slow)]
    pairs = compare([quick, slow, *elsewhere], rng=np.random.default_rng(0))
    assert len(pairs) == 1
    assert (pairs[0].a, pairs[0].b, pairs[0].logs, pairs[0].houses) == ("quick", "slow", 2, 2)
    assert (pairs[0].wins, pairs[0].undecided, pairs[0].loses) == (2, 0, 0)
    assert (pairs[0].least, pairs[0].most) == (-13.0, -6.0)
    assert pairs[0].drawn is not None
    assert pairs[0].drawn.clusters == 2
    assert changed_houses([quick, *elsewhere]) == ("toy",)
    assert changed_houses([quick, slow]) == ()


def test_a_robot_that_starts_elsewhere_is_in_the_same_house() -> None:
    place, metres = toy_place(), toy_place().travel.metres.copy()
    first = place.travel.index(START)
    metres[first] += 1.0
    metres[:, first] += 1.0
    metres[first, first] = 0.0
    from_there = replace(
        place,
        plan=replace(place.plan, start=Pose(x_m=7.0, y_m=7.0)),
        travel=replace(place.travel, metres=metres),
        standing={**place.standing, START: Pose(x_m=7.0, y_m=7.0)},
    )
    assert house_sha256(from_there) == house_sha256(place)
    metres[first - 1, first - 2] += 1.0
    assert house_sha256(replace(place, travel=replace(place.travel, metres=metres))) != house_sha256(place)


def test_parts_of_one_run_are_no_six_logs(tmp_path: Path) -> None:
    whole = kept(InOrder((TABLE, COUNTER), name="quick"), tmp_path)
    other = msgspec.structs.replace(whole, sha256="other", run_id="other")
    assert whole.bounds is not None
    less = replace(whole.bounds, lower=whole.bounds.lower - 1)
    parts = [msgspec.structs.replace(whole, sha256=f"part {k}", log=f"p{k}.mcap", bounds=less) for k in range(5)]
    records, several = runs_once([whole, *parts, other])
    assert records == (other,)
    assert [(s.run_id, len(s.logs), s.kept) for s in several] == [(whole.run_id, 6, None)]
    copies = [msgspec.structs.replace(whole, sha256=f"copy {k}", log=f"c{k}.mcap") for k in range(3)]
    records, several = runs_once([whole, *copies, other])
    assert records == (whole, other)
    assert [s.kept for s in several] == [whole.log]
    assert runs_once([whole, other]) == ((whole, other), ())


def test_a_whole_log_counts_beside_copies_that_lack_something(tmp_path: Path) -> None:
    whole = kept(InOrder((TABLE, COUNTER), name="quick"), tmp_path)
    assert whole.bounds is not None
    less = replace(whole.bounds, lower=whole.bounds.lower - 1)
    as_whole = msgspec.structs.replace(whole, log="runs/whole.mcap", complete_log=True, lost=())
    cut = msgspec.structs.replace(as_whole, sha256="cut", log="runs/cut.mcap", bounds=less, complete_log=False)
    last = msgspec.structs.replace(as_whole, sha256="last", log="runs/last.mcap", lost=("2 actions",))
    records, (run,) = runs_once([cut, as_whole, last])
    assert records == (as_whole,)
    assert run.kept == as_whole.log
    assert dict(run.incomplete) == {"runs/cut.mcap": "its end is missing", "runs/last.mcap": "2 actions"}
    assert run.words == (
        "cut.mcap is of the run that whole.mcap holds whole (its end is missing); "
        "last.mcap is of the run that whole.mcap holds whole (2 actions)"
    )
    records, (run,) = runs_once([cut, last])
    assert records == ()
    assert run.kept is None
    assert run.words == "cut.mcap, last.mcap are of one run and say different things, as parts of a split log do"
    copy = msgspec.structs.replace(as_whole, sha256="copy", log="runs/copy.mcap")
    assert runs_once([cut, as_whole, copy])[0] == (as_whole,)
    unlike = msgspec.structs.replace(copy, bounds=less)
    assert runs_once([cut, as_whole, unlike])[0] == (), "two logs that claim to be whole contradict each other"


def test_a_cut_off_copy_takes_no_trial_away(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = simulated_log(tmp_path / "logs" / "run.mcap")
    whole = log.read_bytes()
    (tmp_path / "logs" / "cut.mcap").write_bytes(whole[: int(len(whole) * 0.4)])
    made = str(tmp_path / "made")
    few = ["-s", "opt-greedy,pes-greedy", "--worlds", "0"]
    assert lios(["select", str(log.parent), *few, "-o", made, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [group["logs"] for group in answer["groups"]] == [[str(log)]]
    (left_out,) = answer["left_out"]
    assert left_out.startswith("cut.mcap is of the run that run.mcap holds whole (it was cut off inside a record")
    assert lios(["compare", made, "--json"]) == 0
    (run,) = json.loads(capsys.readouterr().out)["runs_in_several_logs"]
    assert (run["kept"], [one["log"] for one in run["incomplete"]]) == (str(log), [str(log.parent / "cut.mcap")])


def test_logs_of_one_place_draw_logs_and_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "kept"
    for planner in (InOrder((TABLE, COUNTER), name="quick"), InOrder((BED, DESK, TABLE, COUNTER), name="slow")):
        first = kept(planner, tmp_path)
        for k in range(3):
            shifted = tuple(cost + k * (planner.name == "slow") for cost in first.drawn)
            record = msgspec.structs.replace(first, sha256=f"{k}", run_id=f"run{k}", drawn=shifted)
            write_replay(folder / f"{k}" / f"{planner.name}.replay.json", record)
    assert lios(["compare", str(folder), "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["logs"], row["houses"], row["drawn_ci95_resamples"]) == (3, 1, "logs of one house")
    low, high = row["drawn_ci95"]
    assert low < row["drawn_difference"] - 1 < row["drawn_difference"] + 1 < high  # all logs lie within 1
    assert lios(["compare", str(folder)]) == 0
    assert "resample logs of one house" in capsys.readouterr().err
    for k in (1, 2):
        for path in (folder / f"{k}").iterdir():
            path.unlink()
    assert lios(["compare", str(folder), "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert (row["drawn_ci95"], row["drawn_ci95_resamples"]) == (None, "nothing")
    assert lios(["compare", str(folder)]) == 0
    assert "no interval" in capsys.readouterr().err


def test_parts_of_a_split_run_are_refused_with_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from replayers.batch.split_runs import parts_of_one_run

    log = simulated_log(tmp_path / "run.mcap")
    (tmp_path / "parts").mkdir()
    assert lios(["log", "split", str(log), "-o", str(tmp_path / "parts" / "run.mcap"), "--every", "5"]) == 0
    capsys.readouterr()
    parts = sorted((tmp_path / "parts").glob("*.mcap"))
    assert len(parts) > 1
    assert parts_of_one_run([log, *parts]) == dict.fromkeys(parts, tuple(parts))
    assert parts_of_one_run([log, parts[0]]) == {}
    (tmp_path / "parts" / "bad.mcap").write_bytes(b"no log")
    assert parts_of_one_run(sorted((tmp_path / "parts").glob("*.mcap"))) == dict.fromkeys(parts, tuple(parts))
    (tmp_path / "parts" / "bad.mcap").unlink()
    assert lios(["replay", str(tmp_path / "parts"), "-s", "opt-greedy"]) == 2
    assert "lios log merge" in capsys.readouterr().err
    assert lios(["replay", str(log), str(tmp_path / "parts"), "-s", "opt-greedy", "--json"]) == 0
    captured = capsys.readouterr()
    status = {Path(row["log"]): row["status"] for row in json.loads(captured.out)["rows"]}
    assert {path for path, how in status.items() if how == "not-replayed"} == set(parts)
    assert captured.err.count("one of") == len(parts)


def test_a_strategy_with_another_estimator_is_another_strategy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quick = kept(InOrder((TABLE, COUNTER), name="quick"), tmp_path)
    slow = kept(InOrder((BED, DESK, TABLE, COUNTER), name="slow"), tmp_path)
    replays = [
        msgspec.structs.replace(r, sha256=log, log=f"{log}.mcap", run_id=log, estimator=estimator)
        for log, estimator in (("one", "counts@1a"), ("two", "best@2b"), ("three", "best@2b"))
        for r in (quick, slow)
    ]
    for r in replays:
        write_replay(tmp_path / "kept" / r.sha256 / f"{r.strategy}.replay.json", r)
    both = [("quick by best", "slow by best", 2), ("quick by counts", "slow by counts", 1)]
    assert sorted((p.a, p.b, p.logs) for p in replayers.compare(replays)) == both
    claim = ["--fail-if", "slow by best < quick by best by bounds"]
    assert lios(["compare", str(tmp_path / "kept"), "--json", *claim]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert sorted((row["a"], row["b"], row["logs"]) for row in shown["rows"]) == both
    alike = [msgspec.structs.replace(r, estimator="best@2b") for r in replays]
    assert [(p.a, p.b, p.logs) for p in replayers.compare(alike)] == [("quick", "slow", 3)]
