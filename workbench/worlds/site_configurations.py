"""Where did things lie and where did the robot start? The configurations of a site's experiments.

Only a simulated robot may know them: a configuration of a site is a house, contents and all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import msgspec

from workbench.errors import MalformedFile, UnknownName
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, Contents, House, Item
from workbench.worlds.site import Site, pose_of, starting_at
from workbench.worlds.site_file import PoseEntry
from workbench.worlds.site_map import read_yaml


class PaperResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the paper reports for one strategy."""

    seconds: float
    searches: int


class _Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    start: PoseEntry
    contents: dict[str, tuple[str, ...]]
    paper: dict[str, PaperResult] = {}


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    lios_configurations: int
    configurations: dict[str, _Entry]


@dataclass(frozen=True, slots=True, kw_only=True)
class Configuration:
    """A start pose and where items lie.

    Attributes:
        contents: per container, its items; containers without an entry are empty.
        paper: by strategy, what the paper reports; often empty.
    """

    name: str
    start: Pose
    contents: Contents
    paper: Mapping[str, PaperResult] = field(default_factory=lambda: MappingProxyType({}))


def load_configurations(path: Path, site: Site) -> dict[str, Configuration]:
    """All configurations of a file, by name.

    Raises:
        FileMissing: no such file.
        MalformedFile: not configurations, an item without a tag, or a container that the site does not have.
    """
    file = read_yaml(path, _File)
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
    """The configurations that lie beside a site file."""
    return load_configurations(site.path.parent / "configurations.yaml", site)


def pick_configuration(site: Site, name: str) -> Configuration:
    """One configuration by its name. Raises UnknownName and what load_configurations raises."""
    known = configurations_of(site)
    if name not in known:
        raise UnknownName("configuration", name, known, str(site.path.parent / "configurations.yaml"))
    return known[name]


def arranged(site: Site, configuration: Configuration) -> tuple[Site, House]:
    """The site with the robot at the configuration's start, and the house that a simulated robot moves in."""
    moved = starting_at(site, configuration.start)
    return moved, House(plan=moved.plan, contents=configuration.contents)


def _items(listed: tuple[str, ...], items: Mapping[str, Item]) -> tuple[Item, ...]:
    return tuple(items[name] for name in listed)
