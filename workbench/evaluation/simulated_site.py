"""Surveyed places to simulate a run in: a site with contents, from a configuration or drawn by a seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue, MalformedFile
from workbench.plugins import NameOrigin
from workbench.worlds.house import ContainerId, Contents, House, Item
from workbench.worlds.house_yaml import SUFFIXES, is_survey
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.simulated import NavigationPaths
from workbench.worlds.sites.configurations import configurations_of, pick_configuration, site_and_house
from workbench.worlds.sites.site import Site, load_site, shipped_sites

PLACER = "counts"
"""The estimator by which places are drawn: how often such a container holds such a thing."""
PLACES_SEED = 2
"""Keeps where items stand apart from what else the seed draws."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedSite:
    """A site with contents, and its paths: those of its map, or its measured lengths."""

    house: House
    navigation: NavigationPaths


def site_address(address: str) -> tuple[str, str] | None:
    """The site and the configuration ("" for none) that an address names; None if it names no site.

    Args:
        address: a survey file, its folder or a shipped site, with ":CONFIGURATION" or without.

    Raises:
        BadValue: nothing follows the colon.
    """
    if _is_site(address):
        return address, ""
    site, colon, configuration = address.rpartition(":")
    if not colon or not _is_site(site):
        return None
    if not configuration:
        raise BadValue(f"configuration in {address!r}", "", f"a name, as in {site}:A; or give {site}")
    return site, configuration


def _is_site(address: str) -> bool:
    path = Path(address)
    if address in shipped_sites() and not path.exists():
        return True
    file = path / "site.yaml" if path.is_dir() else path
    return file.suffix.lower() in SUFFIXES and file.is_file() and is_survey(file.read_bytes())


def simulated_site(address: str, configuration: str, *, seed: int) -> SimulatedSite:
    """A site to simulate in.

    Without a name, the first configuration beside the survey is taken; where there are none, each item that carries
    a tag stands in a reachable container, drawn by the seed in proportion to the belief of PLACER.

    Raises:
        InputError: no such site or configuration, or a survey without tags.
    """
    site = load_site(address)
    if not configuration and (site.path.parent / "configurations.yaml").is_file():
        configuration = next(iter(configurations_of(site)), "")
    if configuration:
        moved, house = site_and_house(site, pick_configuration(site, configuration))
        return SimulatedSite(house=house, navigation=moved.navigation)
    house = House(plan=site.plan, contents=_drawn_contents(site, seed))
    return SimulatedSite(house=house, navigation=site.navigation)


def _drawn_contents(site: Site, seed: int) -> Contents:
    """A container for each tagged item, in the order of the tags."""
    items = list(dict.fromkeys(site.tags.values()))
    if not items:
        raise MalformedFile(site.path, "no tags, so there is nothing to find", "Name items under tags")
    if len(site.travel.locations) < 2:
        raise MalformedFile(site.path, "no container can be reached", "See lios site check")
    rng = np.random.default_rng((seed, PLACES_SEED))
    belief = estimator(PLACER, origin=NameOrigin.USER).believe(
        knowledge_at_start(site.plan, site.travel, {}), tuple(dict.fromkeys(item.type for item in items))
    )
    contents: dict[ContainerId, list[Item]] = {c.id: [] for c in site.plan.containers}
    for item in items:
        chance = belief.of(item.type)
        share = chance / chance.sum() if chance.sum() > 0 else np.full(len(chance), 1 / len(chance))
        contents[belief.containers[int(rng.choice(len(share), p=share))]].append(item)
    return {container: tuple(held) for container, held in contents.items()}
