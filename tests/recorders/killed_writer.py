"""Writes a log until it is killed; after every flush says on standard output how many messages are safe.

    python killed_writer.py LOG KIND SEED

KIND is direct (a McapWriter, flushed now and then), background (a thread that writes), or run (a RunRecorder that
records the toy run over and over).
"""

from __future__ import annotations

import random
import sys
import time
from pathlib import Path

CHANNELS = 3


def payload(i: int) -> bytes:
    """The message number i: its number and as many bytes as it likes."""
    return b"%d:" % i + bytes(random.Random(i).randbytes(random.Random(i).randrange(0, 3000)))


def direct(path: Path, seed: int) -> None:
    from recorders.writer import McapWriter

    rng = random.Random(seed)
    writer = McapWriter(path, chunk_bytes=rng.choice([1, 2000, 50_000]), compression=rng.choice(["zstd", "lz4", ""]))
    channels = [writer.add_channel(f"/t{k}", "json", writer.add_schema("s", "jsonschema", b"{}")) for k in range(3)]
    told(0)
    for i in range(10**9):
        writer.add_message(channels[i % CHANNELS], payload(i), log_time=i)
        if rng.random() < 0.2:
            writer.flush()
            told(i + 1)


def background(path: Path, seed: int) -> None:
    from recorders.background import Background
    from recorders.channel_spec import ChannelSpec
    from recorders.sinks import LogFiles

    rng = random.Random(seed)
    sink = Background(LogFiles(path))
    channels = [ChannelSpec(topic=f"/t{k}", message_encoding="json") for k in range(CHANNELS)]
    told(0)
    for i in range(10**9):
        while not sink.write(channels[i % CHANNELS], payload(i), log_time=i):
            time.sleep(0.001)
        if rng.random() < 0.05 and sink.wait():
            told(i + 1)


def run(path: Path, seed: int) -> None:
    from sample_logs import toy_events, toy_options

    from recorders.recorder import RunRecorder

    recorder = RunRecorder(path, **toy_options())  # type: ignore[arg-type]
    count = 0
    for _ in range(10**6):
        for event in toy_events()[:-1]:
            recorder.record(event)
            if type(event).__name__ == "Planned":
                count += 1
                told(count)


def told(count: int) -> None:
    sys.stdout.write(f"{count}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    {"direct": direct, "background": background, "run": run}[sys.argv[2]](Path(sys.argv[1]), int(sys.argv[3]))
