"""A copied address opens the same view: runs, moment, clock, item, container, camera, and the tab in front."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import pytest
from chromium import chromium, open_view, until_still, wait_for_second
from playwright.sync_api import Browser, Page, expect
from sample_logs import record_run, toy_events, toy_info, toy_options, write_toy_log

from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.viser_app.serving import open_dashboard
from replayers.runs.run import read

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("logs")
    other = folder / "other.mcap"
    record_run(other, toy_events(), **{**toy_options(), "info": toy_info(strategy="pes-greedy")})
    return [write_toy_log(folder / "run.mcap"), other]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


def _tab_is(page: Page, label: str) -> None:
    expect(page.get_by_role("tab", name=label, exact=True)).to_have_attribute("aria-selected", "true")


def _asked(page: Page) -> dict[str, str]:
    return {key: values[-1] for key, values in parse_qs(urlsplit(page.url).query).items()}


def _address_has(page: Page, name: str, value: str) -> None:
    page.wait_for_function(
        "([name, value]) => new URLSearchParams(location.search).get(name) === value", arg=[name, value]
    )


@pytest.mark.parametrize("tab", ["Plots", "Find costs", "Container"])
def test_a_copied_address_opens_the_same(browser: Browser, logs: list[Path], tab: str) -> None:
    dashboard = open_dashboard(logs, port=0)
    container = "CounterTop|1"
    view = f"runs=1,0&at=8&clock=distance&item=Mug&container={container}&initialCameraPosition=1,-6,9"
    page = open_view(browser, dashboard.link(f"{view}&initialCameraLookAt=4,2,0"))
    wait_for_second(page, 7.9, 8.1)
    page.get_by_role("tab", name=tab, exact=True).click()
    _address_has(page, "tab", tab)
    copied, asked = page.url, _asked(page)
    assert "token" not in asked
    page.close()
    page = open_view(browser, dashboard.link(urlsplit(copied).query))
    _tab_is(page, tab)
    _address_has(page, "tab", tab)
    _address_has(page, "container", container)
    again = _asked(page)
    assert {k: v for k, v in again.items() if "Camera" not in k} == {
        k: v for k, v in asked.items() if "Camera" not in k
    }
    for key in ("initialCameraPosition", "initialCameraLookAt"):
        assert [float(v) for v in again[key].split(",")] == pytest.approx(
            [float(v) for v in asked[key].split(",")], abs=0.01
        )
    page.close()
    dashboard.stop()


def test_the_first_tab_is_not_named_and_an_unknown_one_is_left_alone(browser: Browser, logs: list[Path]) -> None:
    dashboard = open_dashboard(logs, port=0)
    page = open_view(browser, dashboard.link("at=3&tab=<b>Nowhere</b>"))
    wait_for_second(page, 2.9, 3.1)
    _tab_is(page, "Belief")
    assert "tab" not in _asked(page)
    page.get_by_role("tab", name="Notes", exact=True).click()
    _address_has(page, "tab", "Notes")
    page.get_by_role("tab", name="Belief", exact=True).click()
    page.wait_for_function("!new URLSearchParams(location.search).has('tab')")
    page.reload()
    page.locator(".lp .facts").wait_for()
    wait_for_second(page, 2.9, 3.1)
    page.close()
    dashboard.stop()


def test_a_link_that_follows_shows_the_robot_and_not_the_whole_house(browser: Browser, logs: list[Path]) -> None:
    dashboard = open_dashboard(logs, port=0)
    timeline = timeline_of(read(logs[0]))
    robot = scene_at(timeline, timeline.start_ns + 8 * 10**9).robot
    page = open_view(browser, dashboard.link("at=8&follow=1"))
    page.wait_for_function(
        "([x, y]) => { const at = new URLSearchParams(location.search).get('initialCameraLookAt')?.split(',');"
        " return at && Math.hypot(at[0] - x, at[1] - y) < 0.05; }",
        arg=[robot.x_m, robot.y_m],
    )
    page.close()
    dashboard.stop()


def test_a_change_is_drawn_once_and_not_for_as_long_as_it_might_settle(browser: Browser, logs: list[Path]) -> None:
    dashboard = open_dashboard(logs, port=0)
    page = open_view(browser, dashboard.link())
    page.wait_for_function("window.liosDrawn === true")
    until_still(page, "window.__viserTestpoints.rendererInfo.render.triangles")
    drawn, passed_ms = page.evaluate(
        """async () => {
          const frames = () => window.__viserTestpoints.rendererInfo.render.frame;
          const [before, began] = [frames(), performance.now()];
          window.__viserMutable.requestRender();
          for (let i = 0; i < 6; i++) await new Promise((done) => requestAnimationFrame(done));
          return [frames() - before, performance.now() - began];
        }"""
    )
    assert drawn <= 2 + passed_ms / 250, "one at once; others are due after a quarter of a second"
    page.close()
    dashboard.stop()


def test_pictures_are_fetched_and_only_the_panorama_is_not(browser: Browser, logs: list[Path]) -> None:
    dashboard = open_dashboard(logs, port=0)
    page = open_view(browser, dashboard.link())
    size = page.evaluate(
        "fetch('data:image/jpeg;base64,' + 'A'.repeat(100000)).then((answer) => answer.arrayBuffer())"
        ".then((bytes) => bytes.byteLength)"
    )
    assert size == 75000
    page.close()
    dashboard.stop()


def test_planned_paths_come_after_the_first_picture(browser: Browser, logs: list[Path]) -> None:
    dashboard = open_dashboard(logs, port=0)
    page = open_view(browser, dashboard.link())
    page.wait_for_function(
        "window.liosDrawn && window.__viserSceneTree.getState()['/runs/focus/ahead']?.effectiveVisibility"
    )
    page.close()
    dashboard.stop()
