"""A note typed while viewing: it is in the log, on the timeline and in the list; where it cannot be, that is told."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import chromium, open_view
from playwright.sync_api import Browser, expect
from sample_logs import write_toy_log

from dashboards.viser_app.serving import open_dashboard
from replayers.log_tools.notes import notes_of

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.mark.parametrize(("width", "height", "theme"), [(1440, 900, "light"), (1000, 700, "dark")])
def test_a_typed_note_is_in_the_log_and_on_show(
    browser: Browser, tmp_path: Path, width: int, height: int, theme: str
) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    dashboard = open_dashboard([log], port=0)
    page = open_view(browser, dashboard.link(f"theme={theme}"), width=width, height=height)
    page.keyboard.press("End")
    page.get_by_role("tab", name="Notes", exact=True).click()
    page.locator("textarea:visible").first.fill("the door was <b>stuck</b>")
    page.wait_for_timeout(500)
    page.get_by_role("button", name="Add the note to the log").click()
    expect(page.locator(".lp.events")).to_contain_text("the door was <b>stuck</b>")
    expect(page.locator(".lios-timeline")).to_contain_text("▼")
    expect(page.locator("textarea:visible").first).to_have_value("")
    assert [note.text for note in notes_of(log)] == ["the door was <b>stuck</b>"]
    page.close()
    dashboard.stop()


def test_a_note_without_words_is_refused_in_the_browser(browser: Browser, tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    dashboard = open_dashboard([log], port=0)
    page = open_view(browser, dashboard.link())
    page.get_by_role("tab", name="Notes", exact=True).click()
    page.get_by_role("button", name="Add the note to the log").click()
    page.get_by_text("The note was not written").wait_for()
    assert notes_of(log) == []
    page.close()
    dashboard.stop()
