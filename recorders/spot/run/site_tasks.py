"""A site as the place of a run, and tasks in it: a scenario file whose item types are those with a tag there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from workbench.errors import Unsupported
from workbench.log_schema.place import Place
from workbench.planning.scenarios.yaml_files import task_from_file
from workbench.planning.tasks import AllOf, Task
from workbench.worlds.house import House
from workbench.worlds.sites.site import Site


class NothingTagged(Unsupported):
    """The site has no tags, so that no item can be recognised."""

    def __init__(self, site: Site) -> None:
        super().__init__(f"{site.path}: no item has a tag, so the robot could find none. Add tags to the site.")


def site_task(path: Path, site: Site) -> Task:
    """The task of a scenario file in a site (workbench/planning/scenarios/yaml_files.py describes the file).

    Raises:
        FileMissing, MalformedFile, ScenarioUnsupported, NothingTagged.
    """
    if not site.tags or not site.plan.containers:
        raise NothingTagged(site)
    stocked = House(plan=site.plan, contents={site.plan.containers[0].id: tuple(site.tags.values())})
    return task_from_file(path, stocked, seed=0, travel=site.travel)


def session_task() -> Task:
    """The empty task of a session without a goal."""
    return Task(scenario="session", goal=AllOf(parts=()), failure_cost=0.0, budget_s=0.0, title="a robot session")


def delivery_of(site: Site) -> Path:
    """The task file beside a site file."""
    return site.path.parent / "deliver.yaml"


def place_of(site: Site) -> Place:
    """The site as stored in a log."""
    return replace(Place.of(site.plan, site.navigation), robot_radius_m=site.robot.radius_m)
