"""Recorders killed at random moments: nothing that was flushed is lost, and recovery makes a clean log of it.

LIOS_KILLS sets how many kills the slow test makes; 1,000 by default.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from killed_writer import payload, said_file

from replayers.doctor.examine import Examination, examine
from replayers.doctor.findings import Level
from replayers.log_tools.recover import recover
from replayers.mcap_io.reader import messages

WRITER = Path(__file__).with_name("killed_writer.py")
KINDS = ("direct", "background", "run")


class Writers:
    """Starts writers and kills them. One process that forks, asked by one thread at a time."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(WRITER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self._lock = threading.Lock()

    def killed(self, path: Path, kind: str, seed: int) -> int:
        """Runs a writer and kills it at a random moment; returns how many messages it had said are safe."""
        said, wait_s = said_file(path), random.Random(seed).random() * 0.15
        with self._lock:
            assert self._process.stdin is not None
            assert self._process.stdout is not None
            self._process.stdin.write(f"{path} {kind} {seed}\n")
            pid = int(self._process.stdout.readline())
        until = time.monotonic() + 60
        while not (said.exists() and said.stat().st_size):
            assert time.monotonic() < until, "the writer never began"
            time.sleep(0.002)
        time.sleep(wait_s)
        os.kill(pid, signal.SIGKILL)
        while _is_there(pid):
            time.sleep(0.002)
        counts = [int(line) for line in said.read_text().splitlines()]
        said.unlink()
        return max(counts)

    def close(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(30)
        self._process.stdout.close()


def _is_there(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture(scope="module")
def writers() -> Iterator[Writers]:
    found = Writers()
    yield found
    found.close()


def _worse(path: Path, seed: int, safe_until: int) -> None:
    """Sometimes a torn tail is added or taken away, never inside what had been flushed."""
    rng = random.Random(seed)
    size = path.stat().st_size
    match rng.randrange(4):
        case 0:
            with open(path, "ab") as stream:
                stream.write(rng.randbytes(rng.randrange(5000)))
        case 1:
            with open(path, "ab") as stream:
                stream.write(bytes(rng.randrange(5000)))
        case 2 if size > safe_until:
            os.truncate(path, rng.randrange(safe_until, size + 1))
        case _:
            pass


def _only_says_what_was_lost(examined: Examination) -> bool:
    """Whether nothing is wrong with a recovered log but what it says of its own recovery."""
    wrong = [finding for finding in examined.findings if finding.level not in (Level.INFO, Level.WARNING)]
    return all(finding.what.startswith("recovered from a log ") for finding in wrong)


def _check(writers: Writers, folder: Path, kind: str, seed: int) -> None:
    path, clean = folder / f"{kind}{seed}.mcap", folder / f"{kind}{seed}.clean.mcap"
    safe = writers.killed(path, kind, seed)
    _worse(path, seed, path.stat().st_size)
    found = list(messages(path))
    recover(path, clean)
    examined = examine(clean)
    assert kind == "run" or _only_says_what_was_lost(examined), (seed, examined.findings)
    saved = list(messages(clean))
    assert [(m.topic, m.log_time, m.data) for m in saved] == [(m.topic, m.log_time, m.data) for m in found]
    if kind == "run":
        assert sum(m.topic == "/search/plan" for m in saved) >= safe, seed
    else:
        assert len(saved) >= safe, seed
        assert [m.log_time for m in saved] == list(range(len(saved))), seed
        assert all(m.data == payload(m.log_time) for m in saved), seed
    path.unlink()
    clean.unlink()


def _flipped(writers: Writers, folder: Path, kind: str, seed: int) -> None:
    """Killed, and then a byte flips anywhere behind the magic: what is lost is one chunk at most."""
    rng = random.Random(seed)
    path, clean = folder / f"flip{seed}.mcap", folder / f"flip{seed}.clean.mcap"
    writers.killed(path, kind, seed)
    before = [(m.topic, m.log_time, m.data) for m in messages(path)]
    largest = max(_chunk_sizes(path), default=0)
    data = bytearray(path.read_bytes())
    data[rng.randrange(8, len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)
    recover(path, clean)
    after = {(m.topic, m.log_time, m.data) for m in messages(clean)}
    assert after <= set(before), seed
    assert len(after) >= len(before) - largest, seed
    assert _only_says_what_was_lost(examine(clean)), seed
    path.unlink()
    clean.unlink()


def _chunk_sizes(path: Path) -> list[int]:
    from replayers.mcap_io.records import ChunkRecord, RawMessage, records_in
    from replayers.mcap_io.scan import open_log, scan

    with open_log(path) as stream:
        return [
            sum(isinstance(inner, RawMessage) for _, inner in records_in(record.unpack()))
            for _, record in scan(stream, on_damage=lambda damage: None)
            if isinstance(record, ChunkRecord)
        ]


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("kind", KINDS)
def test_a_few_kills_lose_nothing_that_was_flushed(writers: Writers, kind: str, tmp_path: Path):
    for seed in range(2):
        _check(writers, tmp_path, kind, seed)


def test_a_kill_and_a_flipped_byte_cost_one_chunk_at_most(writers: Writers, tmp_path: Path):
    for seed in range(2):
        _flipped(writers, tmp_path, "direct", seed)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_thousand_kills_lose_nothing_that_was_flushed(writers: Writers, tmp_path: Path):
    kills = int(os.environ.get("LIOS_KILLS", "1000"))

    def one(seed: int) -> None:
        if seed % 5 == 4:
            _flipped(writers, tmp_path, "direct", 1000 + seed)
        else:
            _check(writers, tmp_path, KINDS[0 if seed % 5 < 2 else seed % 3], 1000 + seed)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(one, range(kills)))
