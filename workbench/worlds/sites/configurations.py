"""Configurations of a site's experiments: where the items were and where the robot started.

Only a simulated robot may use them, since a site with a configuration is a house with its true contents.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import msgspec

from workbench.errors import MalformedFile, UnknownName
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, Contents, House, Item
from workbench.worlds.sites.ros_map import read_yaml
from workbench.worlds.sites.site import Site, pose_of, starting_at
from workbench.worlds.sites.survey_schema import Name, PoseEntry

VERSION = 1


class PaperResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's result for one strategy."""

    seconds: float
    searches: int


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    start: PoseEntry
    contents: dict[str, tuple[str, ...]]
    paper: dict[str, PaperResult] = {}


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    lios_configurations: int
    configurations: Annotated[dict[Name, _Entry], msgspec.Meta(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """A start pose and the contents of containers.

    Attributes:
        contents: items per container; containers without an entry are empty.
        paper: the paper's results by strategy; often empty.
    """

    name: str
    start: Pose
    contents: Contents
    paper: Mapping[str, PaperResult] = field(default_factory=lambda: MappingProxyType({}))


def load_configurations(path: Path, site: Site) -> dict[str, Configuration]:
    """All configurations of a file, by name.

    Raises:
        FileMissing: no such file.
        MalformedFile: not a configuration file, of another version, an item without a tag, or an unknown container.
    """
    file = read_yaml(path, _File)
    if file.lios_configurations != VERSION:
        fix = f"Write lios_configurations: {VERSION}, or upgrade lios-workbench"
        raise MalformedFile(path, f"version {file.lios_configurations}; this release reads {VERSION}", fix)
    containers = {c.id for c in site.plan.containers}
    items = {str(item.id): item for item in site.tags.values()}
    found: dict[str, Configuration] = {}
    for name, entry in file.configurations.items():
        strange = sorted(set(entry.contents) - containers)
        if strange:
            known = ", ".join(sorted(containers))
            raise MalformedFile(path, f"{name} puts items into {', '.join(strange)}", f"Containers: {known}")
        untagged = sorted({i for listed in entry.contents.values() for i in listed} - set(items))
        if untagged:
            raise MalformedFile(path, f"{name} has items without a tag: {', '.join(untagged)}", "Add them to tags")
        contents = {ContainerId(c): _items(listed, items) for c, listed in entry.contents.items()}
        found[name] = Configuration(
            name=name,
            start=pose_of(entry.start),
            contents=MappingProxyType(contents),
            paper=MappingProxyType(entry.paper),
        )
    return found


def configurations_of(site: Site) -> dict[str, Configuration]:
    """The configurations beside a site file."""
    return load_configurations(site.path.parent / "configurations.yaml", site)


def pick_configuration(site: Site, name: str) -> Configuration:
    """One configuration by its name. Raises UnknownName and what load_configurations raises."""
    known = configurations_of(site)
    if name not in known:
        raise UnknownName("configuration", name, known, str(site.path.parent / "configurations.yaml"))
    return known[name]


def site_and_house(site: Site, configuration: Configuration) -> tuple[Site, House]:
    """The site with the configuration's start pose, and the house for a simulated robot."""
    moved = starting_at(site, configuration.start)
    return moved, House(plan=moved.plan, contents=configuration.contents)


def _items(listed: tuple[str, ...], items: Mapping[str, Item]) -> tuple[Item, ...]:
    return tuple(items[name] for name in listed)
