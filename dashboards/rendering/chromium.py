"""A headless Chromium with the offline page of some runs in it; the only code that starts a browser."""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from dashboards.capsule.write import capsule_page
from dashboards.model.timeline import Timeline
from workbench.errors import Failed, MissingExtra, Unsupported

if TYPE_CHECKING:
    from playwright.sync_api import Page

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
FLAGS = (
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
)
PATIENCE_MS = 120_000
PATH_VARIABLE = "LIOS_CHROMIUM"


class NoChromium(Unsupported):
    """No browser for drawing was found."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"no Chromium to draw with ({reason}). Install chromium, or run: playwright install chromium;"
            f" or name one in {PATH_VARIABLE}."
        )


class PageFailed(Failed):
    """The page could not be drawn."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"the page did not draw: {reason}. Try lios capsule and open the file in a browser.")


@contextmanager
def page_of(timelines: Sequence[Timeline], *, width: int, height: int, scale: float = 1.0) -> Generator[Page]:
    """The runs' page in a browser window of that size in pixels, ready to draw any moment.

    Args:
        scale: device pixels per CSS pixel: text and lines grow by it. Width and height are multiples of it.

    Raises:
        MissingExtra: playwright is not installed.
        NoChromium: no browser was found, or it did not start.
        PageFailed: the page did not draw.
    """
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError as error:
        raise MissingExtra("drawing pictures", "render") from error
    content = capsule_page(timelines)
    with tempfile.TemporaryDirectory(prefix="lios-render-") as folder, sync_playwright() as playwright:
        path = Path(folder) / "page.html"
        path.write_text(content, encoding="utf-8")
        flags = [*FLAGS, *(["--no-sandbox"] if _is_root() else [])]
        try:
            browser = playwright.chromium.launch(executable_path=_executable(), args=flags)
        except Error as error:
            raise NoChromium(_first_line(error)) from error
        try:
            page = browser.new_page(
                viewport={"width": round(width / scale), "height": round(height / scale)}, device_scale_factor=scale
            )
            page.set_default_timeout(PATIENCE_MS)
            page.goto(path.as_uri())
            _wait_until_drawn(page)
            if page.locator("#sorry").is_visible():
                raise PageFailed("this Chromium has no WebGL 2")
            yield page
        except Error as error:
            raise PageFailed(_first_line(error)) from error
        except KeyboardInterrupt:
            # Ctrl-C ends Chromium and its driver too, and their pending calls would be reported on the terminal.
            logging.getLogger("asyncio").addHandler(logging.NullHandler())
            raise
        finally:
            with suppress(Error):
                browser.close()


def _wait_until_drawn(page: Page) -> None:
    """Polls the page; its own policy forbids a script that waits inside it."""
    until = time.monotonic() + PATIENCE_MS / 1000
    while not page.evaluate("window.lios !== undefined"):
        if time.monotonic() > until:
            raise PageFailed(f"nothing was drawn within {PATIENCE_MS / 1000:.0f} s")
        page.wait_for_timeout(50)


def _executable() -> str | None:
    """A named or installed browser; None lets playwright use its own."""
    named = os.environ.get(PATH_VARIABLE)
    if named:
        return named
    return next((found for name in NAMES if (found := shutil.which(name))), None)


def _is_root() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _first_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or ["unknown"])[0][:200]
