"""The state of one browser (runs, moment, options) and the one thread that shows it.

Callbacks only change the state and wake the thread; it always shows the newest state, so that fast scrubbing skips
moments instead of queueing them. Errors while it draws are shown in the tab, and it goes on. When the browser
disconnects, the thread ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from threading import Condition, Thread

import numpy as np
import viser

from dashboards.geometry.house import HouseShape
from dashboards.library.library import Library
from dashboards.model.clock import Alignment, Clock
from dashboards.model.containers.container_pick import container_met
from dashboards.model.containers.item_marks import ItemMarks, item_marks
from dashboards.model.containers.seen_items import items_seen
from dashboards.model.containers.unopened import unopened
from dashboards.model.run_names import run_names
from dashboards.model.scene import Scene, scene_at
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour
from dashboards.sensing.robot_sensors import RobotSensors
from dashboards.viser_app.cameras import behind, close_to, view_of
from dashboards.viser_app.drawing.sensor_layers import SensorLayers
from dashboards.viser_app.drawing.sight_layer import SightLayer
from dashboards.viser_app.drawing.stage import Stage
from dashboards.viser_app.fitted_camera import FittedCamera
from dashboards.viser_app.view_errors import ViewErrors
from dashboards.viser_app.view_state import MAX_RUNS, ViewState
from replayers.log_tools.notes import RunNote
from workbench.arrays import Bools
from workbench.errors import LiosError
from workbench.log_schema.events import SeenItem
from workbench.tolerances import NEAR_COST, ROUNDING, TINY

SETTLED_AFTER_S = 0.25
"""A view that did not change for this long has settled."""
PATHS_AFTER_S = 5.0
"""The first planned paths, which take long to load, are shown when the page says that its first picture is drawn,
when another moment is asked for, or after this long without a change."""
FRAMES_A_SECOND = 25.0
"""How often a playing run is shown."""


class BrowserSession:
    """One browser: its state, its stage, and the other views of its scenes."""

    def __init__(self, client: viser.ClientHandle, library: Library, state: ViewState) -> None:
        self.client = client
        self.library = library
        self.stage = Stage(client)
        self.camera = FittedCamera(client, self._shape)
        self.sensors = SensorLayers(client, self._show_again)
        self.sight = SightLayer(client.scene)
        self.robot_sensors: RobotSensors | None = None
        self.unopened: Bools = np.zeros(0, dtype=np.bool_)
        """Containers of the place that none of the runs opened."""
        self.clock = Clock(timelines=())
        self.state = state
        self.watchers: list[Callable[[BrowserSession, list[Scene]], None]] = []
        self.openers: list[Callable[[BrowserSession], None]] = []
        self.choosers: list[Callable[[str], None]] = []
        """Called with the label of the tab that should come to the front."""
        self.listers: dict[str, Callable[[str], None]] = {}
        """What arranges the table of runs, by the verb of its command."""
        self.settlers: list[Callable[[BrowserSession], None]] = []
        self.view_errors = ViewErrors(str(client.client_id))
        self.error_listeners: list[Callable[[str], None]] = []
        """Called with an error as one line; with an empty one when it is resolved."""
        self._wake = Condition()
        self._dirty, self._stirred, self._alive = True, False, True
        self._opened: tuple[tuple[int, ...], int] | None = None
        self._readable: tuple[int, ...] = ()
        """The runs on show."""
        self._revision = 0
        self._walls = ""
        self._planned_paths = False
        """Whether planned paths are shown."""
        self._thread = Thread(target=self._show_forever, name=f"view-{client.client_id}", daemon=True)

    def start(self) -> None:
        """Shows the first moment, in one message, and then whatever is asked for."""
        with self.client.atomic():
            self.stage.light()
            self.client.scene.on_click()(self._clicked)
            self.camera.begin()
            self._run_safely(self._show)
        self.client.flush()
        self._thread.start()

    def stop(self) -> None:
        """Ends the thread; called when the browser has disconnected."""
        with self._wake:
            self._alive = False
            self._wake.notify_all()

    def change(self, *, at: float | None = None, **changes: object) -> None:
        """Changes the state and shows it soon; going to another moment than the end stops following a live run."""
        with self._wake:
            if at is not None:
                self._planned_paths = True
                changes = {"at": at, "live": self.state.live and self._is_over(at), **changes}
            self.state = replace(self.state, **changes)
            self._dirty = True
            self._wake.notify_all()

    def toggle_playing(self) -> None:
        """Plays or pauses; at the end it plays from the start."""
        with self._wake:
            begins = not self.state.playing
            self.change(at=0.0 if begins and self._is_over(self.state.at) else None, playing=begins)

    def mark_unsettled(self) -> None:
        """The camera, which is not part of the state, has moved: the view has to settle again."""
        with self._wake:
            self._stirred = True
            self._wake.notify_all()

    def align(self, alignment: Alignment) -> None:
        """Puts the runs on another clock; the run in focus stays at its moment."""
        with self._wake:
            if not self.clock.timelines:
                self.change(alignment=alignment)
                return
            other = Clock(timelines=self.clock.timelines, alignment=alignment)
            self.change(alignment=alignment, at=other.reading(self.clock.stamps(self.state.at)[0]))

    def _show_again(self) -> None:
        """Something that belongs to the view has become ready."""
        with self._wake:
            self._dirty = True
            self._wake.notify_all()

    def show_planned_paths(self) -> None:
        """Shows planned paths from now on."""
        self._planned_paths = True
        self._show_again()

    def reread(self) -> None:
        """Shows the runs as their logs now are."""
        with self._wake:
            self._revision += 1
            self._dirty = True
            self._wake.notify_all()

    def seek(self, reading: float) -> None:
        self.change(at=min(max(reading, 0.0), self.clock.end))

    def step(self, stops: tuple[float, ...], direction: int) -> None:
        """Goes to the next stop after, or the last before, the moment shown; pauses."""
        with self._wake:
            at, near = self.state.at, NEAR_COST * max(1.0, self.clock.end)
            ends = (*stops, 0.0, self.clock.end)
            ahead = [s for s in ends if (s > at + near if direction > 0 else s < at - near)]
            if ahead:
                self.change(at=min(ahead) if direction > 0 else max(ahead), playing=False)

    def open_runs(self, runs: tuple[int, ...]) -> None:
        """Shows other runs, from their start; errors of those that cannot be read are shown, and they are left
        out."""
        good = tuple(i for i in runs if 0 <= i < len(self.library.paths) and self._can_read(i))
        if good:
            self.change(runs=good, at=0.0, playing=False)

    def toggle_run(self, run: int) -> None:
        """Overlays a run, or removes it; one always stays."""
        if not 0 <= run < len(self.library.paths) or not self._can_read(run):
            return
        with self._wake:
            shown = self.state.runs
            left = tuple(r for r in shown if r != run) if run in shown else (*shown, run)
            if 1 <= len(left) <= MAX_RUNS:
                self.change(runs=left)
                return
        if left:
            self.tell("No more runs fit", f"At most {MAX_RUNS} are shown at once. Remove one first.")

    def open_container(self, index: int, *, turn_camera: bool = True) -> None:
        """Opens a container of the place in its panel, and turns the camera to it."""
        containers = self.clock.timelines[0].plan.containers if self.clock.timelines else ()
        if not 0 <= index < len(containers):
            return
        self.change(container=containers[index].id)
        if turn_camera:
            pose = containers[index].pose
            self.camera.look_away(close_to(pose.x_m, pose.y_m))
        for chooser in self.choosers:
            chooser("Container")

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        """A click in the view opens the container under it."""
        if self.clock.timelines:
            met = container_met(self.clock.timelines[0].plan, event.ray_origin, event.ray_direction)
            if met is not None:
                self.open_container(met, turn_camera=False)

    def truth(self) -> Mapping[str, tuple[SeenItem, ...]] | None:
        """The true contents of the containers of the run in focus; None where its log does not hold them."""
        return self.library.truth(self._readable[0]) if self._readable else None

    def notes(self) -> list[tuple[RunNote, ...]]:
        """The notes on each run on show."""
        return [self.library.notes(run) for run in self._readable]

    def add_note(self, words: str, *, author: str = "") -> bool:
        """Writes a note about the moment shown into the log of the run in focus; whether that was possible."""
        if not self._readable:
            return False
        stamp_ns = self.clock.stamps(self.state.at)[0]
        try:
            self.library.add_note(self._readable[0], words, stamp_ns=stamp_ns, author=author)
        except LiosError as error:
            self.tell("The note was not written", str(error))
            return False
        self.reread()
        return True

    def _can_read(self, run: int) -> bool:
        """Whether a log can be shown; if not, the browser says why. One log must not break the view of the others."""
        read = False
        with self.view_errors.caught(self.library.paths[run].name, lambda line: self.tell("A log is left out", line)):
            self.library.timeline(run)
            read = True
        return read

    def _shape(self) -> HouseShape | None:
        """The house on show."""
        return self.library.shape(self.clock.timelines[0].plan) if self.clock.timelines else None

    def tell(self, title: str, words: str) -> None:
        """Says something in the browser for a few seconds."""
        self.client.add_notification(title, words, color="red", auto_close_seconds=8)

    def _is_over(self, at: float) -> bool:
        return at >= self.clock.end * (1 - ROUNDING)

    def look(self, *, from_above: bool = False) -> None:
        """Fits the camera to the house."""
        self.camera.fit(from_above=from_above)

    def _open(self, state: ViewState) -> None:
        """Opens the runs of a state, if they are not open already."""
        wanted = (state.runs, self._revision)
        if self._opened == wanted and self.clock.alignment == state.alignment:
            return
        readable = [run for run in state.runs if not self.library.is_expected(run) and self._can_read(run)]
        timelines = tuple(self.library.timeline(run) for run in readable)
        same = self._opened is not None and self._readable == tuple(readable)
        self._readable = tuple(readable)
        before = self.clock.timelines[:1]
        self.clock = Clock(timelines=timelines, alignment=state.alignment)
        self.unopened = unopened(timelines)
        if timelines and not same:
            self._prepare_stage(timelines, first=self._opened is None, before=before)
        self.robot_sensors = self.library.robot_sensors(readable[0]) if readable else None
        self.sensors.open(self.robot_sensors)
        self._opened = wanted
        if state.live:
            self.change(at=self.clock.end, live=True)
        for opener in self.openers:
            opener(self)

    def _prepare_stage(self, timelines: tuple[Timeline, ...], *, first: bool, before: tuple[Timeline, ...]) -> None:
        """The house of the run in focus, if another one is shown, and an actor for each run."""
        plan = timelines[0].plan
        elsewhere = not before or plan != before[0].plan or timelines[0].run.task != before[0].run.task
        if elsewhere:
            self.stage.show_house(timelines[0].run.place, timelines[0].run.task, self.library.shape(plan))
            self.sight.open(self.library.shape(plan).tops_m)
            self._walls = ""
        self.stage.set_runs(
            [run_colour(i) for i in range(len(timelines))],
            run_names([t.run for t in timelines]),
            [t.plan == plan for t in timelines],
        )
        if elsewhere and not first:
            self.look()

    def _show_forever(self) -> None:
        last, unsettled = time.monotonic(), True
        while True:
            with self._wake:
                woken = True
                if self._alive and not (self._dirty or self._stirred or self.state.playing):
                    quiet_s = None if self._planned_paths else PATHS_AFTER_S
                    woken = self._wake.wait(SETTLED_AFTER_S if unsettled else quiet_s)
                    last = time.monotonic()
                if not self._alive:
                    return
                changed = self._dirty or self.state.playing
                self._dirty = self._stirred = False
            if not changed:
                if not woken and unsettled:
                    self._run_safely(self._settle)
                elif not woken:
                    self.show_planned_paths()
                unsettled = woken
                continue
            now, unsettled = time.monotonic(), True
            self._run_safely(lambda passed_s=now - last: self._show_next(passed_s))
            last = now
            if self.state.playing:
                time.sleep(max(0.0, 1 / FRAMES_A_SECOND - (time.monotonic() - now)))

    def _items(self, scene: Scene) -> ItemMarks:
        """The items that the run in focus has seen by a moment, as far as they are wanted."""
        state, timeline = self.state, self.clock.timelines[0]
        containers = timeline.plan.containers
        named = [i for i, c in enumerate(containers) if state.item_names or c.id == state.container]
        seen = items_seen(timeline, scene.stamp_ns) if state.items else ()
        return item_marks(timeline.plan, seen, named=named, focus=scene.focus)

    def _run_safely(self, act: Callable[[], None]) -> None:
        """Does a thing; when it fails, the tab says so, and drawing goes on."""
        lines: list[str] = []
        with self.view_errors.caught("this moment", lines.append):
            act()
        for listener in self.error_listeners:
            with self.view_errors.caught("what went wrong", lines.append):
                listener("".join(lines[:1]))

    def _show_room_names(self) -> None:
        view = view_of(self.client.camera) if self.state.room_names else None
        self.stage.show_room_names(view, self.state.walls)

    def _settle(self) -> None:
        self.camera.refit(late=True)
        self._show_room_names()
        for settler in self.settlers:
            settler(self)

    def _show_next(self, passed_s: float) -> None:
        self._advance_playback(passed_s)
        self._show()

    def _advance_playback(self, seconds: float) -> None:
        """Moves a playing run on; at its end it stops or begins again."""
        with self._wake:  # a seek between reading the state and changing it would be lost
            state = self.state
            if not state.playing or not self.clock.timelines:
                return
            duration_s = max(self.clock.timelines[0].duration_s, TINY)
            pace = 1.0 if state.alignment == "time" else self.clock.end / duration_s
            at = state.at + seconds * state.speed * pace
            if at < self.clock.end:
                self.change(at=at)
            elif state.loop:
                self.change(at=0.0)
            else:
                self.change(at=self.clock.end, playing=False)

    def _show(self) -> None:
        self._open(self.state)
        if not self.clock.timelines:
            return
        state = self.state
        if state.walls != self._walls:
            self.stage.show_walls(state.walls)
            self._walls = state.walls
        self.stage.show_occupancy(state.occupancy or not self.clock.timelines[0].run.place.plan.walls)
        stamps = self.clock.stamps(state.at)
        scenes = [
            scene_at(t, s, focus=state.focus, ahead=self._planned_paths)
            for t, s in zip(self.clock.timelines, stamps, strict=True)
        ]
        with self.client.atomic():  # one message: the browser draws the moment once, not part by part
            self.stage.show(scenes, self.unopened & state.unopened, bars=state.bars, orders=state.orders)
            self.stage.show_items(self._items(scenes[0]))
            self.sight.show(self.clock.timelines[0], scenes[0], visible=state.sight)
            self.sensors.show(
                scenes[0].stamp_ns, scenes[0].robot, pictures=state.pictures, points=state.points, grid=state.grid
            )
            if state.follow:
                self.camera.look_away(behind(scenes[0].robot))
            for watcher in self.watchers:
                watcher(self, scenes)
            self._show_room_names()
        self.client.flush()
