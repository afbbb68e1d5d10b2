"""Filter, merge, split, compact, convert, note, cat: nothing changes but what was requested."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from sample_logs import T0, toy_info, write_toy_log

from recorders.mcap_io.writer import DiskFull, McapWriter
from replayers.doctor.examine import examine
from replayers.doctor.findings import Verdict
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from replayers.tables.frames import read_many
from workbench import cli
from workbench.log_schema.events import NANO
from workbench.log_schema.run_info import info_to_metadata

Facts = tuple[str, int, int, int, bytes]


def _facts(path: Path) -> list[Facts]:
    return [(m.topic, m.log_time, m.publish_time, m.sequence, m.data) for m in messages(path)]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_toy_log(tmp_path / "a.mcap")


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """A log of another writer: an image topic with a schema that nobody here knows, and one without any."""
    path = tmp_path / "foreign.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema("acme/Image", "acme", b"\x00\xffstructure")
        image = writer.register_channel("/camera", "acme", schema, {"calibration": "k"})
        bare = writer.register_channel("/bare", "", 0)
        for i in range(20):
            writer.add_message(image, T0 + i * NANO, bytes([i]) * 1000, T0 + i, sequence=100 + i)
            writer.add_message(bare, T0 + i * NANO, b"\x00", T0, sequence=7)
        writer.add_attachment(1, 2, "picture.png", "image/png", b"\x89PNG")
        writer.add_metadata("acme", {"a": "b"})
        writer.finish()
    return path


def _lios(*args: str | Path) -> int:
    return cli.run([str(arg) for arg in args])


def test_unknown_topics_pass_through_everything_untouched(foreign: Path, tmp_path: Path):
    want = sorted(_facts(foreign))
    assert _lios("log", "filter", foreign, "-o", tmp_path / "f.mcap") == 0
    assert _lios("log", "compact", foreign, "-o", tmp_path / "c.mcap", "--compression", "lz4") == 0
    assert _lios("log", "convert", foreign, "-o", tmp_path / "v.mcap", "--compression", "none") == 0
    assert _lios("recover", foreign, "-o", tmp_path / "r.mcap") == 0
    assert _lios("log", "merge", foreign, "-o", tmp_path / "m.mcap") == 0
    for name in ("f", "c", "v", "r", "m"):
        path = tmp_path / f"{name}.mcap"
        assert sorted(_facts(path)) == want
        with open(path, "rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            (channel,) = {c.metadata["calibration"] for _, c, _ in reader.iter_messages(topics=["/camera"])}
            schemas = {(s.name, s.encoding, s.data) for s, _, _ in reader.iter_messages(topics=["/camera"]) if s}
            assert channel == "k"
            assert schemas == {("acme/Image", "acme", b"\x00\xffstructure")}
            assert [(a.name, a.create_time, a.log_time, a.data) for a in reader.iter_attachments()] == [
                ("picture.png", 1, 2, b"\x89PNG")
            ]
            assert {m.name for m in reader.iter_metadata()} >= {"acme"}


def test_filter_keeps_the_wanted_topics_and_times(log: Path, tmp_path: Path):
    out = tmp_path / "f.mcap"
    assert _lios("log", "filter", log, "-o", out, "-y", "/search/.*", "-n", ".*plan", "-S", "3", "-E", "8") == 0
    want = [
        f for f in _facts(log)
        if f[0].startswith("/search/") and f[0] != "/search/plan" and T0 + 3 * NANO <= f[1] < T0 + 8 * NANO
    ]  # fmt: skip
    assert _facts(out) == want
    assert len(want) > 3
    assert read(out).info == toy_info()


def test_a_topic_expression_must_match_the_whole_name(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert _lios("log", "filter", log, "-o", tmp_path / "f.mcap", "-y", "/search") == 2
    told = capsys.readouterr().err
    assert "no topic '/search'" in told
    assert "/search/plan" in told
    assert not (tmp_path / "f.mcap").exists()


def test_cat_of_topics_that_are_not_there_says_which_are(log: Path, capsys: pytest.CaptureFixture[str]):
    for asked in (("--topics", "/nope"), ("--topics", "/map,/nope"), ("-y", "nope.*"), ("-n", ".*")):
        assert _lios("log", "cat", log, *asked) == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert len(told.err.splitlines()) == 1
        assert "/search/plan" in told.err
    assert _lios("log", "cat", log, "-S", "1000") == 0
    assert "no message there in that time" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["filter", "compact", "convert", "recover", "merge", "split", "lines"])
def test_what_was_there_stays_until_the_new_log_is_whole(
    command: str, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    """Stopped midway, out of room: the old file is as it was, and nothing half-written lies about."""
    output = tmp_path / "out" / ("old.jsonl" if command == "lines" else "old.mcap")
    old = output.with_name("old_0000.mcap") if command == "split" else output
    output.parent.mkdir()
    old.write_text("precious")
    words = ["recover"] if command == "recover" else ["log", "convert" if command == "lines" else command]
    words += [str(log), "-o", str(output), "--force", *(["--every", "4"] if command == "split" else [])]

    def full(*_: object, **__: object) -> bytes:
        raise DiskFull(log, "no space left") if command != "lines" else OSError(28, "no space left")

    target = (
        "replayers.log_tools.decode_message.MessageDecoder.line"
        if command == "lines"
        else "recorders.mcap_io.writer.McapWriter.close"
    )
    with monkeypatch.context() as patch:
        patch.setattr(target, full)
        assert _lios(*words) == 2
    told = capsys.readouterr().err
    assert "not written (no space left)" in told
    assert len(told.splitlines()) == 1
    with monkeypatch.context() as patch:
        patch.setattr(target, _interrupted)
        assert _lios(*words) == 1
    assert old.read_text() == "precious"
    assert list(output.parent.iterdir()) == [old]
    assert _lios(*words) == 0
    assert old.read_bytes() != b"precious"


def _interrupted(*_: object, **__: object) -> bytes:
    raise KeyboardInterrupt


def test_a_folder_is_no_output(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    for name in ("a.jsonl", "b.mcap"):
        (tmp_path / name).mkdir()
        assert _lios("log", "convert", log, "-o", tmp_path / name, "--force") == 2
        assert "it is a folder" in capsys.readouterr().err
    assert _lios("log", "convert", log, "-o", log, "--force") == 2
    assert _lios("log", "convert", log, "-o", tmp_path / "no" / "such" / "a.jsonl") == 0


def test_names_that_are_no_utf_8_do_no_harm(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    odd = Path(os.fsdecode(os.fsencode(tmp_path) + b"/odd\xff.mcap"))
    log.rename(odd)
    for words in (["info"], ["doctor"], ["list"], ["log", "note"]):
        assert _lios(*words, odd, "--json") == 0, words
        assert "odd\ufffd.mcap" in capsys.readouterr().out
    assert _lios("recover", odd) == 0
    assert _lios("log", "split", odd, "-o", odd, "--every", "5") == 0
    assert _lios("export", odd, "-o", tmp_path / "tables") == 0
    assert read_many(odd).runs["path"][0].endswith("odd\ufffd.mcap")


def test_only_files_can_be_logs_and_no_log_is_merged_with_itself(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    os.mkfifo(tmp_path / "fifo.mcap")
    assert _lios("info", tmp_path / "fifo.mcap") == 2
    assert "not a regular file" in capsys.readouterr().err
    (tmp_path / "link.mcap").symlink_to(log)
    assert _lios("log", "merge", log, tmp_path / "link.mcap", "-o", tmp_path / "m.mcap") == 2
    assert "given once" in capsys.readouterr().err
    (tmp_path / "mine.mcap").write_text("mine")
    assert _lios("recover", log, "-o", tmp_path / "new" / ".." / "mine.mcap") == 2
    assert (tmp_path / "mine.mcap").read_text() == "mine"


@pytest.mark.parametrize("command", ["doctor", "recover", "export", "merge"])
def test_long_work_shows_how_far_it_is_on_a_terminal_only(
    command: str, log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    words = [*(["log", command] if command == "merge" else [command]), str(log)]
    words += ["-o", str(tmp_path / "out")] if command != "doctor" else []
    assert _lios(*words) == 0
    assert "\x1b[" not in capsys.readouterr().err
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    assert _lios(*words, *(["--force"] if command != "doctor" else [])) == 0
    told = capsys.readouterr()
    assert command in told.err
    assert "\x1b[" in told.err


def test_a_split_log_merges_to_itself(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert _lios("log", "split", log, "-o", tmp_path / "p" / "part.mcap", "--every", "4") == 0
    parts = sorted((tmp_path / "p").glob("*.mcap"))
    assert len(parts) == 4
    for part in parts:
        assert read(part).place.plan == read(log).place.plan
        assert {"/map", "/viz/scene"} <= {m.topic for m in messages(part)}
        assert examine(part).verdict is Verdict.FINE
    assert _lios("log", "merge", *parts, "-o", tmp_path / "m.mcap") == 0
    assert "repeats of them in other logs were not written again" in capsys.readouterr().err
    assert sorted(_facts(tmp_path / "m.mcap")) == sorted(_facts(log))
    assert examine(tmp_path / "m.mcap").verdict is Verdict.FINE


@pytest.mark.parametrize("way", [("--every", "8"), ("--by", "run")])
def test_a_split_into_fewer_parts_leaves_none_of_the_others(log: Path, tmp_path: Path, way: tuple[str, str]):
    output = tmp_path / "p" / "part.mcap"
    assert _lios("log", "split", log, "-o", output, "--every", "1") == 0
    before = len(list(output.parent.iterdir()))
    assert _lios("log", "split", log, "-o", output, *way, "--force") == 0
    assert len(list(output.parent.iterdir())) < before
    assert _lios("log", "merge", *sorted(output.parent.iterdir()), "-o", tmp_path / "m.mcap") == 0
    assert sorted(_facts(tmp_path / "m.mcap")) == sorted(_facts(log))


def test_a_part_is_not_split_over_itself(log: Path, tmp_path: Path):
    output = tmp_path / "p" / "part.mcap"
    assert _lios("log", "split", log, "-o", output, "--every", "4") == 0
    there = {path: path.read_bytes() for path in output.parent.iterdir()}
    assert _lios("log", "split", output.with_name("part_0003.mcap"), "-o", output, "--every", "4", "--force") == 2
    assert {path: path.read_bytes() for path in output.parent.iterdir()} == there


def test_merge_orders_by_time_and_refuses_two_runs(log: Path, foreign: Path, tmp_path: Path):
    assert _lios("log", "merge", log, foreign, "-o", tmp_path / "m.mcap") == 0
    stamps = [m.log_time for m in messages(tmp_path / "m.mcap")]
    assert stamps == sorted(stamps)
    assert len(stamps) == len(_facts(log)) + len(_facts(foreign))
    assert read(tmp_path / "m.mcap").info == toy_info()
    other = write_toy_log(tmp_path / "b.mcap", settings={"x": 1})
    assert _lios("log", "merge", log, other, "-o", tmp_path / "n.mcap") == 2
    assert not (tmp_path / "n.mcap").exists()


def test_compact_makes_few_chunks_of_many(log: Path, tmp_path: Path):
    assert _lios("log", "compact", log, "-o", tmp_path / "c.mcap") == 0
    with open(log, "rb") as a, open(tmp_path / "c.mcap", "rb") as b:
        before, after = (make_reader(stream).get_summary() for stream in (a, b))
    assert before is not None
    assert after is not None
    assert len(before.chunk_indexes) >= 4
    assert len(after.chunk_indexes) == 1
    assert (tmp_path / "c.mcap").stat().st_size < log.stat().st_size
    assert read(tmp_path / "c.mcap").plans == read(log).plans


def test_convert_to_lines_decodes_every_message(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert _lios("log", "convert", log, "-o", tmp_path / "a.jsonl") == 0
    lines = [json.loads(line) for line in (tmp_path / "a.jsonl").read_text().splitlines()]
    assert len(lines) == len(_facts(log))
    (outcome,) = [line["data"] for line in lines if line["topic"] == "/search/outcome"]
    assert outcome["cost"] == 11.0
    pose = next(line["data"] for line in lines if line["topic"] == "/robot/pose")
    assert pose["pose"]["position"]["x"] == 1.0
    assert _lios("log", "convert", log, "-o", tmp_path / "a.bag") == 2
    assert "only .mcap and .jsonl" in capsys.readouterr().err


def test_cat_prints_what_is_asked_for(log: Path, foreign: Path, capsys: pytest.CaptureFixture[str]):
    assert _lios("log", "cat", log, "--topics", "/search/outcome", "--json") == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line)["data"]["status"] == "done"
    assert _lios("log", "cat", foreign, "--limit", "3") == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert '{"bytes":1000}' in lines[0]


def test_damage_is_told_and_exits_with_3(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    with open(log, "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    data = bytearray(log.read_bytes())
    data[summary.chunk_indexes[2].chunk_start_offset + 60] ^= 0xFF
    log.write_bytes(data)
    assert _lios("log", "filter", log, "-o", tmp_path / "f.mcap") == 3
    assert "Something was lost" in capsys.readouterr().err
    assert _lios("doctor", log, "--json") == 1
    examined = json.loads(capsys.readouterr().out)
    assert examined["verdict"] == "faulty"
    assert set(examined["findings"][0]) == {"level", "where", "what", "fix"}
    assert _lios("recover", log, "-o", tmp_path / "r.mcap", "--json") == 3
    answer = json.loads(capsys.readouterr().out)
    assert answer["lossy"]
    assert answer["messages_lost"] > 0
    assert _lios("doctor", tmp_path / "r.mcap") == 3


@pytest.mark.parametrize(
    "args",
    [
        ["log", "filter", "{log}", "-o", "{log}", "--force"],
        ["log", "filter", "{log}", "-o", "{tmp}/x.mcap", "-y", "("],
        ["log", "filter", "{log}", "-o", "{tmp}/x.mcap", "-S", "noon"],
        ["log", "filter", "{log}", "-o", "{tmp}/x.mcap", "-S", "5", "-E", "4"],
        ["log", "filter", "{log}", "-o", "{tmp}/x.mcap", "--compression", "zip"],
        ["log", "filter", "{tmp}/none.mcap", "-o", "{tmp}/x.mcap"],
        ["log", "split", "{log}", "-o", "{tmp}/x.mcap"],
        ["log", "split", "{log}", "-o", "{tmp}/x.mcap", "--every", "0"],
        ["log", "cat", "{tmp}"],
        ["info", "{tmp}/none.mcap"],
        ["list", "{tmp}/none"],
        ["list", "{tmp}", "--sort", "beauty"],
        ["doctor", "{tmp}/none.mcap"],
        ["recover", "{log}", "-o", "{log}"],
        ["export", "{log}", "-o", "{tmp}/t", "-t", "feelings"],
        ["export", "{log}", "-o", "{tmp}/t", "--format", "xml"],
        ["export", "{log}", "-o", "{tmp}/t", "--partition-by", "cost"],
    ],
)
def test_bad_usage_is_one_line_exit_2_and_leaves_nothing(
    args: list[str], log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    before = log.read_bytes()
    assert _lios(*(arg.format(log=log, tmp=tmp_path) for arg in args)) == 2
    assert "Traceback" not in capsys.readouterr().err
    assert {p.name for p in tmp_path.iterdir()} == {"a.mcap"}
    assert log.read_bytes() == before


LIES: dict[str, tuple[dict[str, str], dict[str, str], list[tuple[str, str, bytes, int]]]] = {
    "numbers that are none": ({}, {"cost": "a lot", "searches": "1e5", "status": "[red]"}, []),
    "numbers beyond 64 bits": ({"started": "9" * 40, "seed": "9" * 40}, {"cost": "1e400"}, []),
    "messages that are none": (
        {},
        {},
        [
            ("/search/plan", "json", b'{"x":1}', 2**64 - 1),
            ("/robot/pose", "protobuf", b"\xff\xff", 0),
            ("/notes", "protobuf", b"\xff\xff", 1),
            ("/search/plan", "protobuf", b"\x00", 5),
            ("a\x1b[31m\ntopic", "cdr", b"\x00", 7),
        ],
    ),
}


@pytest.mark.parametrize("name", LIES)
def test_logs_that_lie_are_answered_in_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    info, outcome, told = LIES[name]
    log = tmp_path / "lie.mcap"
    with McapWriter(log) as writer:
        writer.add_metadata(
            "lios.run", {k: v for k, v in (info_to_metadata(toy_info()) | info).items() if k != "crc32"}
        )
        writer.add_metadata("lios.outcome", outcome)
        for attachment in ("place.json", "task.json", "settings.json"):
            writer.add_attachment(attachment, "application/json", b"\xff[", log_time=0)
        for topic, encoding, data, stamp in told:
            writer.add_message(writer.add_channel(topic, encoding, 0), data, log_time=stamp)
    out = tmp_path / "out"
    for words in (
        ["info", log], ["info", log, "--json"], ["doctor", log], ["recover", log, "-o", out / "r.mcap"],
        ["log", "cat", log], ["log", "note", log], ["log", "convert", log, "-o", out / "c.jsonl"],
        ["log", "split", log, "-o", out / "s.mcap", "--every", "1"], ["log", "merge", log, "-o", out / "m.mcap"],
        ["list", log, "--json"], ["list", log], ["export", log, "-o", out / "t"],
    ):  # fmt: skip
        _lios(*words)
        assert "should not happen" not in capsys.readouterr().err, words


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("command", ["export", "compact", "split"])
def test_a_disk_with_no_room_at_all_is_told_in_one_line_and_left_clean(
    command: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    program = (
        "import resource, signal, sys; from workbench import cli; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4, 4)); sys.exit(cli.run(sys.argv[1:]))"
    )
    (tmp_path / "out").mkdir()
    args = {
        "export": ["export", str(log), "-o", str(tmp_path / "out" / "tables")],
        "compact": ["log", "compact", str(log), "-o", str(tmp_path / "out" / "a.mcap")],
        "split": ["log", "split", str(log), "-o", str(tmp_path / "out" / "a.mcap"), "--by", "run"],
    }[command]
    ended = subprocess.run([sys.executable, "-c", program, *args], capture_output=True, text=True)
    assert ended.returncode == 2
    assert len(ended.stderr.strip().splitlines()) == 1
    assert "File too large" in ended.stderr
    assert ".part" not in ended.stderr
    assert not list((tmp_path / "out").iterdir())
