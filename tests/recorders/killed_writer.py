"""Writes logs until it is killed; after every flush, writes to a file beside the log how many messages are safe.

    python killed_writer.py

Reads lines of "LOG KIND SEED" and forks a writer for each, whose process id it prints: what a kill costs is then a
fork, and not a second of imports. KIND is direct (a McapWriter, flushed now and then), background (a thread that
writes), or run (a RunRecorder that records the toy run over and over).
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

CHANNELS = 3


def payload(i: int) -> bytes:
    """The message number i: its number and as many bytes as it likes."""
    return b"%d:" % i + bytes(random.Random(i).randbytes(random.Random(i).randrange(0, 3000)))


def direct(path: Path, seed: int) -> None:
    from recorders.mcap_io.writer import McapWriter

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
    from recorders.mcap_io.channels import ChannelSpec
    from recorders.sinks.files import LogFiles
    from recorders.sinks.threaded import ThreadedSink

    rng = random.Random(seed)
    sink = ThreadedSink(LogFiles(path))
    channels = [ChannelSpec(topic=f"/t{k}", message_encoding="json") for k in range(CHANNELS)]
    told(0)
    for i in range(10**9):
        while not sink.write(channels[i % CHANNELS], payload(i), log_time=i):
            time.sleep(0.001)
        if rng.random() < 0.05 and sink.wait():
            told(i + 1)


def run(path: Path, seed: int) -> None:
    from sample_logs import toy_events, toy_options

    from recorders.run_recorder import RunRecorder

    recorder = RunRecorder(path, **toy_options())  # type: ignore[arg-type]
    count = 0
    for _ in range(10**6):
        for event in toy_events()[:-1]:
            recorder.record(event)
            if type(event).__name__ == "PlanMade":
                count += 1
                told(count)


def told(count: int) -> None:
    """Says that so many messages are on disk; one write, so that what is there is whole."""
    os.write(SAID, b"%d\n" % count)


def said_file(path: Path) -> Path:
    return path.with_suffix(".said")


SAID = 1
KINDS = {"direct": direct, "background": background, "run": run}

if __name__ == "__main__":
    import sample_logs  # noqa: F401

    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # killed writers leave no zombies
    for line in sys.stdin:
        log, kind, seed = line.rsplit(maxsplit=2)
        child = os.fork()
        if child == 0:
            SAID = os.open(said_file(Path(log)), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
            KINDS[kind](Path(log), int(seed))
            os._exit(1)
        sys.stdout.write(f"{child}\n")
        sys.stdout.flush()
