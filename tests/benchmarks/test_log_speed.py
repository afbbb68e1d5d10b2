"""How fast is a log written with sync, and read to data frames? Compared, in the same run, with mcap's own reader.

make bench, or: pytest tests/benchmarks/test_log_speed.py --benchmark-only
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from sample_logs import toy_events, toy_options

from recorders.recorder import RunRecorder
from replayers.columns import SCHEMAS
from replayers.listing import rows_of
from replayers.run import read


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


SMALL = Path(__file__).resolve().parents[2] / "logs" / "breakfast.mcap"
"""A run of 4 decisions."""


def test_iterate_a_small_log_with_the_mcap_reader_and_decoders(benchmark):
    benchmark(iterate, SMALL)


def test_read_a_small_log_to_all_data_frames(benchmark):
    benchmark(frames, SMALL)


def frames(path: Path) -> int:
    """Every table of the log."""
    tables = read(path).tables
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
