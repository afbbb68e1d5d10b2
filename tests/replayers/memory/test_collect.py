"""Histories of places from logs, what is refused of them, and runs and replays that remember."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from sample_logs import T0, write_toy_log
from toy import COUNTER, TABLE

from recorders.record_run import record
from replayers.batch.verify import verify
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.log_tools.notes import add_note
from replayers.memory.collect import LogsContradict, NoLooks, history_of, read_history
from replayers.runs.run import Run, read
from workbench.beliefs.memory.history import AnotherPlace, ContainersChanged
from workbench.beliefs.memory.memory import NoEarlierRun
from workbench.beliefs.memory.move_rates import NS_PER_DAY, shipped_rates
from workbench.cli import run as lios
from workbench.errors import Malformed
from workbench.log_schema.corrections import Correction
from workbench.log_schema.events import SeenItem, Stamp
from workbench.log_schema.memory_json import memory_from_settings, memory_to_settings
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType

MUG, NOWHERE = ItemType("Mug"), ContainerId("nowhere")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs on two days, which looked for other things."""
    made = tmp_path_factory.mktemp("earlier")
    for day, item in enumerate(("apple", "book")):
        record(made / f"{item}.mcap", find=item, strategy="conditioned-lios", estimator="counts", day=day)
    return made


def toy_run(folder: Path) -> Run:
    return read(write_toy_log(folder / "toy.mcap"))


def later(run: Run, days: float, run_id: str = "later") -> Run:
    """The same run, some days later."""
    by = round(days * NS_PER_DAY)

    def moved(event):  # type: ignore[no-untyped-def]
        return msgspec.structs.replace(event, stamp=Stamp.of(event.stamp.ns + by))

    return replace(
        run,
        info=msgspec.structs.replace(run.info, run_id=run_id, started=Stamp.of(run.info.started.ns + by)),
        observations=tuple(map(moved, run.observations)),
        actions=tuple(map(moved, run.actions)),
        outcome=None if run.outcome is None else moved(run.outcome),
    )


def test_a_memory_is_in_the_log_whole_and_replays_without_the_folder(folder: Path, tmp_path: Path) -> None:
    earlier = tmp_path / "earlier"
    shutil.copytree(folder, earlier)
    record(tmp_path / "run.mcap", find="apple", strategy="conditioned-lios", estimator="counts", memory=[earlier])
    shutil.rmtree(earlier)
    run = read(tmp_path / "run.mcap")
    memory = memory_from_settings(run.settings)
    assert memory is not None
    assert memory.runs == tuple(sorted(read(p).info.run_id for p in folder.glob("*.mcap")))
    assert run.info.started.ns == read(folder / "apple.mcap").info.started.ns + 2 * NS_PER_DAY
    assert run.info.estimator.startswith("counts@")
    assert run.info.estimator.endswith(memory.digest)
    assert memory_from_settings(memory_to_settings(memory)) == memory
    assert len(run.actions) < len(read(folder / "apple.mcap").actions), "it went straight to the apple"
    assert verify(run).same
    prepared = prepare_log(run, ReplaySettings(worlds=0))
    assert prepared.reproduction.same
    assert prepared.estimator.name == run.info.estimator
    made = replay_on(prepared, "conditioned-lios")
    assert made.exact
    assert run.outcome is not None
    assert made.cost == pytest.approx(run.outcome.cost)


def test_a_log_without_memory_is_replayed_with_one_on_request(folder: Path, tmp_path: Path) -> None:
    record(tmp_path / "run.mcap", find="apple", strategy="conditioned-lios", estimator="counts", day=2)
    run = read(tmp_path / "run.mcap")
    assert memory_from_settings(run.settings) is None
    assert "memory" not in run.settings
    history = read_history([folder])
    plain = replay_on(prepare_log(run, ReplaySettings(worlds=0)), "conditioned-lios")
    prepared = prepare_log(run, ReplaySettings(worlds=0, histories=(history,)))
    remembered = replay_on(prepared, "conditioned-lios")
    assert plain.cost is not None
    assert remembered.cost is not None
    assert remembered.cost < plain.cost
    assert any("does not do what was recorded" in note for note in remembered.notes)
    early = read(folder / "apple.mcap")
    with pytest.raises(NoEarlierRun):
        prepare_log(early, ReplaySettings(worlds=0, histories=(history,)))


def test_the_truth_is_inside_the_bounds_of_every_strategy(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    record(path, find="apple", strategy="opt-greedy", estimator="counts", memory=[folder], moved=0.5, seed=1)
    prepared = prepare_log(read(path, with_truth=True), ReplaySettings(worlds=5, with_truth=True))
    for name in ("opt-greedy", "model-lios", "conditioned-lios"):
        made = replay_on(prepared, name)
        assert made.bounds is not None
        assert made.true_cost is not None
        assert made.bounds.lower - 1e-6 <= made.true_cost <= made.bounds.upper + 1e-6


def test_what_the_robot_carried_is_remembered_of_a_robot_only(tmp_path: Path) -> None:
    run = toy_run(tmp_path)
    picked = next(a for a in run.actions if a.action == "pick")
    robot = replace(run, info=msgspec.structs.replace(run.info, source="spot"))
    simulated = [look for look in history_of([run]).looks if look.changed]
    carried = [look for look in history_of([robot]).looks if look.changed]
    assert simulated == []
    assert carried[0].container == picked.target
    assert set(picked.items[0].split("|")[:1]).isdisjoint(carried[0].item_types)


def test_another_place_and_changed_containers_are_refused_in_one_line(tmp_path: Path) -> None:
    history = history_of([toy_run(tmp_path)])
    plan, at = history.plan, history.runs[0].ended_ns
    fewer = replace(plan, containers=plan.containers[1:])
    table = replace(plan.containers[2], pose=replace(plan.containers[2].pose, x_m=3.5))
    moved = replace(plan, containers=(*plan.containers[:2], table, *plan.containers[3:]))
    for other, error, words in (
        (replace(fewer, name="elsewhere"), AnotherPlace, "not of elsewhere"),
        (fewer, ContainersChanged, "is gone"),
        (moved, ContainersChanged, "was moved by 1.5 m"),
    ):
        with pytest.raises(error, match=words) as refused:
            history.memory_at(at, other, shipped_rates())
        assert "\n" not in str(refused.value)
    assert history.memory_at(at, replace(plan, name="renamed"), shipped_rates()).looks
    with pytest.raises(NoEarlierRun):
        history.memory_at(T0, plan, shipped_rates())


def test_logs_of_one_time_that_differ_are_refused_and_of_two_days_are_not(tmp_path: Path) -> None:
    run = toy_run(tmp_path)
    first = run.observations[0]
    other = msgspec.structs.replace(first, items=(*first.items, SeenItem(id="Vase|9", type="Vase")))
    differs = replace(run, observations=(other, *run.observations[1:]))
    with pytest.raises(LogsContradict, match=first.container.split("|")[0]):
        history_of([run, later(differs, 0.0)])
    assert history_of([run, later(run, 0.0)]).runs
    assert len(history_of([run, later(differs, 1.0)]).runs) == 2


def test_the_commands_refuse_a_memory_that_cannot_be_one(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of another place, of no time before the run, and of logs that contradict one another."""
    other, contradicting, made = tmp_path / "other", tmp_path / "contradicting", tmp_path / "x.mcap"
    record(other / "a.mcap", house="houses:3", find="book", strategy="opt-greedy", estimator="counts")
    for name, moved in (("a", 0.0), ("b", 1.0)):
        record(
            contradicting / f"{name}.mcap", find="book", strategy="opt-greedy", memory=[folder], moved=moved, day=1
        )
    run = str(folder / "apple.mcap")
    for words, said in (
        (
            ["record", "--find", "apple", "-o", str(made), "--memory", str(other)],
            "its logs are of houses:3, and none is of houses:0, the place of the run",
        ),
        (["record", "--find", "apple", "-o", str(made), "--memory", str(contradicting)], "they are not of one house"),
        (
            ["replay", run, "-s", "greedy", "--memory", str(other)],
            "its logs are of houses:3, and none is of houses:0, the place of the run",
        ),
        (["replay", run, "-s", "greedy", "--memory", str(folder)], "ended before this run began"),
    ):
        assert lios(words) == 2
        told = capsys.readouterr().err.strip()
        assert said in told
        assert "\n" not in told
    assert not made.exists()


def test_logs_without_looks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NoLooks):
        history_of([replace(toy_run(tmp_path), observations=())], where="here")


def test_a_memory_in_a_log_that_is_none_is_refused(tmp_path: Path) -> None:
    run = toy_run(tmp_path)
    for broken in ({"memory": 3}, {"memory": {"at_ns": 1}}):
        with pytest.raises(Malformed):
            evidence_of(replace(run, settings=broken))
    assert {TABLE, COUNTER} <= {look.container for look in history_of([run]).looks}


def test_what_people_corrected_is_remembered_and_told(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    earlier = tmp_path / "earlier"
    shutil.copytree(folder, earlier)
    log = earlier / "apple.mcap"
    seen = next(o for o in read(log).observations if not o.known_at_start and all(i.type != "Book" for i in o.items))
    before = read_history([earlier])
    assert lios(["log", "note", str(log), "--seen", f"Book|99@{seen.container}", "--author", "Ada"]) == 0
    add_note(log, "wrong", seen=Correction(item=Item(id=ItemId("Mug|9"), type=MUG), container=NOWHERE, stamp_ns=T0))
    after = read_history([earlier])
    assert before.notes == ()
    assert [note.partition(": ")[2].partition(" ")[0] for note in after.notes] == ["a", "Ada"], "left out, and used"
    changed = [(a, b) for a, b in zip(after.looks, before.looks, strict=True) if a != b]
    assert {(a.container, a.corrected) for a, _ in changed} == {(ContainerId(seen.container), (ItemType("Book"),))}
    assert all(set(a.item_types) == {*b.item_types, "Book"} for a, b in changed)
    capsys.readouterr()
    out = tmp_path / "run.mcap"
    said = ["record", "--find", "book", "--estimator", "counts", "--memory", str(earlier), "-o", str(out)]
    assert lios(said) == 0
    assert f"Ada says that Book|99 was in {seen.container}" in capsys.readouterr().err
    memory = memory_from_settings(read(out).settings)
    assert memory is not None
    told = [look.corrected for look in memory.looks if look.container == seen.container]
    remembers_it = memory.by_container[ContainerId(seen.container)].run == read(log).info.run_id
    assert told == [("Book",)] if remembers_it else told == [()]
    assert verify(read(out)).same
    assert lios(["replay", str(out), "-s", "greedy", "--worlds", "0", "--memory", str(earlier)]) == 0
    assert f"Ada says that Book|99 was in {seen.container}" in capsys.readouterr().err


def test_the_command_line_learns_remembers_and_refuses(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rates, out = tmp_path / "rates.csv", tmp_path / "run.mcap"
    assert lios(["learn-moves", str(folder), "-o", str(rates), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["item_type"] for row in rows} >= {"*", "Mug"}
    said = ["record", "--find", "apple", "--estimator", "counts", "-o", str(out)]
    assert lios([*said, "--memory", str(folder), "--rates", str(rates)]) == 0
    assert lios(["replay", str(out), "-s", "model-lios", "--worlds", "0", "--memory", str(folder), "--json"]) == 0
    capsys.readouterr()
    assert lios([*said, "--force", "--rates", str(rates)]) == 2
    assert lios([*said, "--force", "--house", "houses:3", "--memory", str(folder)]) == 2
    assert lios([*said, "--force", "--memory", str(tmp_path / "nowhere")]) == 2
    refused = [line for line in capsys.readouterr().err.splitlines() if line.startswith("lios: ")]
    assert len(refused) == 3


@pytest.fixture(scope="module")
def mixed(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two runs, and beside them one of another place and a file that is no log."""
    made = tmp_path_factory.mktemp("mixed")
    shutil.copytree(folder, made, dirs_exist_ok=True)
    record(made / "z-elsewhere.mcap", house="houses:3", find="book", strategy="opt-greedy", estimator="counts", day=9)
    (made / "z-empty.mcap").touch()
    return made


def test_of_a_folder_the_logs_of_the_run_s_place_are_remembered(
    folder: Path, mixed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The place is the run's, not that of the newest log."""
    run, plain = tmp_path / "run.mcap", tmp_path / "plain.mcap"
    said = ["record", "--find", "apple", "--estimator", "counts"]
    assert lios([*said, "--memory", str(mixed), "-o", str(run)]) == 0
    told = capsys.readouterr().err
    assert told.count("note: not remembered: ") == 2
    assert "note: not remembered: 1 log of houses:3\n" in told
    assert lios([*said, "--memory", str(folder), "-o", str(plain)]) == 0
    assert read(run).settings["memory"] == read(plain).settings["memory"], "other places change neither day nor looks"
    capsys.readouterr()
    assert lios(["replay", str(run), "-s", "greedy", "--worlds", "0", "--memory", str(mixed)]) == 0
    assert "note: not remembered: 1 log of houses:3\n" in capsys.readouterr().err


def test_a_log_of_another_place_that_is_named_is_refused_by_the_run_s_place(
    folder: Path, mixed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere, made = mixed / "z-elsewhere.mcap", str(tmp_path / "x.mcap")
    record(tmp_path / "later.mcap", find="apple", strategy="opt-greedy", estimator="counts", day=10)
    given = ["--memory", str(folder), "--memory", str(elsewhere)]
    for words in (
        ["record", "--find", "apple", "-o", made, *given],
        ["replay", str(tmp_path / "later.mcap"), "-s", "greedy", *given],
    ):
        assert lios(words) == 2
        told = capsys.readouterr().err.strip()
        assert told.startswith(f"lios: {elsewhere}: a log of houses:3, not of houses:0. "), told
        assert "\n" not in told
    assert lios(["learn-moves", str(mixed), "-o", str(tmp_path / "rates.csv")]) == 2
    assert f"lios: {mixed}: logs of several places (houses:0, houses:3). Give only" in capsys.readouterr().err


def test_logs_of_several_places_are_replayed_each_with_its_own_memory(
    mixed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = tmp_path / "logs"
    for number in (0, 3, 5):
        house = f"houses:{number}"
        record(logs / f"{number}.mcap", house=house, find="book", strategy="opt-greedy", estimator="counts", day=11)
    said = ["replay", str(logs), "-s", "greedy", "--worlds", "0", "--json"]
    assert lios([*said, "--memory", str(mixed)]) == 0
    shown = capsys.readouterr()
    rows = {Path(row["log"]).name: row for row in json.loads(shown.out)["rows"]}
    assert [row["status"] == "not-replayed" for _, row in sorted(rows.items())] == [False, False, True]
    assert "houses:5, the place of the run" in rows["5.mcap"]["reason"]
    assert "its logs are of houses:0, houses:3, and none is of houses:5" in shown.err


def test_of_a_log_and_its_copy_that_was_cut_off_the_whole_one_is_remembered(folder: Path, tmp_path: Path) -> None:
    whole = (folder / "apple.mcap").read_bytes()
    (tmp_path / "apple.mcap").write_bytes(whole)
    (tmp_path / "a-cut.mcap").write_bytes(whole[: int(len(whole) * 0.3)])
    with pytest.raises(NoLooks):
        read_history([tmp_path / "a-cut.mcap"])
    assert read_history([tmp_path]).looks == read_history([folder / "apple.mcap"]).looks
