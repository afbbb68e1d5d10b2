"""The dashboard in a real browser: every panel, every control, two tabs, a reload, a server that comes back."""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import psutil
import pytest
import viser
from chromium import chromium, colours_in, open_view, until_seen, wait_for_second
from playwright.sync_api import Browser, Page

from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard
from recorders.simulated_run import RequestedTask, record_trial, trial_for
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

pytestmark = [
    pytest.mark.browser,
    pytest.mark.timeout(1200),
    pytest.mark.filterwarnings("ignore:Queued .* on a closed connection"),
]


MIDDLE = (0.05, 0.2, 0.6, 0.7)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("view")
    house = load_house(f"{shipped_houses()}:1")
    made: list[Path] = []
    for strategy in ("model-lios", "opt-greedy"):
        trial = trial_for(RequestedTask(find="book"), house, strategy=strategy, estimator="counts")
        path = folder / f"{strategy}.mcap"
        record_trial(trial, path)
        made.append(path)
    return made


@pytest.fixture(scope="module")
def dashboard(logs: list[Path]) -> Iterator[Dashboard]:
    made = open_dashboard(logs, port=0)
    yield made
    made.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as running:
        yield running


@pytest.fixture(scope="module")
def page(browser: Browser, dashboard: Dashboard) -> Iterator[Page]:
    opened = open_view(browser, dashboard.link())
    yield opened
    opened.close()


def test_the_house_is_drawn_and_the_slider_moves_the_run(page: Page) -> None:
    before = until_seen(page, lambda picture: colours_in(picture, MIDDLE) > 200)  # an empty page has one
    facts = page.locator(".lp .facts").inner_text()
    slider = page.get_by_role("slider").first
    slider.focus()
    for _ in range(30):
        slider.press("ArrowRight")
    wait_for_second(page, 0.2, 9e9)
    page.wait_for_function("(b) => document.querySelector('.lp .facts').innerText !== b", arg=facts)
    until_seen(page, lambda picture: picture != before)


@pytest.mark.ci_but(2)
@pytest.mark.parametrize(
    ("tab", "words"),
    [
        ("Belief", "container"),
        ("Plan", "Intended order of search"),
        ("Find costs", "costs from"),
        ("Plots", "Cost so far"),
        ("Compare", "They diverge"),
        ("Runs", "of 2 runs"),
        ("View", "Walls"),
    ],
)
def test_every_panel_says_its_part(page: Page, tab: str, words: str) -> None:
    page.evaluate("window.liosCommand('seek 1')")
    page.get_by_role("tab", name=tab, exact=True).or_(page.get_by_text(tab, exact=True)).first.click()
    page.get_by_text(words).first.wait_for()


def test_steps_by_button_and_by_key(page: Page) -> None:
    page.get_by_text("« first", exact=True).click()
    wait_for_second(page, 0.0, 0.0)
    page.get_by_text("next ›", exact=True).click()
    page.get_by_text("Decision 2 of").wait_for()
    page.mouse.move(250, 300)
    page.keyboard.press("l")
    page.get_by_text("Decision 3 of").wait_for()
    page.keyboard.press("j")
    page.get_by_text("Decision 2 of").wait_for()
    page.keyboard.press("End")
    page.get_by_text("done", exact=True).first.wait_for()
    page.keyboard.press("Home")
    wait_for_second(page, 0.0, 0.0)


def test_play_moves_on_and_pause_stops(page: Page, dashboard: Dashboard) -> None:
    page.evaluate("window.liosCommand('seek 0')")
    wait_for_second(page, 0.0, 0.0)
    page.get_by_role("button", name="Play").click()
    (session,) = dashboard.sessions.values()
    end = time.monotonic() + 60
    while session.state.at < 0.5 and time.monotonic() < end:
        page.wait_for_timeout(100)
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    wait_for_second(page, 0.3, 60.0)


@pytest.mark.ci
def test_a_click_on_the_strip_seeks(page: Page) -> None:
    box = page.locator("[data-strip]:visible").last.bounding_box()
    assert box
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
    end = float(page.locator("[data-strip]:visible").last.get_attribute("data-strip") or 0)
    wait_for_second(page, 0.45 * end, 0.55 * end)


@pytest.mark.ci
def test_a_heading_sorts_its_table_and_stays_sorted(page: Page) -> None:
    page.get_by_text("Belief", exact=True).first.click()
    page.evaluate("window.liosCommand('seek 0')")
    names = "[...document.querySelectorAll('table[data-table=beliefs] tbody tr')].map((r) => r.cells[1].innerText)"
    page.locator("table[data-table=beliefs] th", has_text="container").click()
    shown = page.evaluate(names)
    assert shown == sorted(shown, key=str.lower)
    page.evaluate("window.liosCommand('decision 2')")
    page.get_by_text("Decision 2 of").wait_for()
    page.wait_for_timeout(500)
    again = page.evaluate(names)
    assert again == sorted(again, key=str.lower)


@pytest.mark.ci
def test_where_runs_part_can_be_jumped_to(page: Page) -> None:
    page.evaluate("window.liosCommand('seek 0')")
    page.get_by_text("Compare", exact=True).first.click()
    link = page.locator("[data-lios^='seek']:visible").first
    wanted = float((link.get_attribute("data-lios") or "").split()[1])
    link.click()
    wait_for_second(page, wanted - 0.01, wanted + 0.01)


@pytest.mark.ci
def test_the_token_is_not_in_the_address_bar_nor_in_reach_of_scripts(page: Page, dashboard: Dashboard) -> None:
    token = str(dashboard.token)
    assert token not in page.evaluate("location.href + document.cookie + document.referrer")
    assert token not in page.content()


@pytest.mark.ci
def test_a_page_of_another_website_gets_nothing(browser: Browser, dashboard: Dashboard) -> None:
    """In one and the same browser, cookie included: a page from another port of this machine asks for the home."""
    context = browser.new_context()
    context.set_default_timeout(90_000)
    own, stranger = context.new_page(), context.new_page()
    own.goto(dashboard.link())
    own.wait_for_function("!location.search.includes('token=')")
    with _another_website() as url:
        stranger.goto(url)
        attempt = f"""() => new Promise((done) => {{
            const socket = new WebSocket("{dashboard.url.replace("http", "ws")}/", ["viser-v{viser.__version__}"]);
            socket.onmessage = () => done("told");
            socket.onerror = () => done("refused");
        }})"""
        assert stranger.evaluate(attempt) == "refused"
    assert own.evaluate(attempt) == "told"
    context.close()


@contextmanager
def _another_website() -> Iterator[str]:
    class Empty(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>another</title>")

        def log_message(self, *_: object) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Empty) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.mark.ci
def test_a_reload_shows_the_same_moment(page: Page) -> None:
    page.evaluate("window.liosCommand('seek 7.5')")
    wait_for_second(page, 7.5, 7.5)
    page.reload()
    page.locator(".lp .facts").wait_for()
    page.wait_for_timeout(1500)
    wait_for_second(page, 7.49, 7.51)
    page.wait_for_function(
        "document.querySelector('.lp .cursor') && parseFloat(getComputedStyle("
        "document.querySelector('.lp .cursor')).left) > 5"
    )


@pytest.mark.slow
def test_two_tabs_do_not_disturb_one_another(browser: Browser, dashboard: Dashboard, page: Page) -> None:
    page.evaluate("window.liosCommand('seek 3')")
    wait_for_second(page, 3.0, 3.0)
    other = open_view(browser, dashboard.link("at=11&runs=1"))
    wait_for_second(other, 11.0, 11.0)
    other.get_by_text("opt-greedy").first.wait_for()
    page.wait_for_timeout(500)
    wait_for_second(page, 3.0, 3.0)
    assert "model-lios" in page.locator(".lp h2 + p").first.inner_text()
    other.close()


@pytest.mark.slow
def test_when_the_server_comes_back_so_does_the_view(
    browser: Browser, logs: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIOS_DASHBOARD_TOKEN", "the-same-again-and-again")
    first = open_dashboard(logs, port=0)
    port = first.server.get_port()
    tab = open_view(browser, first.link())
    tab.evaluate("window.liosCommand('seek 6')")
    wait_for_second(tab, 6.0, 6.0)
    first.stop()
    second = _again(logs, port)
    try:
        deadline = time.monotonic() + 60
        while not second.sessions and time.monotonic() < deadline:
            tab.wait_for_timeout(200)
        (session,) = second.sessions.values()
        while session.state.at != 6.0 and time.monotonic() < deadline:
            tab.wait_for_timeout(200)
        assert session.state.at == 6.0
    finally:
        tab.close()
        second.stop()


@pytest.mark.slow
def test_twenty_visits_leave_nothing_behind(browser: Browser, dashboard: Dashboard) -> None:
    sizes: list[int] = []
    for visit in range(20):
        tab = browser.new_page(viewport={"width": 500, "height": 400})
        tab.goto(dashboard.link())
        tab.locator("canvas").first.wait_for()
        tab.wait_for_timeout(400)
        if visit % 3 == 0:
            tab.evaluate("window.liosCommand?.('seek 2')")
        tab.close()
        gc.collect()
        sizes.append(psutil.Process().memory_info().rss)

    def views() -> list[str]:
        return [t.name for t in threading.enumerate() if t.name.startswith("view-")]

    deadline = time.monotonic() + 20
    while (len(dashboard.sessions) > 1 or len(views()) > 2) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert len(dashboard.sessions) <= 1, "only the tab of the other tests is still there"
    assert len(views()) <= 2
    grown_mb = (sizes[-1] - sizes[4]) / 1e6
    assert grown_mb < 40, f"memory grew by {grown_mb:.0f} MB over fifteen visits"


def _again(logs: list[Path], port: int) -> Dashboard:
    """A new server where the old one was, as soon as the port is free."""
    for _ in range(50):
        try:
            return open_dashboard(logs, port=port)
        except OSError:
            time.sleep(0.2)
    return open_dashboard(logs, port=port)


LOGS = Path(__file__).resolve().parents[2] / "logs"


@pytest.mark.slow
def test_a_link_sets_the_controls_too(browser: Browser, dashboard: Dashboard) -> None:
    tab = open_view(browser, dashboard.link("at=3&walls=whole&clock=distance"))
    tab.get_by_role("tab", name="View", exact=True).click()
    tab.wait_for_function(
        "[...document.querySelectorAll('input')].some((i) => i.value === 'whole')"
        " && [...document.querySelectorAll('input')].some((i) => i.value === 'distance')"
    )
    tab.close()


@pytest.mark.ci
def test_another_clock_keeps_the_moment(page: Page, dashboard: Dashboard) -> None:
    page.evaluate("window.liosCommand('decision 3')")
    page.get_by_text("Decision 3 of").wait_for()
    session = next(s for s in dashboard.sessions.values() if s.state.at > 0)
    for alignment in ("distance", "decision", "time"):
        session.align(alignment)  # type: ignore[arg-type]
        page.wait_for_timeout(700)
        assert page.get_by_text("Decision 3 of").count() == 1


@pytest.mark.ci
@pytest.mark.parametrize(("width", "height"), [(1500, 800), (1000, 700)])
def test_cameras_of_a_robot_are_beside_the_house_and_can_be_hidden(browser: Browser, width: int, height: int) -> None:
    made = open_dashboard([LOGS / "spot-home-A.mcap"], port=0, at=60.0)
    tab = open_view(browser, made.link("theme=dark"), width=width, height=height)
    try:
        picture = tab.locator(".lp.cameras img").first
        picture.wait_for()
        tab.wait_for_function("document.querySelector('.lp.cameras img').naturalWidth > 100")
        tab.wait_for_function(
            "document.querySelector('.lp.cameras').getBoundingClientRect().left"
            " >= document.querySelector('.lios-canvas').getBoundingClientRect().right"
        )
        assert tab.locator(".lp h2").first.inner_text().startswith("water bottle")
        tab.get_by_text("Spot (simulated)").wait_for()
        tab.get_by_role("tab", name="View", exact=True).click()
        tab.get_by_label("Pictures").click()
        picture.wait_for(state="hidden")
        (session,) = made.sessions.values()
        session.change(grid=True, pictures=True)
        picture.wait_for()
    finally:
        tab.close()
        made.stop()


@pytest.mark.slow
def test_an_evaluation_opens_with_its_scatter_and_a_point_opens_its_trial(browser: Browser, tmp_path: Path) -> None:
    from workbench import cli

    words = "evaluate tasks --scenarios any-of-3 -s model-lios,opt-greedy -n 2 --split all --estimator counts"
    assert cli.run([*words.split(), "--paper-estimator", "counts", "--record", "-o", str(tmp_path / "out")]) == 0
    made = open_dashboard([tmp_path / "out"], port=0)
    tab = open_view(browser, made.link(), width=1400, height=900)
    try:
        points = tab.locator(".lp circle")
        points.first.wait_for()
        assert points.count() == 2
        points.nth(1).click()
        (session,) = made.sessions.values()
        end = time.monotonic() + 60
        while len(session.clock.timelines) < 2 and time.monotonic() < end:
            tab.wait_for_timeout(100)
        strategies = [t.run.info.strategy for t in session.clock.timelines]
        assert strategies == ["opt-greedy", "model-lios"]
        assert len({t.run.info.place for t in session.clock.timelines}) == 1
    finally:
        tab.close()
        made.stop()


@pytest.mark.slow
def test_browsers_that_leave_midway_leave_nothing_behind(browser: Browser, logs: list[Path]) -> None:
    failed: list[BaseException] = []
    before, threading.excepthook = threading.excepthook, lambda args: failed.append(args.exc_value)  # type: ignore[arg-type]
    made = open_dashboard(logs, port=0)
    try:
        for stay_ms in (0, 30, 120, 300, 700, 1500):
            tab = browser.new_page(viewport={"width": 600, "height": 400})
            tab.goto(made.link(), wait_until="commit")
            tab.wait_for_timeout(stay_ms)
            tab.close()
        deadline = time.monotonic() + 30
        while made.sessions and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not made.sessions
        assert failed == []
    finally:
        threading.excepthook = before
        made.stop()
