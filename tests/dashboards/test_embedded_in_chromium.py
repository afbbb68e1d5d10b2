"""The offline page inside a frame of another page, as a notebook shows it: it draws, plays and stays inside."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import chromium
from playwright.sync_api import Browser
from sample_logs import write_toy_log

from dashboards.capsule.embedded import EmbeddedPage
from replayers.runs.run import read

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(300)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def test_it_draws_and_cannot_reach_the_page_around_it(browser: Browser, tmp_path: Path) -> None:
    run = read(write_toy_log(tmp_path / "run.mcap"))
    page = browser.new_page()
    page.set_default_timeout(90_000)
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.set_content(f"<!doctype html><p>a notebook</p>{EmbeddedPage([run])._repr_html_()}")
    inside = page.frame_locator("iframe")
    inside.locator("canvas").first.wait_for()
    inside.get_by_text("find Mug and bring it to start").first.wait_for()
    frame = page.frames[1]
    assert frame.evaluate("(() => { try { return !!window.parent.document; } catch { return false; } })()") is False
    assert frame.evaluate("origin") == "null"
    assert said == []
    page.close()
