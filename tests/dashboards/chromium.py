"""A headless Chromium for tests, with helpers for what they check."""

from __future__ import annotations

import io
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]


@contextmanager
def chromium() -> Iterator[Browser]:
    """A running browser; skips where there is none."""
    path = os.environ.get("LIOS_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("no Chromium here; install it or name it in LIOS_CHROMIUM")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=FLAGS, timeout=180_000)
        yield browser
        browser.close()


def new_page(browser: Browser, *, width: int = 1280, height: int = 720) -> Page:
    """An empty tab that is patient."""
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(90_000)
    return page


def open_view(browser: Browser, url: str, *, width: int = 1000, height: int = 600) -> Page:
    """A tab with the dashboard, once its panels and its house are there."""
    page = new_page(browser, width=width, height=height)
    page.goto(url)
    page.locator(".lp .facts").wait_for()
    page.wait_for_function("[...document.querySelectorAll('canvas')].some((c) => c.clientWidth > 300)")
    return page


def until(page: Page, expression: str, *, seconds: float = 60) -> None:
    """Waits until an expression holds in the page. The offline page's policy forbids Playwright's own way."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"still not: {expression}"
        page.wait_for_timeout(50)


def until_still(page: Page, expression: str, *, seconds: float = 60) -> Any:
    """Waits until a value is the same after several frames, and returns it."""
    end, last, same = time.monotonic() + seconds, None, 0
    while same < 5:
        assert time.monotonic() < end, f"never still: {expression}"
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        page.wait_for_timeout(50)
        value = page.evaluate(expression)
        same = same + 1 if value == last else 0
        last = value
    return last


def until_seen(page: Page, holds: Callable[[bytes], bool], *, seconds: float = 90) -> bytes:
    """Waits until a picture of the page is as it should be, and returns it."""
    end = time.monotonic() + seconds
    while not holds(picture := page.screenshot()):
        assert time.monotonic() < end, "the page does not look as it should"
        page.wait_for_timeout(100)
    return picture


def wait_for_second(page: Page, low: float, high: float) -> None:
    """Waits until the page's address names a moment within bounds."""
    page.wait_for_function(
        "([low, high]) => { const at = parseFloat(new URLSearchParams(location.search).get('at'));"
        " return at >= low && at <= high; }",
        arg=[low, high],
    )


def colours_in(picture: bytes, box: tuple[float, float, float, float]) -> int:
    """How many different colours a part of a picture has; box in shares: left, top, right, bottom."""
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    w, h = image.size
    part = image.crop((int(box[0] * w), int(box[1] * h), int(box[2] * w), int(box[3] * h)))
    return len(np.unique(np.asarray(part).reshape(-1, 3), axis=0))
