"""Makes every picture of the gallery again: `python docs/gallery/make.py [NAME ...]`.

All is made from what ships with the project: the sample logs, and a demo, an evaluation and a session of a Spot,
the last simulated, all run here. Needs Chromium and the extras "render" and "spot". NAMEs choose some pictures.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from dashboards.model.timeline import timeline_of
from dashboards.rendering.chromium import FLAGS
from dashboards.viser_app.serving import open_dashboard
from replayers.runs.run import read

HERE = Path(__file__).resolve().parent
LOGS = HERE.parents[1] / "logs"
LIOS = Path(sys.executable).with_name("lios")
SIZE = {"width": 1440, "height": 900}
QUALITY = 86
DRAWN_MS = 3_000


def main() -> None:
    wanted = set(sys.argv[1:])
    with tempfile.TemporaryDirectory(prefix="lios-gallery-") as folder, sync_playwright() as drive:
        browser = drive.chromium.launch(
            executable_path=os.environ.get("LIOS_CHROMIUM") or "/usr/bin/chromium", args=[*FLAGS, "--no-sandbox"]
        )
        for name, make in PICTURES.items():
            if not wanted or name in wanted:
                print(name, flush=True)
                make(browser, Path(folder))
        browser.close()


def lios(*words: object, **more: Any) -> None:
    subprocess.run([str(LIOS), *(str(w) for w in words)], check=True, stdout=subprocess.DEVNULL, **more)


def keep(picture: bytes | Path, name: str) -> None:
    data = picture.read_bytes() if isinstance(picture, Path) else picture
    with Image.open(io.BytesIO(data)) as image:
        image.convert("RGB").save(
            HERE / f"{name}.webp", quality=QUALITY, method=6, lossless=name.startswith("figure_")
        )


@contextmanager
def shown(browser: Browser, logs: Sequence[Path], query: str = "") -> Any:
    """A page of the dashboard on these logs."""
    dashboard = open_dashboard(logs, port=0)
    page = browser.new_page(viewport=SIZE)
    page.set_default_timeout(120_000)
    try:
        page.goto(dashboard.link(query))
        page.locator(".lp .facts").wait_for()
        page.wait_for_timeout(DRAWN_MS)
        for close in page.query_selector_all(".mantine-Notification-closeButton"):
            close.click()
        page.wait_for_timeout(1_000)
        yield page
    finally:
        page.close()
        dashboard.stop()


def tab(page: Page, name: str) -> bytes:
    page.get_by_role("tab", name=name, exact=True).click()
    page.wait_for_timeout(1_200)
    return page.screenshot()


def demo(folder: Path) -> list[Path]:
    """The demo's run and the replays that it opens."""
    if not (folder / "demo").exists():
        lios("demo", "--no-view", "-o", folder / "demo")
    replays = sorted((folder / "demo" / "replays").rglob("*.replay.mcap"))
    named = [next(p for p in replays if p.name.startswith(n)) for n in ("opt-greedy", "conditioned-lios", "oracle")]
    return [folder / "demo" / "run.mcap", *named]


def readme(browser: Browser, folder: Path) -> None:
    """The picture at the top of the README and of the documentation."""
    logs = [LOGS / f"find-{name}.mcap" for name in ("lios", "greedy", "conditioned-lios")]
    with shown(browser, logs, "at=14") as page, Image.open(io.BytesIO(page.screenshot())) as image:
        image.convert("RGB").save(HERE.parent / "images" / "dashboard.png", optimize=True)


def dark(browser: Browser, folder: Path) -> None:
    with shown(browser, demo(folder), "at=14&theme=dark") as page:
        keep(tab(page, "Plots"), "dark")


def first_view(browser: Browser, folder: Path) -> None:
    with shown(browser, demo(folder)) as page:
        keep(page.screenshot(), "view")


def demo_panels(browser: Browser, folder: Path) -> None:
    with shown(browser, demo(folder), "at=14") as page:
        for name, file in (
            ("Belief", "belief"),
            ("Plan", "plan"),
            ("Find costs", "find_costs"),
            ("Plots", "plots"),
            ("Compare", "compare"),
            ("View", "options"),
        ):
            keep(tab(page, name), file)
        page.keyboard.press("t")
        page.wait_for_timeout(1_500)
        keep(page.screenshot(), "from_above")


def task(browser: Browser, folder: Path) -> None:
    with shown(browser, [LOGS / "breakfast.mcap"], "at=60&walls=whole") as page:
        keep(tab(page, "Plan"), "breakfast")


def evaluation(browser: Browser, folder: Path) -> None:
    out = folder / "evaluation"
    lios(
        *("evaluate", "tasks", "--scenarios", "deliver-3", "--strategies", "model-lios,opt-greedy", "-n", 12),
        *("--split", "all", "--estimator", "counts", "--paper-estimator", "counts", "--record", "-o", out),
    )
    with shown(browser, [out]) as page:
        keep(page.screenshot(), "runs")
        page.locator(".lp circle").nth(3).click()
        page.wait_for_timeout(4_000)
        keep(page.screenshot(), "evaluation")


def robot(browser: Browser, folder: Path) -> None:
    """A simulated Spot does a task; beside it another recorder keeps pictures and depth."""
    secret = os.environ | {"BOSDYN_CLIENT_USERNAME": "user", "BOSDYN_CLIENT_PASSWORD": "simulated"}
    certificate, port = folder / "spot.pem", 50779
    robot_ = subprocess.Popen([LIOS, "spot", "simulate", "--port", str(port), "--certificate", certificate])
    try:
        until = time.monotonic() + 60
        while not certificate.exists() and time.monotonic() < until:
            time.sleep(0.5)
        time.sleep(2)
        reach = ("--robot", f"127.0.0.1:{port}", "--certificate", str(certificate), "--site", "paper_home")
        kept = ("--cameras", "frontleft_fisheye_image,frontright_fisheye_image,frontleft_depth", "--images-hz", "1")
        recorder = subprocess.Popen(
            [LIOS, "spot", "record", *reach, *kept, "--for", "150", "-o", folder / "session.mcap"],
            env=secret,
            stdin=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        run = (
            "--own-estop",
            "--furniture-open",
            "--estimator",
            "counts",
            "--images-hz",
            "1",
            "-o",
            str(folder / "spot.mcap"),
        )
        lios("spot", "run", *reach, *run, env=secret, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        recorder.wait()
    finally:
        robot_.terminate()
        robot_.wait()
    with shown(browser, [folder / "spot.mcap"], f"at={middle_decision(folder / 'spot.mcap')}") as page:
        keep(page.screenshot(), "robot_run")
    with shown(browser, [folder / "session.mcap"], "at=80") as page:
        keep(page.screenshot(), "robot_session")


def middle_decision(log: Path) -> float:
    """A moment after the middle decision of a run, in seconds: something has been searched, something is to come."""
    timeline = timeline_of(read(log))
    return round(timeline.seconds(timeline.decision_ns[len(timeline.decision_ns) // 2]) + 1.0, 1)


def capsule(browser: Browser, folder: Path) -> None:
    lios("capsule", *demo(folder), "-o", folder / "run.html", "--force")
    page = browser.new_page(viewport=SIZE)
    page.context.set_offline(True)
    page.goto((folder / "run.html").as_uri() + "#at=14&tab=comparison")
    page.wait_for_timeout(DRAWN_MS)
    keep(page.screenshot(), "capsule")
    page.close()


def pictures(browser: Browser, folder: Path) -> None:
    logs = [LOGS / f"find-{name}.mcap" for name in ("lios", "greedy", "conditioned-lios")]
    lios("render", logs[0], "--at", 21, "-o", folder / "frame.png", "--force")
    keep(folder / "frame.png", "render")
    lios("figures", *logs, "-o", folder / "figures", "--format", "png", "--force")
    for path in sorted((folder / "figures").glob("*.png")):
        keep(path, f"figure_{path.stem}")


PICTURES: dict[str, Callable[[Browser, Path], None]] = {
    "readme": readme,
    "dark": dark,
    "first_view": first_view,
    "demo_panels": demo_panels,
    "task": task,
    "evaluation": evaluation,
    "robot": robot,
    "capsule": capsule,
    "pictures": pictures,
}


if __name__ == "__main__":
    main()
