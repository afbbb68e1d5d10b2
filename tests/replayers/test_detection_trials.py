"""What counts as a trial of detection, by hand, and what the trials of logs come to."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi
from pathlib import Path

import msgspec
import pytest
from mcap.writer import Writer
from toy import BED, COUNTER, TABLE
from toy_logs import MUG, acted, seen, toy_run

from recorders.record_run import record
from replayers.evaluation.detection_trials import LOOK, PASSING, DetectionTrial, PlantedItem, detection_trials
from replayers.evaluation.perception import detection_rates
from replayers.mcap_io.poses import poses_in
from replayers.runs.run import Run, read
from workbench.cli import run as lios
from workbench.log_schema.corrections import Correction, made_up_id
from workbench.log_schema.events import NANO
from workbench.worlds.house import ContainerId, Item, ItemId

LOGS = Path(__file__).resolve().parents[2] / "logs"


def with_looks(folder: Path, *shown: tuple[str, tuple[str, ...]], **options: object) -> Run:
    """The toy run with these looks, a second apart, and no actions."""
    looks = tuple(seen(container, *items, s=s + 1) for s, (container, items) in enumerate(shown))
    return replace(toy_run(folder), observations=looks, actions=(), **options)  # type: ignore[arg-type]


def detected(run: Run, **options: object) -> list[bool]:
    return [trial.detected for trial in detection_trials(run, **options)]  # type: ignore[arg-type]


def test_the_look_that_first_shows_an_item_does_not_count(tmp_path: Path) -> None:
    """Missed, found, found, missed: the first two looks tell that it is there, the last two count."""
    run = with_looks(tmp_path, (TABLE, ()), (TABLE, ("Mug|1",)), (TABLE, ("Mug|1",)), (TABLE, ()), (COUNTER, ()))
    assert detected(run) == [True, False]
    (trial, _) = detection_trials(run)
    assert (trial.made, trial.detector, trial.item_type) == (LOOK, "simulation", "Mug")
    assert trial.angle_rad == pytest.approx(0.0), "it stands where one stands"


def test_what_is_planted_or_true_counts_in_every_look(tmp_path: Path) -> None:
    run = with_looks(tmp_path, (TABLE, ()), (TABLE, ("Mug|1",)), (BED, ()))
    assert detected(run, planted=(PlantedItem(item="Mug|1", container=TABLE),)) == [False, True]
    assert detected(run, checked=True) == [False, True]
    assert detected(run) == []


def test_a_correction_counts_from_its_moment_or_with_the_word_that_all_was_checked(tmp_path: Path) -> None:
    table = ContainerId(TABLE)
    item = Item(id=made_up_id(MUG, table), type=MUG)
    run = with_looks(tmp_path, (TABLE, ()), (TABLE, ()), (TABLE, ("Mug|1",)))
    moment = run.observations[0].stamp.ns
    run = replace(run, corrections=(Correction(item=item, container=table, stamp_ns=moment),))
    assert detected(run) == [False, True], "the look that it is about is not a fair one"
    assert detected(run, checked=True) == [False, False, True], "the mug that was found later is the one meant"


def test_nothing_is_expected_of_an_item_that_was_taken(tmp_path: Path) -> None:
    run = with_looks(tmp_path, (TABLE, ("Mug|1",)), (TABLE, ("Mug|1",)), (TABLE, ()))
    run = replace(run, actions=(msgspec.structs.replace(acted("pick", TABLE, "Mug|1", s=2), index=1),))
    assert detected(run) == [True]


def test_by_hand_the_posterior() -> None:
    """Three of four: Beta(4, 2), whose mean is 4/6; its 2.5 % quantile, by the binomial tail, is 0.2836."""
    trial = DetectionTrial(
        log="a", made=LOOK, detector="d", item_type="Mug", container_type="Desk", range_m=1.0, angle_rad=pi / 2,
        detected=True,
    )  # fmt: skip
    rates = detection_rates([trial, trial, trial, replace(trial, detected=False, range_m=None, angle_rad=None)])
    by = {(rate.by, rate.group): rate for rate in rates}
    looks = by["made", "look"]
    assert (looks.trials, looks.detected, looks.p_detect) == (4, 3, pytest.approx(4 / 6))
    assert looks.ci95[0] == pytest.approx(0.2836, abs=1e-4)
    assert by["range", "1.0 to 1.5 m"].trials == by["angle", "90 to 180 degrees"].trials == 3
    assert detection_rates([]) == ()


def test_a_robot_detects_all_within_three_metres_and_nothing_beyond() -> None:
    """As its simulator does: the law is found again in the log, looks and what it passed."""
    trials = list(detection_trials(read(LOGS / "spot-home-A-pes-greedy.mcap", with_truth=True)))
    assert {trial.made for trial in trials} == {LOOK, PASSING}
    ranges = [(trial.range_m, trial.detected) for trial in trials if trial.range_m is not None]
    assert len(ranges) == len(trials) > 15
    assert all(found == (range_m < 3.0) for range_m, found in ranges if abs(range_m - 3.0) > 0.2)
    assert {found for _, found in ranges} == {True, False}


def _without_polls(folder: Path) -> Path:
    """A robot's log as earlier versions wrote it: without the times at which the robot was asked for tags."""
    log = folder / "earlier.mcap"
    assert (
        lios(["log", "filter", str(LOGS / "spot-home-A-pes-greedy.mcap"), "-n", "/robot/tag_polls", "-o", str(log)])
        == 0
    )
    return log


def _with_polls(folder: Path, *, counts: bool, localized: bool) -> Run:
    """A robot's run in which it was asked for tags at every pose, whether it saw any or not."""
    before, polls, both = _without_polls(folder), folder / "polls.mcap", folder / "both.mcap"
    with polls.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "/robot/tag_polls", "json", writer.register_schema("lios.spot.TagPoll", "jsonschema", b"{}")
        )
        for stamp_ns, _ in poses_in(read(before).raw_poses):
            stamp = {"sec": stamp_ns // NANO, "nsec": stamp_ns % NANO}
            poll = {"stamp": stamp, "detector": "robot", "counts": counts, "localized": localized, "tags": []}
            writer.add_message(channel, stamp_ns, json.dumps(poll).encode(), stamp_ns)
        writer.finish()
    assert lios(["log", "merge", str(before), str(polls), "-o", str(both)]) == 0
    return read(both, with_truth=True)


def test_viewpoints_at_which_no_tag_was_seen_count_where_the_log_has_polls(tmp_path: Path) -> None:
    """Logs of earlier versions say only when some tag was seen: there the rate is too high."""
    (tmp_path / "before").mkdir()
    before = list(detection_trials(read(_without_polls(tmp_path / "before"), with_truth=True)))
    after = list(detection_trials(_with_polls(tmp_path, counts=True, localized=True)))
    seen = [sum(t.detected for t in trials if t.made == PASSING) for trials in (before, after)]
    unseen = [sum(not t.detected for t in trials if t.made == PASSING) for trials in (before, after)]
    assert seen[0] <= seen[1]
    assert unseen[0] < unseen[1]


@pytest.mark.parametrize(("counts", "localized"), [(False, True), (True, False)])
def test_polls_by_another_detector_or_of_a_robot_that_is_lost_say_nothing(
    counts: bool, localized: bool, tmp_path: Path
) -> None:
    trials = detection_trials(_with_polls(tmp_path, counts=counts, localized=localized))
    assert {trial.made for trial in trials} == {LOOK}


@pytest.mark.slow
def test_a_simulations_miss_rate_is_found_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for seed in range(8):
        record(tmp_path / f"{seed}.mcap", find="mug", estimator="counts", seed=seed, house="houses:9",
                   strategy="robust-lios", miss_rate=0.4)  # fmt: skip
    assert lios(["evaluate", "perception", str(tmp_path), "--with-truth", "--json"]) == 0
    rows = {(r["by"], r["group"]): r for r in json.loads(capsys.readouterr().out)["rows"]}
    low, high = rows["made", "look"]["ci95"]
    assert low < 0.6 < high


def test_the_command_says_what_it_needs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = str(LOGS / "find-lios.mcap")
    for words, said in (
        ([], "no look of 1 log can be judged"),
        (["--planted", "mug"], "ITEM@CONTAINER"),
        (["--planted", "mug@attic"], "no container 'attic'"),
        (["--by", "colour"], "--by"),
    ):
        assert lios(["evaluate", "perception", log, *words]) == 2
        told = capsys.readouterr()
        assert said in told.err
        assert told.err.count("\n") == 1
    assert lios(["evaluate", "perception", log, "--with-truth", "--by", "made"]) == 0
    told = capsys.readouterr()
    assert "look" in told.out
    assert "detector: {p_detect: 0.9" in told.err
    (tmp_path / "junk.mcap").write_bytes(b"hello")
    assert lios(["evaluate", "perception", log, str(tmp_path / "junk.mcap"), "--with-truth", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["skipped"]) == 1


@pytest.mark.parametrize("topic", ["/robot/detections", "/robot/tag_polls"])
@pytest.mark.parametrize("data", [b'{"stamp": 3}', b'{"stamp": {"sec": 1}}', b"[", b'{"item": "\xff"}'])
def test_a_detection_that_is_none_is_told_and_its_log_left_out(
    topic: str, data: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, odd, both = LOGS / "spot-home-A.mcap", tmp_path / "odd.mcap", tmp_path / "both.mcap"
    with odd.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("lios.spot.TagDetected", "jsonschema", b"{}")
        channel = writer.register_channel(topic, "json", schema)
        at = read(robot).info.started.ns + 1
        writer.add_message(channel, at, data, at)
        writer.finish()
    assert lios(["log", "merge", str(robot), str(odd), "-o", str(both)]) == 0
    capsys.readouterr()
    assert lios(["evaluate", "perception", str(LOGS / "find-lios.mcap"), str(both), "--with-truth", "--json"]) == 0
    (skipped,) = json.loads(capsys.readouterr().out)["skipped"]
    assert f"{topic} cannot be decoded" in skipped
    assert str(both) in skipped


def test_ids_made_up_for_a_type_are_no_items_of_the_log() -> None:
    assert made_up_id(MUG, ContainerId(TABLE)) == ItemId(f"Mug|seen|{TABLE}")


def test_copies_of_a_run_count_once_and_parts_of_it_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A copy without cameras, and one of the same bytes; and the same run in parts, whose trials are its own."""
    log = LOGS / "spot-home-A.mcap"

    def judged(*logs: Path) -> tuple[list[object], dict[str, str]]:
        capsys.readouterr()
        assert lios(["evaluate", "perception", *map(str, logs), "--with-truth", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        return answer["rows"], answer["copies"]

    alone, none = judged(log)
    same, copy = tmp_path / "same.mcap", tmp_path / "copy.mcap"
    same.write_bytes(log.read_bytes())
    assert lios(["log", "filter", str(log), "-n", "/camera/.*", "-o", str(copy)]) == 0
    assert none == {}
    assert judged(log, same, copy) == (alone, {str(same): str(log), str(copy): str(log)})
    assert judged(copy, LOGS / "spot-home-B.mcap")[1] == {}
