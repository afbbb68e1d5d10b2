"""Commands over logs at addresses: the same answers as over local files, few bytes, and one line for each trouble."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from large_log import write_large_log
from sample_logs import write_toy_log
from web_server import WebServer, web_server

from replayers import read
from workbench.cli import run

pytest.importorskip("fsspec")
pytest.importorskip("aiohttp")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    (tmp_path / "runs").mkdir()
    return write_toy_log(tmp_path / "runs" / "toy.mcap")


def answer(capsys: pytest.CaptureFixture[str], *args: str) -> Any:
    assert run([*args, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def refusal(capsys: pytest.CaptureFixture[str], *args: str) -> str:
    assert run(list(args)) == 2
    said = capsys.readouterr().err.strip()
    assert said.startswith("lios: ")
    assert "\n" not in said
    return said


def test_info_and_doctor_say_what_they_say_of_the_file(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with web_server(log.parent) as server:
        address = f"{server.address}/toy.mcap"
        for command in ("info", "doctor"):
            here, there = answer(capsys, command, str(log)), answer(capsys, command, address)
            assert there.pop("file") == address
            here.pop("file")
            assert there == here


def test_info_of_a_large_log_reads_little(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    size = 10**9
    write_large_log(tmp_path / "large.mcap", size)
    with web_server(tmp_path) as server:
        told = answer(capsys, "info", f"{server.address}/large.mcap")
        assert told["size_bytes"] >= size
        assert told["indexed"]
        assert told["outcome"]["cost"] == "1.5"
        assert server.bytes_sent <= 2_000_000
        assert server.requests <= 6


def test_list_asks_for_many_logs_at_once(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(60):
        shutil.copy(log, log.with_name(f"{number:02d}.mcap"))
    with web_server(log.parent) as server:
        server.held_until = 12
        rows = answer(capsys, "list", server.address)["rows"]
        assert [row["status"] for row in rows] == ["done"] * 61
        assert server.most_at_once >= 12
        assert server.requests <= 61 * 8 + 5


@pytest.mark.slow
def test_list_of_a_thousand_logs_is_bound_by_latency(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(999):
        (log.parent / f"{number:03d}.mcap").symlink_to(log)
    with web_server(log.parent) as server:
        server.held_until = 32
        rows = answer(capsys, "list", server.address)["rows"]
        assert len(rows) == 1000
        assert server.most_at_once >= 32
        # Each reads its index, metadata and what it lost.
        assert server.requests <= 1000 * 8 + 5


def test_folders_and_patterns(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    deep = log.parent / "deep"
    deep.mkdir()
    shutil.copy(log, deep / "other.mcap")
    (deep / "notes.txt").write_text("no log", encoding="utf-8")
    with web_server(log.parent) as server:
        both = [row["file"] for row in answer(capsys, "list", server.address)["rows"]]
        assert both == [f"{server.address}/deep/other.mcap", f"{server.address}/toy.mcap"]
        top = [row["file"] for row in answer(capsys, "list", f"{server.address}/*.mcap")["rows"]]
        assert top == [f"{server.address}/toy.mcap"]


def test_replay_gives_the_figures_of_the_file(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    args = ("--strategies", "pes-greedy", "--worlds", "4", "--in-process")
    here = answer(capsys, "replay", str(log), *args)
    with web_server(log.parent) as server:
        there = answer(capsys, "replay", f"{server.address}/toy.mcap", *args)
    for row in (*here["rows"], *there["rows"]):
        row.pop("log")
        for name in [name for name in row if name.endswith(("seconds", "_s"))]:
            row.pop(name)
    assert there["rows"] == here["rows"]


def test_tables_and_copies_of_a_remote_log_are_made_here(log: Path, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    with web_server(log.parent) as server:
        address = f"{server.address}/toy.mcap"
        assert run(["export", address, "-o", "runs.csv", "--table", "runs"]) == 0
        assert address in Path("runs.csv").read_text(encoding="utf-8")
        assert run(["recover", address]) == 0
        assert Path("toy.recovered.mcap").exists()
        assert run(["log", "filter", address, "-o", "small.mcap", "-n", "/log"]) == 0
        assert run(["log", "merge", address, "-o", "merged.mcap"]) == 0


def test_each_trouble_of_a_server_is_one_line(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with web_server(log.parent) as server:
        address = f"{server.address}/toy.mcap"
        assert "no such file" in refusal(capsys, "info", f"{server.address}/other.mcap")
        assert "no such file" in refusal(capsys, "replay", f"{server.address}/other.mcap")
        for trouble, words in _troubles(server):
            for name, value in trouble.items():
                setattr(server, name, value)
            for command in ("info", "doctor", "replay", "view", "export", "log cat"):
                extra = ("-o", str(log.with_name("made"))) if command == "export" else ()
                assert words in refusal(capsys, *command.split(), address, *extra), (command, trouble)
            server.ranges, server.breaks_at, server.status = True, None, None
    assert "cannot be reached" in refusal(capsys, "info", "http://127.0.0.1:1/toy.mcap")


def _troubles(server: WebServer) -> list[tuple[dict[str, Any], str]]:
    return [
        ({"ranges": False}, "does not support range requests"),
        ({"breaks_at": 8}, "broke off"),
        ({"status": 403}, "credentials"),
        ({"status": 500}, "cannot be reached"),
    ]


def test_what_is_written_goes_to_a_local_file(capsys: pytest.CaptureFixture[str]) -> None:
    written = ("record", "--find", "mug", "-o", "s3://bucket/run.mcap")
    for args in (written, ("log", "note", "s3://bucket/run.mcap", "words")):
        assert "must be a local path" in refusal(capsys, *args)
    assert "s3://a//b" in refusal(capsys, "info", "s3://a//b.mcap")
    assert "no such protocol" in refusal(capsys, "info", "nothing-of-the-kind://a/b.mcap")


def test_store_from_upload_to_reading(
    log: Path, bucket: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "no log there" in refusal(capsys, "list", bucket)
    assert "no such file" in refusal(capsys, "info", f"{bucket}/none.mcap")
    assert "no log there" in refusal(capsys, "list", "s3://there-is-no-such-bucket/")
    assert answer(capsys, "upload", str(log), f"{bucket}/day/")["copies"] == [f"{bucket}/day/toy.mcap"]
    assert "exists" in refusal(capsys, "upload", str(log), f"{bucket}/day/")
    assert run(["upload", str(log), f"{bucket}/day/", "--force"]) == 0
    assert [row["status"] for row in answer(capsys, "list", bucket)["rows"]] == ["done"]
    assert [row["status"] for row in answer(capsys, "list", f"{bucket}/**/*.mcap")["rows"]] == ["done"]
    there, here = answer(capsys, "info", f"{bucket}/day/toy.mcap"), answer(capsys, "info", str(log))
    assert there["metadata"] == here["metadata"]
    assert read(f"{bucket}/day/toy.mcap").sha256 == read(log).sha256


@pytest.mark.slow
def test_google_store_from_upload_to_reading(
    log: Path, google_bucket: str, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    assert "no log there" in refusal(capsys, "list", google_bucket)
    assert "no such file" in refusal(capsys, "info", f"{google_bucket}/none.mcap")
    assert "no log there" in refusal(capsys, "list", "gs://there-is-no-such-bucket/")
    assert answer(capsys, "upload", str(log), f"{google_bucket}/day/")["copies"] == [f"{google_bucket}/day/toy.mcap"]
    assert "exists" in refusal(capsys, "upload", str(log), f"{google_bucket}/day/")
    assert [row["status"] for row in answer(capsys, "list", google_bucket)["rows"]] == ["done"]
    assert [row["status"] for row in answer(capsys, "list", f"{google_bucket}/**/*.mcap")["rows"]] == ["done"]
    assert read(f"{google_bucket}/day/toy.mcap").sha256 == read(log).sha256
    assert not [record for record in caplog.records if record.name == "gcsfs"], "it prints lines of its own"


def test_folder_of_replays_in_a_store_is_compared(
    log: Path, bucket: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "replays"
    args = ("--strategies", "pes-greedy,opt-greedy", "--worlds", "2", "-o", str(kept), "--upload", f"{bucket}/kept")
    assert run(["replay", str(log), *args]) == 0
    capsys.readouterr()
    here, there = answer(capsys, "compare", str(kept)), answer(capsys, "compare", f"{bucket}/kept")
    assert here == there


def test_missing_credentials_are_said(
    log: Path, bucket: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import s3fs

    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    monkeypatch.setenv("HOME", str(log.parent))
    s3fs.S3FileSystem.clear_instance_cache()
    assert "credentials" in refusal(capsys, "info", f"{bucket}/toy.mcap")
    assert "credentials" in refusal(capsys, "upload", str(log), f"{bucket}/x/")
