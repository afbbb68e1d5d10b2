"""Takes pictures of the dashboard as a browser shows it: `python docs/figures/screenshot.py [FOLDER]`.

Needs Chromium and the extra "render".
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from dashboards.viser_app.serving import open_dashboard

ROOT = Path(__file__).resolve().parents[2]
LOGS = tuple(ROOT / "logs" / f"find-{name}.mcap" for name in ("lios", "greedy", "conditioned-lios"))
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
SIZES = {"dashboard": (1440, 900)}
AT_S = 21.0
DRAWN_AFTER_MS = 25_000


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    folder.mkdir(parents=True, exist_ok=True)
    dashboard = open_dashboard(LOGS, port=0, at=AT_S)
    try:
        with sync_playwright() as drive:
            browser = drive.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
            for name, (width, height) in SIZES.items():
                page = browser.new_page(viewport={"width": width, "height": height})
                page.goto(dashboard.link())
                page.wait_for_timeout(DRAWN_AFTER_MS)
                for warning in page.query_selector_all(".mantine-Notification-closeButton"):
                    warning.click()
                page.wait_for_timeout(1_000)
                page.screenshot(path=folder / f"{name}.png")
                page.close()
            browser.close()
    finally:
        dashboard.stop()


if __name__ == "__main__":
    main()
