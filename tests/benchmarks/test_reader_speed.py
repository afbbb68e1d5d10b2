"""Benchmark: writing a log with sync, and reading it to data frames, compared in the same run with mcap's own reader.

make bench, or: pytest tests/benchmarks/test_reader_speed.py --benchmark-only
"""

from __future__ import annotations

import json
from collections.abc import Callable
from math import inf
from pathlib import Path
from time import process_time

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from sample_logs import toy_events, toy_options
from timings import HOLD_FIGURES

from recorders.run_recorder import RunRecorder
from replayers.log_tools.listing import rows_of
from replayers.log_tools.recover import recover
from replayers.runs.run import read
from replayers.tables.frames import read_many
from replayers.tables.schemas import SCHEMAS


@pytest.fixture(scope="module")
def long_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 900 decisions."""
    path = tmp_path_factory.mktemp("bench") / "long.mcap"
    with RunRecorder(path, **toy_options()) as recorder:
        for _ in range(300):
            for event in toy_events()[1:-1]:
                recorder.record(event)
        recorder.record(toy_events()[-1])
    return path


def test_write_a_run_with_a_sync_at_every_decision(benchmark, tmp_path: Path):
    def write() -> None:
        with RunRecorder(tmp_path / "a.mcap", force=True, **toy_options()) as recorder:
            for event in toy_events():
                recorder.record(event)

    benchmark(write)


def test_iterate_with_the_mcap_reader_and_decoders(benchmark, long_log: Path):
    benchmark(iterate, long_log)


def iterate(path: Path) -> int:
    """Every message, decoded, by mcap's reader."""
    count = 0
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory(), JsonDecoders()])
        for _ in reader.iter_decoded_messages():
            count += 1
    return count


class JsonDecoders:
    """What mcap leaves to its users: JSON by Python's json."""

    def decoder_for(self, message_encoding: str, schema):
        return json.loads if message_encoding == "json" else None


def test_read_to_all_data_frames(benchmark, long_log: Path):
    benchmark(frames, long_log)


LOGS = Path(__file__).resolve().parents[2] / "logs"
AIM = 0.8


def test_sample_logs_to_all_data_frames_against_the_mcap_reader(
    benchmark, capsys: pytest.CaptureFixture[str], tmp_path
):
    """In turns, best of 40, processor time: what the machine does besides falls on all alike."""
    lines = [f"{'':33} {'iterated':>11} {'read':>11}      {'read_many':>11}"]
    shares = []
    for path in sorted(LOGS.glob("*.mcap")):
        log = whole(path, tmp_path)
        theirs, one, many = best_of(
            40, lambda log=log: iterate(log), lambda log=log: frames(log), lambda log=log: frames_of_many(log)
        )
        shares += [theirs / one, theirs / many]
        figures = "".join(f" {seconds * 1e3:8.1f} ms {theirs / seconds:4.2f}" for seconds in (one, many))
        lines.append(f"{path.name:33} {theirs * 1e3:8.1f} ms{figures}")
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    benchmark(frames, LOGS / "breakfast.mcap")
    if HOLD_FIGURES:
        assert min(shares) >= AIM


def whole(path: Path, folder: Path) -> Path:
    """The log, or what lios recover makes of one that mcap's reader does not open."""
    if read(path).complete:
        return path
    recover(path, folder / path.name)
    return folder / path.name


def best_of(rounds: int, *calls: Callable[[], object]) -> tuple[float, ...]:
    """The least seconds of processor time of each, called in turns."""
    best = [inf] * len(calls)
    for _ in range(rounds):
        for i, call in enumerate(calls):
            begin = process_time()
            call()
            best[i] = min(best[i], process_time() - begin)
    return tuple(best)


def frames(path: Path) -> int:
    """Every table of the log."""
    tables = read(path).tables
    return sum(len(getattr(tables, name)) for name in SCHEMAS)


def frames_of_many(path: Path) -> int:
    """The same, asked for as one asks for many."""
    tables = read_many(path)
    return sum(len(getattr(tables, name)) for name in SCHEMAS)


@pytest.mark.slow
def test_list_a_thousand_logs_the_second_time(benchmark, tmp_path: Path):
    paths = thousand_logs(tmp_path)
    rows_of(paths, memory=tmp_path / "memory.json")
    benchmark(lambda: rows_of(paths, memory=tmp_path / "memory.json"))


def thousand_logs(folder: Path) -> list[Path]:
    """A thousand small runs."""
    with RunRecorder(folder / "0.mcap", **toy_options()) as recorder:
        for event in toy_events():
            recorder.record(event)
    data = (folder / "0.mcap").read_bytes()
    paths = [folder / f"{number}.mcap" for number in range(1000)]
    for path in paths[1:]:
        path.write_bytes(data)
    return paths
