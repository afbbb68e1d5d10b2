"""The pictures, clouds and grids of one log at a moment of its run.

Point clouds accumulate to a map of the site: every 5 cm cube of space is kept once, with the moment at which it was
first seen, sorted by it, so that the site as known at any moment is a prefix of one array.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from dashboards.sensing.clouds import NOTHING, cloud_points, depth_points
from dashboards.sensing.frames import Frames
from dashboards.sensing.grids import GridCells, grid_cells
from dashboards.sensing.pictures import Picture, picture_of
from recorders.spot.session.topics import SessionStatus
from replayers.runs.sensor_index import (
    CLOUD,
    GRID,
    LENS,
    PICTURE,
    SESSION_STATUS,
    SPOT_IMAGE,
    SensorTracks,
    TopicIndex,
    sensor_tracks,
)
from workbench.arrays import Floats32, Indices, Ints
from workbench.caches import Cache

STALE_NS = 5_000_000_000
"""A grid older than this is not shown: the robot has walked on."""
CUBE_M = 0.05
FLOOR_M, CUT_M = 0.06, 1.5
"""Points on the floor and near the ceiling are left out of the site, which is viewed from above."""
MAX_CLOUDS = 240
"""The most clouds read for the site; of more, evenly spaced ones are taken."""
MAX_SITE_POINTS = 250_000
KEPT_PICTURES, KEPT_GRIDS = 64, 16


class RobotSensors:
    """The sensors of one log; everything is read on request."""

    def __init__(self, tracks: SensorTracks) -> None:
        self._tracks = tracks
        self._frames = Frames(tracks)
        self._raw = {t.topic.rpartition("/")[2]: t for t in tracks.of_kind(SPOT_IMAGE)}
        self._lenses = {t.topic: t for t in tracks.of_kind(LENS)}
        self._site: tuple[Ints, Floats32] | None = None
        self._pictures: Cache[tuple[str, int], Picture | None] = Cache(KEPT_PICTURES)
        self._cells: Cache[tuple[str, int], GridCells | None] = Cache(KEPT_GRIDS)

    @property
    def path(self) -> Path:
        """The log."""
        return self._tracks.path

    @property
    def cameras(self) -> tuple[str, ...]:
        """Topics of pictures."""
        return tuple(t.topic for t in self._tracks.of_kind(PICTURE))

    @property
    def has_clouds(self) -> bool:
        """Whether there may be points: clouds, or pictures of Spot's depth cameras."""
        return bool(self._tracks.of_kind(CLOUD)) or any("depth" in name for name in self._raw)

    @property
    def has_grids(self) -> bool:
        return bool(self._grids())

    def pictures(self, stamp_ns: int) -> tuple[Picture, ...]:
        """The newest picture of every camera at a moment."""
        found = (self._picture(t.topic, t.last_at(stamp_ns)) for t in self._tracks.of_kind(PICTURE))
        return tuple(picture for picture in found if picture is not None)

    def grid(self, stamp_ns: int) -> GridCells | None:
        """The newest local grid, if it is not too old."""
        for track in self._grids():
            index = track.last_at(stamp_ns)
            if index >= 0 and stamp_ns - int(track.stamps_ns[index]) <= STALE_NS:
                return self._grid(track.topic, index)
        return None

    @property
    def has_status(self) -> bool:
        """Whether the log records how its session went."""
        return bool(self._tracks.of_kind(SESSION_STATUS))

    def status(self, stamp_ns: int) -> SessionStatus | None:
        """The newest state of the session at a moment; None before the first, or where it is damaged."""
        for track in self._tracks.of_kind(SESSION_STATUS):
            index = track.last_at(stamp_ns)
            data = self._tracks.data(track, index) if index >= 0 else None
            if data is not None:
                try:
                    return msgspec.json.decode(data, type=SessionStatus)
                except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
                    return None
        return None

    def gather_site(self) -> None:
        """Reads the clouds for `site`; takes up to some seconds, once."""
        if self._site is None:
            self._site = _gathered(list(self._clouds()))

    def site(self, stamp_ns: int) -> Floats32:
        """The points of the site that clouds have shown up to a moment; none before gather_site."""
        if self._site is None:
            return NOTHING
        stamps, points = self._site
        return points[: int(np.searchsorted(stamps, stamp_ns, side="right"))]

    def _clouds(self) -> Iterator[tuple[int, Floats32]]:
        tracks = [t for t in (*self._tracks.of_kind(CLOUD), *self._tracks.of_kind(SPOT_IMAGE)) if _may_hold_points(t)]
        for track in tracks:
            count = len(track.stamps_ns)
            for index in np.unique(np.linspace(0, count - 1, min(count, MAX_CLOUDS // len(tracks) or 1)).astype(int)):
                message = self._tracks.message(track, int(index))
                stamp = int(track.stamps_ns[index])
                if message is not None:
                    read = cloud_points if track.schema.name == CLOUD else depth_points
                    yield stamp, _voxels(read(message, self._frames, stamp))

    def _grids(self) -> list[TopicIndex]:
        return [t for t in self._tracks.of_kind(GRID) if t.topic != "/map"]

    def _picture(self, topic: str, index: int) -> Picture | None:
        return self._pictures.get((topic, index), lambda: self._read_picture(topic, index))

    def _read_picture(self, topic: str, index: int) -> Picture | None:
        track = self._tracks.tracks[topic]
        message = self._tracks.message(track, index) if index >= 0 else None
        if message is None:
            return None
        stamp = int(track.stamps_ns[index])
        raw = self._nearest(self._raw.get(topic.rpartition("/")[2]), stamp)
        lens = self._nearest(self._lenses.get(f"{topic}/calibration"), stamp)
        return picture_of(message, topic, stamp, self._frames, lens=lens, raw=raw)

    def _grid(self, topic: str, index: int) -> GridCells | None:
        return self._cells.get((topic, index), lambda: self._read_grid(topic, index))

    def _read_grid(self, topic: str, index: int) -> GridCells | None:
        track = self._tracks.tracks[topic]
        message = self._tracks.message(track, index)
        return grid_cells(message, self._frames, int(track.stamps_ns[index])) if message is not None else None

    def _nearest(self, track: TopicIndex | None, stamp_ns: int) -> Any | None:
        """The newest message of a track at a moment, or its first."""
        return None if track is None else self._tracks.message(track, max(0, track.last_at(stamp_ns)))


def sensors_of(path: Path) -> RobotSensors | None:
    """The sensors of a log; None for a log without any."""
    tracks = sensor_tracks(path)
    robot_sensors = RobotSensors(tracks)
    return (
        robot_sensors
        if robot_sensors.cameras or robot_sensors.has_clouds or robot_sensors.has_grids or robot_sensors.has_status
        else None
    )


def _may_hold_points(track: TopicIndex) -> bool:
    return track.schema.name == CLOUD or "depth" in track.topic


def _voxels(points: Floats32) -> Floats32:
    """One point for each cube of space, the first, between floor and ceiling: this keeps far less of a cloud."""
    points = points[(points[:, 2] > FLOOR_M) & (points[:, 2] < CUT_M)]
    return points[_first_of_voxels(points)]


def _first_of_voxels(points: Floats32) -> Indices:
    """The index of the first point in each cube, in order."""
    _, first = np.unique(np.round(points / CUBE_M).astype(np.int64), axis=0, return_index=True)
    return np.sort(first)


def _gathered(clouds: list[tuple[int, Floats32]]) -> tuple[Ints, Floats32]:
    """Each cube of space once, by the first moment in which a point lay in it.

    Args:
        clouds: stamps in nanoseconds with points, each cube of a cloud once.
    """
    clouds = sorted((c for c in clouds if len(c[1])), key=lambda cloud: cloud[0])
    if not clouds:
        return np.zeros(0, dtype=np.int64), NOTHING
    points = np.concatenate([p for _, p in clouds])
    stamps = np.repeat(np.array([s for s, _ in clouds], dtype=np.int64), [len(p) for _, p in clouds])
    first = _first_of_voxels(points)
    first = first[:: max(1, -(-len(first) // MAX_SITE_POINTS))]
    return stamps[first], points[first]
