"""Poses between frames at a moment, chained from a log's transforms as a tree of frames.

A pose is a 4x4 matrix that takes points of the child to the parent. Quaternions are x, y, z, w.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from replayers.importers.frames import matrix_of
from replayers.runs.sensor_index import TRANSFORMS, SensorTracks, TopicIndex
from workbench.arrays import Floats
from workbench.caches import Cache

MAP = "map"
LOOK_BACK = 40
"""How many messages before a moment are searched for a frame's newest transform."""
STATIC = 20
"""How many first messages of a topic are searched for transforms that never change."""
MAX_CACHED_TRANSFORMS = 4000
"""Messages whose transforms are cached."""
MAX_TREE_DEPTH = 32


def matrix(position: Any, rotation: Any) -> Floats | None:
    """A pose from a protobuf's x, y, z and quaternion x, y, z, w; None for an invalid rotation."""
    length = rotation.x**2 + rotation.y**2 + rotation.z**2 + rotation.w**2
    if not 0.5 < length < 2.0 or not np.isfinite([position.x, position.y, position.z]).all():
        return None
    return matrix_of(position, rotation)


def chained(parents: Mapping[str, tuple[str, Floats]], child: str, ancestor: str) -> Floats | None:
    """The pose of a frame in one of its ancestors, or None when the tree does not lead there."""
    at = np.eye(4)
    for _ in range(MAX_TREE_DEPTH):
        if child == ancestor:
            return at
        if child not in parents:
            return None
        child, step = parents[child]
        at = step @ at
    return None


def spot_tree(snapshot: Any) -> dict[str, tuple[str, Floats]]:
    """The frames of a bosdyn FrameTreeSnapshot, each with its parent."""
    tree: dict[str, tuple[str, Floats]] = {}
    for child, edge in sorted(snapshot.child_to_parent_edge_map.items()):
        pose = matrix(edge.parent_tform_child.position, edge.parent_tform_child.rotation)
        if edge.parent_frame_name and pose is not None:
            tree[child] = (edge.parent_frame_name, pose)
    return tree


def spot_pose(snapshot: Any, child: str, ancestor: str) -> Floats | None:
    """ancestor_from_child within a bosdyn snapshot, whose root is the body: up from both, and down again."""
    tree = spot_tree(snapshot)
    for root in ("body", "odom", "vision"):
        a, b = chained(tree, ancestor, root), chained(tree, child, root)
        if a is not None and b is not None:
            return np.linalg.inv(a) @ b
    return None


class Frames:
    """The transforms of one log."""

    def __init__(self, tracks: SensorTracks) -> None:
        self._tracks = tracks
        self._of_message: Cache[tuple[str, int], dict[str, tuple[str, Floats]]] = Cache(MAX_CACHED_TRANSFORMS)
        self._static: dict[str, tuple[str, Floats]] | None = None

    def on_map(self, frame: str, stamp_ns: int) -> Floats | None:
        """map_from_frame at a moment, by the newest transforms before it; None when they do not lead to the map."""
        if frame in (MAP, ""):
            return np.eye(4)
        return chained(self._tree(stamp_ns), frame, MAP)

    def _tree(self, stamp_ns: int) -> dict[str, tuple[str, Floats]]:
        tree = dict(self._never_changing())
        for track in self._tracks.of_kind(TRANSFORMS):
            last = track.last_at(stamp_ns)
            for index in range(max(0, last - LOOK_BACK), last + 1):
                tree |= self._links(track, index)
        return tree

    def _never_changing(self) -> dict[str, tuple[str, Floats]]:
        if self._static is None:
            self._static = {}
            for track in self._tracks.of_kind(TRANSFORMS):
                for index in range(min(STATIC, len(track.stamps_ns))):
                    self._static |= self._links(track, index)
        return self._static

    def _links(self, track: TopicIndex, index: int) -> dict[str, tuple[str, Floats]]:
        return self._of_message.get((track.topic, index), lambda: self._read_links(track, index))

    def _read_links(self, track: TopicIndex, index: int) -> dict[str, tuple[str, Floats]]:
        links: dict[str, tuple[str, Floats]] = {}
        message = self._tracks.message(track, index)
        for link in message.transforms if message is not None else ():
            pose = matrix(link.translation, link.rotation)
            if pose is not None:
                links[link.child_frame_id] = (link.parent_frame_id, pose)
        return links
