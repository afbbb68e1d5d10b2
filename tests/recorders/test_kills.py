"""A recorder is killed at a random moment: nothing that was flushed is lost, and recovery makes a clean log of it.

LIOS_KILLS sets how many kills the slow test makes; 1,000 by default.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from killed_writer import payload

from replayers.doctor import examine
from replayers.findings import Verdict
from replayers.reader import messages
from replayers.recover import recover

WRITER = Path(__file__).with_name("killed_writer.py")
KINDS = ("direct", "background", "run")


def _killed(path: Path, kind: str, seed: int) -> int:
    """Runs a writer and kills it; returns how many messages it had said are safe."""
    rng = random.Random(seed)
    process = subprocess.Popen(
        [sys.executable, str(WRITER), str(path), kind, str(seed)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stderr is not None
    first = process.stdout.readline()
    assert first, process.stderr.read().decode()
    time.sleep(rng.random() * 0.15)
    process.send_signal(signal.SIGKILL)
    rest, _ = process.communicate()
    lines = [first, *(line + b"\n" for line in rest.split(b"\n")[:-1])]
    return max(int(line) for line in lines)


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


def _check(folder: Path, kind: str, seed: int) -> None:
    path, clean = folder / f"{kind}{seed}.mcap", folder / f"{kind}{seed}.clean.mcap"
    safe = _killed(path, kind, seed)
    _worse(path, seed, path.stat().st_size)
    found = list(messages(path))
    recover(path, clean)
    examined = examine(clean)
    assert examined.verdict is Verdict.FINE or kind == "run", (seed, examined.findings)
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


def _flipped(folder: Path, kind: str, seed: int) -> None:
    """Killed, and then a byte flips anywhere behind the magic: what is lost is one chunk at most."""
    rng = random.Random(seed)
    path, clean = folder / f"flip{seed}.mcap", folder / f"flip{seed}.clean.mcap"
    _killed(path, kind, seed)
    before = [(m.topic, m.log_time, m.data) for m in messages(path)]
    largest = max(_chunk_sizes(path), default=0)
    data = bytearray(path.read_bytes())
    data[rng.randrange(8, len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)
    recover(path, clean)
    after = {(m.topic, m.log_time, m.data) for m in messages(clean)}
    assert after <= set(before), seed
    assert len(after) >= len(before) - largest, seed
    assert examine(clean).verdict is Verdict.FINE, seed
    path.unlink()
    clean.unlink()


def _chunk_sizes(path: Path) -> list[int]:
    from replayers.mcap_records import ChunkRecord, Raw, records_in
    from replayers.scanning import open_log, scan

    with open_log(path) as stream:
        return [
            sum(isinstance(inner, Raw) for _, inner in records_in(record.unpack()))
            for _, record in scan(stream, on_damage=lambda damage: None)
            if isinstance(record, ChunkRecord)
        ]


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_kills_lose_nothing_that_was_flushed(kind: str, tmp_path: Path):
    for seed in range(2):
        _check(tmp_path, kind, seed)


def test_a_kill_and_a_flipped_byte_cost_one_chunk_at_most(tmp_path: Path):
    for seed in range(2):
        _flipped(tmp_path, "direct", seed)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_thousand_kills_lose_nothing_that_was_flushed(tmp_path: Path):
    kills = int(os.environ.get("LIOS_KILLS", "1000"))

    def one(seed: int) -> None:
        if seed % 5 == 4:
            _flipped(tmp_path, "direct", 1000 + seed)
        else:
            _check(tmp_path, KINDS[0 if seed % 5 < 2 else seed % 3], 1000 + seed)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(one, range(kills)))
