"""Odd input in a real browser: the page says what is wrong, and nothing of a log runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chromium import chromium, open_view
from playwright.sync_api import Browser, Page, expect
from sample_logs import MUG, record_run, toy_events, toy_info, toy_options, toy_place, write_toy_log

from dashboards.viser_app.serving import open_dashboard
from workbench.execution.events import BeliefUpdated, Event
from workbench.worlds.house import ItemType

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]
EVIL = "<img src=x onerror=window.ran=1>"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def _shown(browser: Browser, logs: list[Path], query: str = "") -> tuple[Page, Any, list[str]]:
    dashboard = open_dashboard(logs, port=0)
    said: list[str] = []
    page = open_view(browser, dashboard.link(query), width=1000, height=700)
    page.on("pageerror", lambda error: said.append(str(error)))
    return page, dashboard, said


def _ended(page: Page, dashboard: Any, said: list[str]) -> None:
    assert page.evaluate("window.ran") is None
    assert said == []
    page.close()
    dashboard.stop()


def test_a_damaged_log_and_one_without_events_say_so(browser: Browser, tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    data = bytearray(log.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 200] = b"\xff" * 200
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(bytes(data))
    shown = _shown(browser, [damaged])
    expect(shown[0].get_by_text("This log is not whole: 1 place of the log could not be read")).to_be_visible()
    _ended(*shown)
    empty = tmp_path / "empty.mcap"
    record_run(empty, [], **toy_options())  # type: ignore[arg-type]
    shown = _shown(browser, [empty])
    expect(shown[0].get_by_text("This log holds no decisions.")).to_be_visible()
    _ended(*shown)


def test_long_names_and_markup_are_text(browser: Browser, tmp_path: Path) -> None:
    log = tmp_path / "names.mcap"
    info = toy_info(title=EVIL + "t" * 200, place=EVIL + "h" * 200, strategy=EVIL + "s" * 200)
    record_run(log, toy_events(), **{**toy_options(), "info": info})  # type: ignore[arg-type]
    shown = _shown(browser, [log, write_toy_log(tmp_path / "run.mcap")])
    page = shown[0]
    for tab in ("Plan", "Find costs", "Plots", "Compare", "Notes", "Runs"):
        page.get_by_role("tab", name=tab, exact=True).click()
        page.wait_for_timeout(200)
    assert page.locator("img[src='x']").count() == 0
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    _ended(*shown)


def test_a_thousand_item_types_are_shown(browser: Browser, tmp_path: Path) -> None:
    log = tmp_path / "types.mcap"
    record_run(log, map(_with_many_types, toy_events()), **toy_options())  # type: ignore[arg-type]
    shown = _shown(browser, [log], "at=0&item=Thing999")
    expect(shown[0].get_by_text("thing999").first).to_be_visible()
    _ended(*shown)


def _with_many_types(event: Event) -> Event:
    if not isinstance(event, BeliefUpdated):
        return event
    belief = event.belief
    more = np.full((1000, len(belief.containers)), 0.001)
    types = (MUG, *(ItemType(f"Thing{i}") for i in range(1000)))
    return replace(
        event, belief=replace(belief, item_types=types, probability=np.concatenate([belief.probability, more]))
    )


def test_runs_of_two_houses_say_that_only_one_is_drawn(browser: Browser, tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    place = toy_place()
    moved = replace(place, plan=replace(place.plan, name="another"))
    record_run(other, toy_events(), **{**toy_options(), "place": moved})  # type: ignore[arg-type]
    shown = _shown(browser, [write_toy_log(tmp_path / "run.mcap"), other])
    page = shown[0]
    expect(page.get_by_text("These runs are in different places")).to_be_visible()
    _ended(*shown)
