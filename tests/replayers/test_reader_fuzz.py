"""Fuzzing of reader, doctor and recovery: any bytes give a result or one line, in bounded time and memory.

The slow test runs for LIOS_FUZZ_S seconds, ten minutes by default.
"""

from __future__ import annotations

import os
import random
import struct
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sample_logs import killed_toy_log, write_toy_log

from replayers.doctor.examine import examine
from replayers.doctor.findings import Verdict
from replayers.log_tools.info import describe
from replayers.log_tools.recover import recover
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from replayers.tables.frames import read_many
from workbench.errors import LiosError

ACTIONS: tuple[Callable[[Path], object], ...] = (
    read,
    examine,
    describe,
    lambda path: list(messages(path)),
    lambda path: read_many(path).actions,
)
MAX_READ_S = 10.0
"""Processor seconds."""
MAX_BYTES = 200_000_000


@pytest.fixture(scope="module")
def seeds(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """Logs to begin with: closed, killed, with other compressions, and without chunks."""
    from mcap.writer import CompressionType, Writer

    folder = tmp_path_factory.mktemp("seeds")
    logs = [write_toy_log(folder / "a.mcap").read_bytes(), killed_toy_log(folder / "b.mcap").read_bytes()]
    for number, compression in enumerate(CompressionType):
        path = folder / f"{number}.mcap"
        with open(path, "wb") as stream:
            writer = Writer(stream, compression=compression, use_chunking=number > 0, chunk_size=300)
            writer.start()
            channel = writer.register_channel(
                "/search/plan", "json", writer.register_schema("s", "jsonschema", b"{}")
            )
            for i in range(20):
                writer.add_message(channel, i, b'{"decision": %d}' % i, i)
            writer.add_attachment(1, 1, "place.json", "application/json", b"{}")
            writer.add_metadata("lios.run", {"run_id": "x", "schema_version": "1", "started": "0"})
            writer.finish()
        logs.append(path.read_bytes())
    return logs


def _hold(data: bytes, folder: Path) -> None:
    """Everything ends in an answer or in one line, and what was recovered is no longer broken."""
    path, clean = folder / "fuzzed.mcap", folder / "clean.mcap"
    path.write_bytes(data)
    began = time.thread_time()
    for action in ACTIONS:
        try:
            action(path)
        except LiosError as error:
            if "\n" in str(error):
                pytest.fail(f"an error of several lines: {error}")
    try:
        recover(path, clean, force=True)
    except LiosError:
        return
    finally:
        assert time.thread_time() - began < MAX_READ_S
    found = [finding for finding in examine(clean).findings if "byte" in finding.where or finding.where == "summary"]
    assert examine(clean).verdict is Verdict.FINE or not found, found


def mutated(data: bytes, rng: random.Random) -> bytes:
    """A log with some of its bytes changed, moved, repeated, cut, or made to lie about lengths."""
    broken = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at = rng.randrange(len(broken)) if broken else 0
        match rng.randrange(8):
            case 0:
                broken[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                del broken[at : at + rng.randrange(1, 200)]
            case 2:
                broken[at:at] = broken[rng.randrange(len(broken) + 1) :][: rng.randrange(1, 500)]
            case 3:
                broken[at : at + 8] = struct.pack("<Q", rng.choice((0, 1, 2**31, 2**32 - 1, 2**62, 2**64 - 1)))
            case 4:
                broken[at : at + 4] = struct.pack("<L", rng.choice((0, 1, 2**16, 2**31, 2**32 - 1)))
            case 5:
                broken[at:] = b""
            case 6:
                broken[at : at + 1] = bytes([rng.choice((1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 15, 0x80))])
            case _:
                broken[at:at] = rng.randbytes(rng.randrange(1, 100))
    return bytes(broken)


@given(data=st.binary(max_size=2000), with_magic=st.booleans())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_at_all(data: bytes, with_magic: bool, tmp_path: Path):
    _hold(b"\x89MCAP0\r\n" + data if with_magic else data, tmp_path)


@given(seed=st.integers(0, 2**32))
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_mutated_logs(seed: int, seeds: list[bytes], tmp_path: Path):
    rng = random.Random(seed)
    _hold(mutated(rng.choice(seeds), rng), tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_ten_minutes_of_mutated_logs_in_bounded_memory(seeds: list[bytes], tmp_path: Path):
    until = time.monotonic() + float(os.environ.get("LIOS_FUZZ_S", "600"))
    first = seed = random.randrange(2**32)
    tracemalloc.start()
    while time.monotonic() < until:
        rng = random.Random(seed)
        tracemalloc.reset_peak()
        try:
            _hold(mutated(rng.choice(seeds), rng), tmp_path)
        except Exception as error:
            raise AssertionError(f"seed {seed}") from error
        assert tracemalloc.get_traced_memory()[1] < MAX_BYTES, seed
        seed += 1
    tracemalloc.stop()
    print(f"{seed - first} logs from seed {first}")
