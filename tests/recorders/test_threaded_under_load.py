"""Five cameras and a robot's state at full rate: nothing is dropped, and the robot's loop is not delayed.

The default test runs two seconds and holds what does not depend on the machine; the slow one runs a minute and holds
the figures of docs/log-format.md.
"""

from __future__ import annotations

import os
import random
import resource
import time
from functools import partial
from pathlib import Path

import pytest
from sample_logs import toy_events, toy_options

from recorders.mcap_io.channels import ChannelSpec
from recorders.run_recorder import RunRecorder
from replayers.log_tools.info import describe

CAMERAS = [ChannelSpec(topic=f"/camera/{k}", message_encoding="x") for k in range(5)]
STATE = ChannelSpec(topic="/state", message_encoding="x")
PICTURE_BYTES = 50_000
POOL = random.Random(0).randbytes(400 * PICTURE_BYTES)
"""Pictures are cut from here one after another, so that none repeats for seconds and nothing can be packed away."""


def _drive(path: Path, seconds: float) -> tuple[list[float], float, dict[str, int]]:
    """Records at real rate; returns each call's seconds, the share of a core used, and what was dropped."""
    events = toy_events()
    calls: list[float] = []
    with RunRecorder(path, background=True, **toy_options()) as recorder:
        sink = recorder.sink
        cpu = _cpu_s()
        began = time.perf_counter()
        for tick in range(round(seconds * 100)):
            wait = began + tick / 100 - time.perf_counter()
            if wait > 0:
                time.sleep(wait)
            stamp = time.time_ns()
            if tick % 10 == 0:
                for number, camera in enumerate(CAMERAS):
                    start = ((tick // 10 * 5 + number) % 400) * PICTURE_BYTES
                    picture = POOL[start : start + PICTURE_BYTES]
                    calls.append(_timed(partial(sink.write, camera, picture, log_time=stamp)))
            calls.append(_timed(partial(sink.write, STATE, b"s" * 400, log_time=stamp)))
            if tick % 100 == 50:
                event = events[(tick // 100) % len(events)]
                calls.append(_timed(partial(recorder.record, event)))
        elapsed = time.perf_counter() - began
        used = (_cpu_s() - cpu) / elapsed
        dropped = recorder._background.dropped  # type: ignore[union-attr]
    return calls, used, dropped


def _timed(call) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _percentile(values: list[float], share: float) -> float:
    return sorted(values)[int(len(values) * share)]


def test_cameras_and_state_at_full_rate_are_all_there(tmp_path: Path):
    path = tmp_path / "a.mcap"
    _, _, dropped = _drive(path, 2.0)
    assert dropped == {}
    index = describe(path).index
    counts = {channel.topic: index.counts[channel.id] for channel in index.channels.values()}
    assert counts["/state"] == 200
    assert [counts[camera.topic] for camera in CAMERAS] == [20] * 5


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_minute_of_cameras_within_the_promised_figures(tmp_path: Path):
    path = tmp_path / "a.mcap"
    calls, used, dropped = _drive(path, float(os.environ.get("LIOS_KEEP_UP_S", "60")))
    p99_ms = _percentile(calls, 0.99) * 1e3
    told = f"p50 {_percentile(calls, 0.5) * 1e6:.0f} us, p99 {p99_ms:.3f} ms, worst {max(calls) * 1e3:.1f} ms"
    print(f"{told}, {used * 100:.1f} % of a core, {path.stat().st_size / 1e6:.0f} MB, dropped {dropped}")
    assert dropped == {}
    assert p99_ms < 1.0, told
    assert used < 0.5, told
