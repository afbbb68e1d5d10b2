"""Controls and panels of one browser: time, playback, steps, options, and tabs for what the robot thinks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from functools import partial
from math import ceil, log10
from types import MappingProxyType
from typing import Literal, final

import viser
from markupsafe import Markup

from dashboards.model.clock import Clock
from dashboards.model.containers.container_history import container_history
from dashboards.model.run_names import run_names
from dashboards.model.scene import Scene
from dashboards.palette import Colour, run_colour
from dashboards.panels.beliefs import beliefs
from dashboards.panels.cameras import cameras
from dashboards.panels.comparison import comparison, divergences, mismatches
from dashboards.panels.container import NO_TRUTH, NOTHING_CHOSEN, container
from dashboards.panels.live.ghosts import ghosts
from dashboards.panels.live.session_status import session_status
from dashboards.panels.markup import error_line, style
from dashboards.panels.memory import memory
from dashboards.panels.now import legend, now, run_signs, title
from dashboards.panels.phase_strip import cursor, strip
from dashboards.panels.plots import plots
from dashboards.tabs import SCENE_PANELS, TABS
from dashboards.viser_app.bridge import PAGE, address, choose_tab, execute_command, scale_bar, script, update_address
from dashboards.viser_app.cameras import scale_of
from dashboards.viser_app.panel.notes_tab import NotesTab
from dashboards.viser_app.panel.options import Options
from dashboards.viser_app.panel.runs_tab import RunsTab
from dashboards.viser_app.session import BrowserSession
from workbench.errors import BadValue
from workbench.tolerances import ROUNDING

SLIDER_STEPS, SLIDER_CHARACTERS = 2000, 6
BRAND: Mapping[bool, Colour] = MappingProxyType({False: (0, 114, 178), True: (86, 180, 233)})
"""The colour of buttons, in light and in dark."""
PANEL_PX = 440
"""Width of the panel beside the view."""
TABLES_EVERY_S = 0.25
"""How often the tables are drawn while a run plays, in seconds; every still moment has its own."""
TYPED_AFTER_S = 0.7
"""Somebody who pauses for this long has typed what they wanted."""
Key = Literal["space", "home", "end", "F", "J", "L", "O", "T", "U"]


def slider_scale(end: float) -> tuple[float, int]:
    """The slider's step, and how many decimals of the time the field beside it shows.

    The step is a power of ten of which the clock has about SLIDER_STEPS; the field has room for SLIDER_CHARACTERS.
    """
    places = round(log10(max(end, 1e-3) / SLIDER_STEPS))
    return 10.0**places, max(0, -places, SLIDER_CHARACTERS - 1 - len(str(int(end))))


@final
class Controls:
    """The panel of one browser. Builds itself, and follows its session.

    Changes by the server trigger callbacks too, without a client; only those by a person (`event.client`) change the
    session.
    """

    def __init__(self, session: BrowserSession) -> None:
        self._session = session
        self._gui = session.client.gui
        self._sent: dict[str, str] = {}
        self._html: dict[str, viser.GuiHtmlHandle] = {}
        self._names: list[str] = []
        self._signs = run_signs(())
        self._arrived = False
        self._chosen = 0
        self._size = (0, 0)
        self._dark: bool | None = None
        self._typing: threading.Timer | None = None
        self._tables_s = 0.0
        """When the tables were last drawn, by the monotonic clock."""
        self._plotted: tuple[Clock, str] | None = None
        self._build()
        session.openers.append(self._opened)
        session.watchers.append(self._shown)
        session.choosers.append(self._choose_tab)
        session.settlers.append(self._update_address)
        session.error_listeners.append(lambda line: self._set("trouble", error_line(line)))
        session.client.camera.on_update(self._camera_changed)

    def _build(self) -> None:
        gui = self._gui
        gui.set_panel_label("LIOS workbench")
        self._paint_theme(dark=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_PX)
        self._add("address")
        self._add("choose")
        self._add("scale")
        self._html["style"] = gui.add_html(str(style() + script()))
        self._add("title")
        self._add("trouble")
        self._add("ghosts")
        self._add("now")
        self._add("status")
        self._add("cameras")  # beside the house and never over it
        self._build_time()
        go = gui.add_text("Go to", "", hint="Seconds, or: decision 7, seek 12.5, open 2, overlay 3.")
        go.on_update(lambda _: self._execute_field(go))
        tabs = gui.add_tab_group()
        if self._session.library.folder is not None:
            self._runs = RunsTab(self._session, tabs)
        for name, label in TABS:
            with tabs.add_tab(label):
                self._add(name)
                if name == "comparison":
                    self._add("divergences")
        with tabs.add_tab("Container"):
            self._build_container()
        with tabs.add_tab("Notes"):
            self._notes = NotesTab(self._session)
            self._add("events")
        if self._session.library.folder is None:
            self._runs = RunsTab(self._session, tabs)
        if self._session.library.history is not None:
            with tabs.add_tab("Memory"):
                gui.add_html(str(memory(self._session.library.history)))
        with tabs.add_tab("View"):
            self._options = Options(self._session)
        panel = gui.add_panel()
        with panel.add_tab("Timeline"):
            self._add("strip")
            self._add("cursor")
            self._add("legend")
        panel.float(x=0, y=-1)  # dock.js puts it below the house

    def _paint_theme(self, *, dark: bool) -> None:
        if self._dark != dark:
            self._dark = dark
            self._gui.configure_theme(
                show_logo=False, show_share_button=False, brand_color=BRAND[dark], dark_mode=dark
            )

    def _build_container(self) -> None:
        self._add("container")
        self._truth = self._gui.add_checkbox(
            "Ground truth",
            self._session.state.truth,
            hint="What it really held, where the log says so.",
        )
        self._truth.on_update(self._ask_truth)

    def _ask_truth(self, event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        if event.client is not None:
            self._session.change(truth=self._truth.value)

    def _choose_tab(self, label: str) -> None:
        self._chosen += 1
        self._set("choose", choose_tab(label, self._chosen))

    def _show_container(self, session: BrowserSession, scene: Scene) -> None:
        """The opened container, and whether the truth about it is asked for."""
        state, timeline = session.state, session.clock.timelines[0]
        index = next((i for i, c in enumerate(timeline.plan.containers) if c.id == state.container), None)
        if self._truth.value != state.truth:
            self._truth.value = state.truth
        if index is None:
            self._set("container", NOTHING_CHOSEN)
            return
        truth = session.truth() if state.truth else None
        history = container_history(timeline, index, scene.stamp_ns, focus=scene.focus, truth=truth)
        untold = NO_TRUTH if state.truth and truth is None else ""
        self._set("container", container(history, session.clock, scene.focus) + untold)

    def _build_time(self) -> None:
        gui, session = self._gui, self._session
        self._slider = gui.add_slider("Time", 0.0, 1.0, 0.001, 0.0)
        self._slider.on_update(self._slid)
        steps = gui.add_button_group("Decision", ("« first", "‹ previous", "next ›", "last »"))
        steps.on_click(lambda event: self._step_decision(event.target.value))
        self._play = gui.add_button("Play")
        self._play.on_click(lambda _: session.toggle_playing())
        commands: tuple[tuple[str, Key, Literal["shift"] | None, Callable[[], None]], ...] = (
            ("Play or pause", "space", None, session.toggle_playing),
            ("Next decision", "L", None, lambda: self._step("decision", 1)),
            ("Previous decision", "J", None, lambda: self._step("decision", -1)),
            ("Next action", "L", "shift", lambda: self._step("action", 1)),
            ("Previous action", "J", "shift", lambda: self._step("action", -1)),
            ("One second on", "O", None, lambda: session.seek(session.state.at + 1)),
            ("One second back", "U", None, lambda: session.seek(session.state.at - 1)),
            ("To the start", "home", None, lambda: session.seek(0.0)),
            ("To the end", "end", None, lambda: session.seek(session.clock.end)),
            ("Fit the house", "F", None, session.look),
            ("From above", "T", None, lambda: session.look(from_above=True)),
        )
        for label, key, modifier, action in commands:
            command = gui.add_command(label, hotkey=key, modifier=modifier)
            command.on_trigger(lambda _, act=action: act())

    def _add(self, name: str) -> None:
        self._html[name] = self._gui.add_html("")

    def _set(self, name: str, content: Markup) -> None:
        if self._sent.get(name) != content:
            self._html[name].content = str(content)
            self._sent[name] = content

    def _draw(self, name: str, make: Callable[[], Markup]) -> None:
        """Fills a panel; one that cannot be drawn says so, and the others are drawn all the same."""
        with self._session.view_errors.caught(f"the panel {name}", lambda line: self._set(name, error_line(line))):
            self._set(name, make())

    def _opened(self, session: BrowserSession) -> None:
        """New runs: a new scale of time, new item types, a new strip."""
        clock = session.clock
        if not clock.timelines:
            return
        step, digits = slider_scale(clock.end) if clock.alignment != "decision" else (1.0, 0)
        self._slider.step, self._slider.precision = step, digits
        self._slider.max = round(ceil(round(clock.end / step, 6)) * step, digits)
        self._options.offer(clock.timelines[0].item_types)
        names = run_names([t.run for t in clock.timelines])
        self._set("title", title(clock.timelines[0], followed=session.library.followed) + mismatches(clock))
        self._names = names
        self._signs = run_signs(clock.timelines)
        self._runs.follow()
        colours = [run_colour(i) for i in range(len(names))]
        self._draw("strip", lambda: strip(clock, names, colours, session.notes()))
        self._draw("events", lambda: self._notes.panel(names))
        self._draw("divergences", lambda: divergences(clock, names))
        by_strategy = {t.run.info.strategy: c for t, c in zip(clock.timelines, colours, strict=True)}
        self._draw("ghosts", lambda: ghosts(session.library.ghosts, by_strategy))

    def _shown(self, session: BrowserSession, scenes: list[Scene]) -> None:
        scene, timeline, state = scenes[0], session.clock.timelines[0], session.state
        self._paint_theme(dark=(state.theme or state.system_theme) == "dark")
        self._draw("now", lambda: now(scene))
        self._draw("status", lambda: self._status(scene.stamp_ns))
        if self._tables_are_due(playing=state.playing):
            self._draw("beliefs", lambda: beliefs(scene, timeline))
            for name, panel in SCENE_PANELS.items():
                self._draw(name, partial(panel, scene, timeline))
            self._draw(
                "comparison",
                lambda: comparison(session.clock, scenes, self._names, not_shown=self._not_shown()),
            )
        if self._plotted is None or self._plotted[0] is not session.clock or self._plotted[1] != scene.focus:
            self._plotted = (session.clock, scene.focus)
            self._draw("plots", lambda: plots(session.clock, self._names, scene.focus))
        with session.view_errors.caught("the panel container", lambda line: self._set("container", error_line(line))):
            self._show_container(session, scene)
        self._show_cameras(scene.stamp_ns)
        self._options.follow()
        self._draw("legend", lambda: legend(scene, self._signs, items=state.items))
        self._draw("cursor", lambda: cursor(session.clock, state.at))
        reading = round(min(state.at, self._slider.max), self._slider.precision)
        if abs(self._slider.value - reading) > ROUNDING:
            self._slider.value = reading
        label = "Pause" if state.playing else "Play"
        if self._play.label != label:
            self._play.label = label

    def _tables_are_due(self, *, playing: bool) -> bool:
        """Whether to draw the tables: while a run plays, only as often as people can read them."""
        now_s = time.monotonic()
        if playing and now_s - self._tables_s < TABLES_EVERY_S:
            return False
        self._tables_s = now_s
        return True

    def _not_shown(self) -> int:
        """How many of the logs that can be opened are not on show."""
        library = self._session.library
        there = sum(not library.is_expected(index) for index in range(len(library.paths)))
        return there - len(self._session.clock.timelines)

    def _status(self, stamp_ns: int) -> Markup:
        """The state of the session of the run in focus; empty where its log does not record it."""
        robot_sensors, run = self._session.robot_sensors, self._session.clock.timelines[0].run
        if robot_sensors is None or not robot_sensors.has_status:
            return Markup("")
        live = self._session.state.live and not run.complete
        return session_status(robot_sensors.status(stamp_ns), stamp_ns, live=live, strategy=run.info.strategy)

    def _show_cameras(self, stamp_ns: int) -> None:
        """The newest pictures: shown only when the run has cameras and the option is on."""
        sensors = self._session.robot_sensors
        if sensors is not None and sensors.cameras and self._session.state.pictures:
            self._draw("cameras", lambda: cameras(sensors.pictures(stamp_ns), stamp_ns))
        else:
            self._set("cameras", Markup(""))

    def _slid(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:
            self._session.change(at=min(event.target.value, self._session.clock.end), playing=False)

    def _execute_field(self, go: viser.GuiTextHandle) -> None:
        """Executes the page's commands at once, and a person's once they stop typing."""
        words = go.value
        if self._typing is not None:
            self._typing.cancel()
        if words.startswith(PAGE):
            self._execute(words.removeprefix(PAGE))
            go.value = ""
        elif words.strip():
            self._typing = threading.Timer(TYPED_AFTER_S, self._execute_typed, (go, words))
            self._typing.daemon = True
            self._typing.start()

    def _execute_typed(self, go: viser.GuiTextHandle, words: str) -> None:
        if go.value == words and self._execute(words) and not words.strip()[0].isdecimal():
            go.value = ""

    def _execute(self, words: str) -> bool:
        """Whether the words were understood; if not, the browser says what is wanted."""
        try:
            execute_command(self._session, words)
        except BadValue as error:
            self._session.tell("Not understood", str(error))
            return False
        if words.startswith("address"):
            if not self._arrived and "initialCameraPosition" not in words and not self._session.state.follow:
                self._session.look()
            self._arrived = True
            self._session.mark_unsettled()
        return True

    def _camera_changed(self, camera: viser.CameraHandle) -> None:
        """The camera has moved, or its picture has another shape: a fitted house is fitted again."""
        size = (camera.image_width, camera.image_height)
        if size != self._size:
            self._size = size
            self._session.camera.refit()
        self._session.mark_unsettled()

    def _update_address(self, session: BrowserSession) -> None:
        """Updates the page's address once the view is stable and the page has sent its own address."""
        if self._arrived:
            self._set("address", update_address(address(session.state, session.client.camera)))
        scale = scale_of(session.client.camera)
        if scale is not None:
            self._set("scale", scale_bar(*scale))

    def _step(self, kind: Literal["decision", "action"], direction: int) -> None:
        clock = self._session.clock
        self._session.step(clock.decisions() if kind == "decision" else clock.actions(), direction)

    def _step_decision(self, label: str) -> None:
        if label.startswith("«"):
            stops = self._session.clock.decisions()
            self._session.change(at=stops[0] if stops else 0.0, playing=False)
        elif label.endswith("»"):
            self._session.change(at=self._session.clock.end, playing=False)
        else:
            self._step("decision", 1 if label.endswith("›") else -1)
