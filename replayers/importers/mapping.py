"""Mapping files, which assign topics of a bag to roles, and presets for common stacks.

Topics are patterns (`*` matches anything); a topic gets the first role whose pattern matches. `frames` names the
bag's map, odometry and body frames; `tag_frames` are patterns of frames in tf that stand for tags, their number as
the first group.
"""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from pathlib import Path

import msgspec

from workbench.errors import MalformedFile, UnknownName
from workbench.worlds.sites.ros_map import read_yaml

PRESETS = Path(__file__).parent / "data" / "presets"
AUTO = "auto"

ROLES = (
    "markers",
    "goals",
    "results",
    "picks",
    "places",
    "handling",
    "tf",
    "tf_static",
    "pose",
    "odometry",
    "map",
    "calibrations",
    "images",
)
"""Roles in the order in which they are tried; docs/bags.md says what each means."""


class BagFrames(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The names of the frames in a bag."""

    map: str = "map"
    odom: str = "odom"
    body: str = "base_link"


class Mapping(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A mapping file."""

    lios_bag_mapping: int
    name: str
    topics: dict[str, tuple[str, ...]]
    frames: BagFrames = BagFrames()
    tag_frames: tuple[str, ...] = ()

    def role_of(self, topic: str) -> str | None:
        """The role of a topic, or None for an unmapped one."""
        for role in ROLES:
            if any(fnmatchcase(topic, pattern) for pattern in self.topics.get(role, ())):
                return role
        return None

    def tag_of(self, frame: str) -> int | None:
        """The number of the tag that a frame represents, or None."""
        for pattern in self.tag_frames:
            match = re.fullmatch(pattern, frame)
            if match is not None:
                return int(match[1])
        return None


def presets() -> dict[str, Path]:
    """The mappings that come with this package, by name."""
    return {path.stem: path for path in sorted(PRESETS.glob("*.yaml"))}


def load_mapping(name: str, topics: tuple[str, ...]) -> Mapping:
    """A mapping file, a preset by its name, or the preset that matches most of a bag's topics ("auto").

    Raises:
        UnknownName, FileMissing, MalformedFile.
    """
    return mappings_for(name, topics)[0]


def mappings_for(name: str, topics: tuple[str, ...]) -> tuple[Mapping, ...]:
    """The mappings that a name may mean for a bag: of "auto" every preset, that which matches most topics first.

    Raises:
        UnknownName, FileMissing, MalformedFile.
    """
    known = presets()
    if name == AUTO:
        return tuple(sorted((_read(path) for path in known.values()), key=lambda m: -_fit(m, topics)))
    if name in known:
        return (_read(known[name]),)
    if not Path(name).suffix:
        raise UnknownName("mapping", name, (*known, AUTO))
    return (_read(Path(name)),)


def _fit(mapping: Mapping, topics: tuple[str, ...]) -> int:
    return sum(mapping.role_of(topic) is not None for topic in topics)


def _read(path: Path) -> Mapping:
    mapping = read_yaml(path, Mapping)
    strange = sorted(set(mapping.topics) - set(ROLES))
    if strange:
        raise MalformedFile(path, f"unknown roles {', '.join(strange)}", f"Roles: {', '.join(ROLES)}")
    for pattern in mapping.tag_frames:
        try:
            groups = re.compile(pattern).groups
        except re.error as error:
            raise MalformedFile(path, f"tag_frames {pattern!r}: {error}", "Write a regular expression") from error
        if groups < 1:
            raise MalformedFile(path, f"tag_frames {pattern!r} has no group", "Put the number in (\\d+)")
    return mapping
