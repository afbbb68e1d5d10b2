"""Benchmark: the dashboard in Chromium beside that of another build, on the same machine and logs.

    LIOS_BASELINE=../older-checkout python tests/benchmarks/dashboard_speed.py

LIOS_BASELINE is a checkout of another commit with its own .venv; without it this build is measured alone. Both take
turns, and medians are printed, with their ratio:

- first picture: from opening the address until the panel is filled and the house is drawn, with three runs;
- step: from the key of the next decision until the panel shows it and a frame was drawn;
- frames that were drawn a second while playing three runs and twenty, the three with copies of them, in turns; the
  processor milliseconds of server and browser for each; and how many calls draw a frame;
- the processor seconds of server and browser for each of these, which hardly depend on what else the machine does;
- memory of the server after one minute of playing at 16 times the speed and after three, and how much it grew.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
import psutil
from PIL import Image

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "dashboards"))

from chromium import chromium  # noqa: E402  after the path is set
from playwright.sync_api import Browser, Page  # noqa: E402

REPEATS, STEPS = int(os.environ.get("LIOS_REPEATS", "3")), 12
PLAYED_S, TURNS, MINUTE_S = 5.0, 2, float(os.environ.get("LIOS_MINUTE_S", "60"))
THREE = [f"find-{name}" for name in ("lios", "greedy", "conditioned-lios")]
FRAME = "window.__viserTestpoints.rendererInfo.render.frame"
DRAWS = "window.__viserTestpoints.rendererInfo.render.calls"
DRAWN = """() => window.__viserTestpoints?.rendererInfo.render.triangles > 2000
  && document.querySelector('canvas[data-engine]')?.clientWidth > 300
  && window.__viserMutable.scene.visible"""
WATCH = """() => new Promise((done) => {
  const words = () => [...document.querySelectorAll('.lp p')].map((p) => p.innerText)
    .find((t) => /^Decision \\d+ of/.test(t));
  const before = words();
  window.addEventListener('keydown', () => {
    const began = performance.now();
    const look = () => words() !== before
      ? requestAnimationFrame(() => requestAnimationFrame(() => { window.took = performance.now() - began; }))
      : setTimeout(look, 2);
    look();
  }, { once: true, capture: true });
  window.took = null;
  done(true);
})"""


@contextmanager
def served(build: Path, logs: list[Path]) -> Iterator[tuple[str, psutil.Process]]:
    """A dashboard of a build: its address and its process."""
    python = build / ".venv" / "bin" / "python"
    command = [str(python if python.exists() else sys.executable), "-m", "workbench", "view", *map(str, logs)]
    with subprocess.Popen([*command, "--port", "0"], cwd=build, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        try:
            for line in process.stderr:
                found = re.search(r"http://\S+", line)
                if found:
                    yield found[0], psutil.Process(process.pid)
                    return
            raise RuntimeError(f"{build} serves nothing")
        finally:
            process.terminate()


def spent(server: psutil.Process | None) -> float:
    """Processor seconds of a server and of the browser so far."""
    total = 0.0
    for process in ([server] if server else []) + psutil.Process().children(recursive=True):
        try:
            if process == server or "chrom" in process.name().lower():
                used = process.cpu_times()
                total += used.user + used.system
        except psutil.NoSuchProcess:
            continue
    return total


def drawn(page: Page) -> bool:
    """Whether the house is in the picture: an empty page has few colours."""
    picture = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
    part = picture[160:500, 60:560].reshape(-1, 3)
    return len(np.unique(part, axis=0)) > 200


def opened(browser: Browser, address: str, server: psutil.Process | None = None) -> tuple[Page, float, float]:
    """A page, the seconds to its first picture, and the processor seconds of browser and server until then."""
    page = browser.new_page(viewport={"width": 1000, "height": 700})
    page.set_default_timeout(120_000)
    before, began = spent(server), time.perf_counter()
    page.goto(address)
    page.locator(".lp .facts").wait_for()
    page.wait_for_function(DRAWN, polling=20)
    took_s, used_s = time.perf_counter() - began, spent(server) - before
    assert drawn(page), "the house is not in the picture"
    return page, took_s, used_s


def step_ms(page: Page) -> float:
    """Milliseconds from the key to the frame of the next decision."""
    page.evaluate(WATCH)
    page.keyboard.press("l")
    page.wait_for_function("window.took !== null", polling=10)
    return page.evaluate("window.took")


def frames_drawn(page: Page, server: psutil.Process) -> tuple[float, float]:
    """Frames that were drawn a second while playing, and processor milliseconds for each."""
    page.keyboard.press("Home")
    page.keyboard.press("Space")
    page.wait_for_timeout(1000)
    frame, used_s, began = page.evaluate(FRAME), spent(server), time.perf_counter()
    page.wait_for_timeout(1000 * PLAYED_S)
    frames = page.evaluate(FRAME) - frame
    rate, cost_ms = frames / (time.perf_counter() - began), 1000 * (spent(server) - used_s) / frames
    page.keyboard.press("Space")
    return rate, cost_ms


def measured(browser: Browser, build: Path, logs: list[Path], many: list[Path]) -> dict[str, float]:
    """One turn of a build."""
    found: dict[str, float] = {}
    with served(build, logs) as (address, server):
        page, found["first picture s"], found["first picture, processor s"] = opened(browser, address, server)
        page.wait_for_timeout(3000)
        page.keyboard.press("Home")
        page.wait_for_timeout(1000)
        before = spent(server)
        steps = [step_ms(page) for _ in range(STEPS // 2)]
        page.keyboard.press("Home")
        steps += [step_ms(page) for _ in range(STEPS // 2)]
        found["step ms"] = median(steps)
        found["step, processor ms"] = 1000 * (spent(server) - before) / STEPS
        page.close()
    rates: dict[int, list[tuple[float, float]]] = {len(logs): [], len(many): []}
    for shown in (logs, many) * TURNS:
        with served(build, shown) as (address, server):
            page, took_s, _ = opened(browser, address, server)
            page.wait_for_timeout(1500)
            rates[len(shown)].append(frames_drawn(page, server))
            found[f"draw calls of {len(shown)}"] = page.evaluate(DRAWS)
            found[f"first picture of {len(shown)} s"] = took_s
            page.close()
    for count, made in rates.items():
        found[f"frames/s of {count}"], found[f"processor ms a frame of {count}"] = (
            median(values) for values in zip(*made, strict=True)
        )
    found["frames/s, share of 20 in 3"] = found["frames/s of 20"] / found["frames/s of 3"]
    found["the same by processor time"] = found["processor ms a frame of 3"] / found["processor ms a frame of 20"]
    return found


def memory_mb(browser: Browser, build: Path, logs: list[Path]) -> tuple[float, float]:
    """Memory of the server after one and after three minutes of playing at 16 times the speed."""
    with served(build, logs) as (address, process):
        page, _, _ = opened(browser, address + "&tab=View")
        page.get_by_role("tab", name="View", exact=True).click()
        page.get_by_text("Loop", exact=True).click()
        page.locator("input[value='1×']").click()
        page.get_by_role("option", name="16×").click()
        page.keyboard.press("Escape")
        page.get_by_role("button", name="Play").click()
        page.wait_for_timeout(1000 * MINUTE_S)
        first = process.memory_info().rss / 1e6
        page.wait_for_timeout(2000 * MINUTE_S)
        second = process.memory_info().rss / 1e6
        page.close()
    return first, second


def main() -> None:
    """Measures and prints."""
    baseline = os.environ.get("LIOS_BASELINE")
    builds = {"this": ROOT} | ({"baseline": Path(baseline).resolve()} if baseline else {})
    logs = [ROOT / "logs" / f"{name}.mcap" for name in THREE]
    turns: dict[str, list[dict[str, float]]] = {name: [] for name in builds}
    with chromium() as browser, TemporaryDirectory() as folder:
        many = [Path(shutil.copy(logs[i % 3], Path(folder) / f"{i:02}.mcap")) for i in range(20)]
        with served(ROOT, logs) as (address, _):
            opened(browser, address)[0].close()  # the browser's first page takes longer than any other
        for turn in range(REPEATS):
            for name, build in list(builds.items())[:: -1 if turn % 2 else 1]:
                turns[name].append(measured(browser, build, logs, many))
        memory = {name: memory_mb(browser, build, logs) for name, build in builds.items() if MINUTE_S}
    for figure in turns["this"][0]:
        values = {name: median(turn[figure] for turn in made) for name, made in turns.items()}
        ratio = f"  ratio {values['this'] / values['baseline']:.2f}" if "baseline" in values else ""
        print(f"{figure:30}" + "  ".join(f"{name} {value:8.2f}" for name, value in values.items()) + ratio)
    for name, (first, second) in memory.items():
        print(f"memory of {name}: {first:.0f} MB after a minute, {second:.0f} MB after three")


if __name__ == "__main__":
    main()
