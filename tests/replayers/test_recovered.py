"""A copy of a cut-off log says that only its end is lost, and leads to the same conclusions as the cut log itself."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from damaged_logs import chunks_of, flip

from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.doctor.examine import examine
from replayers.doctor.findings import Level, Verdict
from replayers.log_tools.copy_log import LogLayout
from replayers.log_tools.recover import recover
from replayers.log_tools.recovered import RECOVERED_METADATA, Lost, Recovered
from replayers.log_tools.rewrite import MessageFilter, filtered, merge_logs, patterns, split_log
from replayers.mcap_io.reader import metadata
from replayers.runs.gaps import gaps_of
from replayers.runs.run import read
from workbench import cli
from workbench.errors import LiosError

LOGS = Path(__file__).parents[2] / "logs"
STYLE = LogLayout(force=True)


def _recovered(cut: Path, out: Path) -> Path:
    recover(cut, out, force=True)
    return out


def _filtered(cut: Path, out: Path) -> Path:
    filtered(cut, out, MessageFilter(), STYLE)
    return out


def _compacted(cut: Path, out: Path) -> Path:
    filtered(cut, out, MessageFilter(), replace(STYLE, chunk_bytes=4 << 20, kept_bytes=(1 << 20, 16 << 20)))
    return out


def _merged(cut: Path, out: Path) -> Path:
    merge_logs([cut], out, STYLE)
    return out


def _split_and_merged(cut: Path, out: Path) -> Path:
    parts = split_log(cut, out.with_name("part.mcap"), STYLE, part_s=20).outputs
    merge_logs(parts, out, STYLE)
    return out


def _split_by_run(cut: Path, out: Path) -> Path:
    merge_logs([cut], out.with_name("runs.mcap"), STYLE, several_runs=True)
    return split_log(out.with_name("runs.mcap"), out, STYLE, by_run=True).outputs[0]


def _split_recovered_and_merged(cut: Path, out: Path) -> Path:
    parts = split_log(cut, out.with_name("part.mcap"), STYLE, part_s=20).outputs
    saved = [_recovered(part, part.with_name(f"saved-{part.name}")) for part in parts]
    merge_logs(saved, out, STYLE)
    return out


COPIES = [_recovered, _filtered, _compacted, _merged, _split_and_merged, _split_by_run, _split_recovered_and_merged]


def _cut(name: str, size: int, folder: Path) -> Path:
    path = folder / "cut.mcap"
    path.write_bytes((LOGS / f"{name}.mcap").read_bytes()[:size])
    return path


def _found(log: Path) -> Evidence | str:
    try:
        return evidence_of(read(log))
    except LiosError as error:
        return type(error).__name__


def _same(one: Evidence | str, other: Evidence | str) -> bool:
    if isinstance(one, str) or isinstance(other, str):
        return one == other
    names = ("gaps", "known", "contents", "refused_searches", "left", "static_beliefs", "first_belief", "looks")
    notes = other.complete or one.notes == other.notes
    return notes and all(getattr(one, name) == getattr(other, name) for name in names)


@pytest.mark.parametrize("name", ["find-conditioned-lios", pytest.param("deliver-3", marks=pytest.mark.ci)])
def test_a_log_cut_anywhere_and_its_copies_lead_to_the_same_conclusions(name: str, tmp_path: Path):
    size = (LOGS / f"{name}.mcap").stat().st_size
    for cut in range(51_001, size, 23_003):
        log = _cut(name, cut, tmp_path)
        direct = _found(log)
        assert isinstance(direct, Evidence)
        assert direct.gaps.lost == ()
        for copy in COPIES:
            assert _same(direct, _found(copy(log, tmp_path / "copy.mcap"))), (cut, copy.__name__)
        saved = _recovered(log, tmp_path / "saved.mcap")
        for copy in COPIES:
            assert _same(direct, _found(copy(saved, tmp_path / "copy.mcap"))), (cut, f"{copy.__name__} of recovered")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["breakfast", "find-greedy", "spot-home-B"])
def test_a_log_cut_at_any_of_its_records_and_its_copies_lead_to_the_same_conclusions(name: str, tmp_path: Path):
    ends = [chunk.chunk_start_offset + chunk.chunk_length for chunk in chunks_of(LOGS / f"{name}.mcap")]
    for cut in sorted({end + more for end in ends for more in (-3, 0, 5)}):
        log = _cut(name, cut, tmp_path)
        direct = _found(log)
        for copy in (_recovered, _filtered, _split_recovered_and_merged):
            assert _same(direct, _found(copy(log, tmp_path / "copy.mcap"))), (cut, copy.__name__)


def test_bounds_export_list_and_doctor_are_those_of_the_cut_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log = _cut("find-lios", 60_000, tmp_path)
    saved = _recovered(log, tmp_path / "saved.mcap")

    def told(*words: str) -> tuple[int, str]:
        return cli.run([*words]), capsys.readouterr().out

    code, text = told("replay", str(log), "-s", "opt-greedy", "--json")
    code_of_copy, text_of_copy = told("replay", str(saved), "-s", "opt-greedy", "--json")
    rows = [json.loads(one)["rows"][0] for one in (text, text_of_copy)]
    assert code == code_of_copy == 3
    for name in ("status", "lower", "upper", "estimate", "exact", "notes"):
        assert rows[0][name] == rows[1][name], name
    said = [row["lost"][0].partition(": ")[2] for row in rows]
    assert said[0] == said[1] == f"what came {Lost.END}, at byte 56791, is lost"
    listed = [json.loads(told("list", str(one), "--json")[1])["rows"][0] for one in (log, saved)]
    for name in ("status", "cost", "searches", "cut_off"):
        assert listed[0][name] == listed[1][name], name
    assert all(row["lost"] and row["cut_off"] for row in listed)
    codes = [told("export", str(one), "-o", str(tmp_path / f"{one.stem}-tables"))[0] for one in (log, saved)]
    assert codes == [3, 3]
    assert {examine(one).verdict for one in (log, saved)} == {Verdict.LOSSY}
    (loss,) = [finding for finding in examine(saved).findings if finding.level is Level.LOSS]
    at = next(finding.where for finding in examine(log).findings if finding.level is Level.LOSS)
    assert f"what came {Lost.END}, at {at}, is lost" in loss.what


@pytest.mark.parametrize("topic", ["/search/action", "/search/observation"])
def test_what_is_left_out_of_a_copy_of_a_cut_log_is_still_noticed(topic: str, tmp_path: Path):
    saved = _recovered(_cut("deliver-3", 120_000, tmp_path), tmp_path / "saved.mcap")
    assert gaps_of(read(saved)).lost == ()
    run = read(saved)
    last = max(event.stamp.ns for event in (run.actions if topic == "/search/action" else run.observations))
    for wanted in (MessageFilter(exclude=patterns([topic], "-n")), MessageFilter(end_ns=last)):
        filtered(saved, tmp_path / "less.mcap", wanted, STYLE)
        assert gaps_of(read(tmp_path / "less.mcap")).lost != ()


def test_a_camera_log_that_was_cut_off_says_nothing_of_the_run_beside_it(tmp_path: Path):
    """A run that was filtered to its first seconds has no outcome, and its end was not cut off."""
    run = read(LOGS / "deliver-3.mcap")
    half = MessageFilter(end_ns=run.actions[len(run.actions) // 2].stamp.ns)
    filtered(LOGS / "deliver-3.mcap", tmp_path / "half.mcap", half, STYLE)
    camera = tmp_path / "camera.mcap"
    only = MessageFilter(include=patterns(["/robot/.*"], "-y"), attachments=False, metadata=False)
    filtered(LOGS / "deliver-3.mcap", camera, only, replace(STYLE, chunk_bytes=2000))
    camera.write_bytes(camera.read_bytes()[: camera.stat().st_size // 2])
    lost = gaps_of(read(tmp_path / "half.mcap")).lost
    assert lost
    merge_logs([tmp_path / "half.mcap", camera], tmp_path / "both.mcap", STYLE)
    assert gaps_of(read(tmp_path / "both.mcap")).lost == lost
    assert metadata(tmp_path / "both.mcap", RECOVERED_METADATA)


def test_a_part_that_was_cut_off_before_the_last_one_lost_something_in_the_middle(tmp_path: Path):
    parts = split_log(LOGS / "deliver-3.mcap", tmp_path / "part.mcap", STYLE, part_s=40).outputs
    assert len(parts) > 2
    parts[1].write_bytes(parts[1].read_bytes()[: parts[1].stat().st_size * 2 // 3])
    saved = [_recovered(part, part.with_name(f"saved-{part.name}")) for part in parts]
    for given in (parts, saved):
        merge_logs(given, tmp_path / "all.mcap", STYLE)
        run = read(tmp_path / "all.mcap")
        assert run.recovered is not None
        assert run.recovered.lost is Lost.MIDDLE
        assert gaps_of(run).lost != ()


@pytest.mark.parametrize("given", [(2,), (2, 5), (0, 1, 2, 3, 4, 6), (1, 2, 3, 4, 5, 6), (0, 3, 6)])
def test_parts_that_are_missing_are_told_and_nothing_rests_on_them(
    given: tuple[int, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    whole = evidence_of(read(LOGS / "breakfast.mcap"))
    parts = split_log(LOGS / "breakfast.mcap", tmp_path / "part.mcap", STYLE, part_s=20).outputs
    assert len(parts) == 7
    missing = [number for number in range(max(given)) if number not in given]
    code = cli.run(["log", "merge", *(str(parts[n]) for n in given), "-o", str(tmp_path / "some.mcap"), "--json"])
    assert code == 3
    assert json.loads(capsys.readouterr().out)["parts_missing"] == missing
    run = read(tmp_path / "some.mcap")
    assert any("without part" in line for line in gaps_of(run).lost)
    assert examine(tmp_path / "some.mcap").verdict is not Verdict.FINE
    found = _found(tmp_path / "some.mcap")
    if isinstance(found, Evidence):
        assert all(whole.contents[container] == items for container, items in found.contents.items())
        again = _found(_recovered(tmp_path / "some.mcap", tmp_path / "again.mcap"))
        assert _same(found, again)


@pytest.mark.parametrize("copy", [_recovered, _filtered, _merged])
def test_a_loss_in_the_middle_stays_one_through_copies_of_copies(copy: Callable[[Path, Path], Path], tmp_path: Path):
    damaged = flip(LOGS / "deliver-3.mcap", tmp_path / "damaged.mcap", 9)
    direct = _found(damaged)
    once = copy(damaged, tmp_path / "once.mcap")
    twice = _recovered(once, tmp_path / "twice.mcap")
    for log in (once, twice):
        found = read(log)
        assert found.recovered is not None
        assert found.recovered.lost is Lost.MIDDLE
        assert examine(log).verdict is Verdict.LOSSY
        evidence = _found(log)
        assert isinstance(direct, Evidence)
        assert isinstance(evidence, Evidence)
        assert evidence.contents == direct.contents
        assert evidence.gaps.lost != ()


def test_zeros_at_the_end_as_after_a_power_cut_are_a_cut(tmp_path: Path):
    chunk = chunks_of(LOGS / "deliver-3.mcap")[15]
    log = _cut("deliver-3", chunk.chunk_start_offset + chunk.chunk_length, tmp_path)
    direct = _found(log)
    log.write_bytes(log.read_bytes() + bytes(50_000))
    assert _same(direct, _found(log))
    assert _same(direct, _found(_recovered(log, tmp_path / "saved.mcap")))
    assert examine(log).verdict is Verdict.LOSSY


def test_the_record_survives_being_written_and_read():
    record = Recovered(
        source="a.mcap", lost=Lost.END, lost_at=7, damages=1, messages=12, expected=13, kept={"/search/action": 3}
    )
    assert Recovered.from_facts(record.to_facts()) == record
    old = Recovered.from_facts({"from": "a.mcap", "damages": "2", "messages": "5", "lossy": "true"})
    assert (old.lost, old.damages, old.messages) == (Lost.MIDDLE, 2, 5)
    assert Recovered.from_facts({"lossy": "false"}).lost is Lost.UNKNOWN
    assert Recovered.from_facts({"lost": "somewhere", "kept": "[1]", "lost_at": "-3"}).lost is Lost.UNKNOWN
