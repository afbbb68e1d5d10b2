"""The dashboard and the offline page in Firefox: drawing, clicks, seeking, restoring."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import colours_in
from firefox import Firefox, firefox

from dashboards.capsule.write import write_capsule
from dashboards.library.library import Library
from dashboards.viser_app.serving import open_dashboard

LOGS = [Path(__file__).resolve().parents[2] / "logs" / f"find-{name}.mcap" for name in ("lios", "greedy")]

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def tab() -> Iterator[Firefox]:
    with firefox() as running:
        yield running


def address(tab: Firefox) -> str:
    return tab.evaluate("location.search")


def test_the_dashboard_draws_seeks_and_restores(tab: Firefox) -> None:
    dashboard = open_dashboard(LOGS, port=0)
    try:
        tab.goto(dashboard.link())
        tab.until("document.querySelector('.lp .facts') !== null")
        time.sleep(4)
        assert colours_in(tab.screenshot(), (0.05, 0.1, 0.6, 0.7)) > 200
        tab.evaluate("window.liosCommand('decision 3')")
        tab.until("document.body.innerText.includes('Decision 3 of')")
        tab.until("new URLSearchParams(location.search).get('at') > 0")
        for label, words in (
            ("Plots", "Expected remaining cost"),
            ("Compare", "They diverge"),
            ("Find costs", "costs from"),
        ):
            tab.click(f"//*[@role='tab'][normalize-space()='{label}']")
            tab.until(f"document.body.innerText.includes('{words}')")
        here = address(tab)
        tab.goto(dashboard.url + "/" + here)
        tab.until("document.body.innerText.includes('Decision 3 of')")
    finally:
        tab.goto("about:blank")
        dashboard.stop()


def test_a_click_opens_a_container_and_the_page_can_be_dark(tab: Firefox) -> None:
    dashboard = open_dashboard(LOGS, port=0)
    try:
        tab.goto(dashboard.link("theme=dark"))
        tab.until("document.querySelector('.lp .facts') !== null")
        tab.until("document.documentElement.dataset.mantineColorScheme === 'dark'")
        tab.until("window.liosDrawn === true")
        tab.click("//table[@data-table='beliefs']//*[starts-with(@data-lios, 'look ')]")
        tab.until("document.body.innerText.includes('What was there')")
        tab.until("location.search.includes('container=')")
        tab.until("!document.body.innerText.includes('Ground truth at the start')")
        tab.click("//label[normalize-space()='Ground truth']")
        tab.until("document.body.innerText.includes('Ground truth at the start')")
        tab.goto("about:blank")
        tab.goto(dashboard.url + "/?container=nowhere&follow=1")
        tab.until("document.body.innerText.includes('Decision')")
        tab.until("location.search.includes('follow=1')")
    finally:
        tab.goto("about:blank")
        dashboard.stop()


def test_ghosts_run_beside_a_log_that_is_followed(tab: Firefox) -> None:
    dashboard = open_dashboard(LOGS[1:], port=0, follow=True, ghosts="model-lios")
    try:
        tab.goto(dashboard.link())
        tab.until("document.querySelectorAll('table[data-table=ghosts] tbody tr').length === 2", seconds=180)
        tab.until("document.querySelector('[data-live=verdict]').innerText.includes('provably beaten')")
    finally:
        tab.goto("about:blank")
        dashboard.stop()


def test_the_offline_page_draws_and_plays(tab: Firefox, tmp_path: Path) -> None:
    library = Library(LOGS)
    path = tmp_path / "run.html"
    write_capsule([library.timeline(0), library.timeline(1)], path)
    tab.goto(path.as_uri())
    tab.until("window.lios !== undefined")
    assert tab.evaluate("document.getElementById('sorry').hidden"), "Firefox has WebGL 2"
    time.sleep(1)
    assert colours_in(tab.screenshot(), (0.05, 0.1, 0.6, 0.7)) > 200
    tab.evaluate("window.lios.seek(window.lios.end())")
    tab.until("document.getElementById('p-now').innerText.includes('done')")
    tab.evaluate("document.getElementById('item').value = '1'")
    tab.evaluate("document.getElementById('item').dispatchEvent(new Event('change'))")
    tab.until("window.lios.state.item === 1")
