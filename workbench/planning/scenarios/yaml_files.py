"""Scenario files: tasks that users write in YAML, with errors reported by line and column.

    name: tea-time
    title: serve tea and toast
    failure_cost: 400          # optional, 400
    budget_s: 120              # optional, 120
    add:                       # optional: what the house gets, unless it has it
      - item: WaterBottle
        in: [Fridge, DiningTable]
    goal:                      # one of deliver, hold, all, any; all and any nest
      all:
        - deliver: Bread
          to: serving          # start, serving, random, a container's id, or a container type
          with: [toasted]      # optional properties; workbench/planning/actions.py gives them
        - any:
            - deliver: Mug
              to: serving
            - hold: Cup
              to: start

The same word after `to` means the same place throughout a file; `random` draws a new place each time.
"""

from __future__ import annotations

from collections import Counter
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from workbench.errors import FileMissing, MalformedFile, UnknownName
from workbench.planning.actions import EFFECTS, producers
from workbench.planning.scenarios.house_items import SERVING_TYPES, ScenarioUnsupported, add_item, was_added
from workbench.planning.scenarios.support import Support, support
from workbench.planning.tasks import Added, AllOf, AnyOf, Delivered, Goal, Holding, Task
from workbench.worlds.house import START, Container, House, ItemType, LocationId
from workbench.worlds.names import can_carry, readable_name, type_named, vocabulary
from workbench.worlds.travel import TravelCosts

MAX_BYTES = 1_000_000
MAX_DEPTH = 8
MAX_GOALS = 1_000
"""YAML aliases are expanded wherever they occur, so a few lines could mean millions of goals."""
NULL = "tag:yaml.org,2002:null"
TOP_KEYS = ("name", "title", "failure_cost", "budget_s", "add", "goal")


def task_from_file(path: Path, house: House, *, seed: int, travel: TravelCosts | None = None) -> Task:
    """The task that a scenario file sets in a house.

    Raises:
        MalformedFile: a mistake in the file, with its line and column.
        ScenarioUnsupported: the house lacks what the file names.
    """
    return _Reader(path, house, np.random.default_rng(seed), travel).task()


def house_from_file(path: Path, house: House, *, seed: int) -> House:
    """The house with what the file adds. Raises as task_from_file."""
    return _Reader(path, house, np.random.default_rng((seed, 1)), None).prepared()


class _Reader:
    """Reads one file for one house. It works on YAML nodes, which carry their line and column, instead of values."""

    def __init__(self, path: Path, house: House, rng: np.random.Generator, travel: TravelCosts | None) -> None:
        self.path, self.house, self.rng, self.travel = path, house, rng, travel
        self.places: dict[str, LocationId] = {}
        self.goals = 0
        self.top = self.mapping(_compose(path), TOP_KEYS)
        self.name = self.text(self.top["name"]) if "name" in self.top else path.stem

    def task(self) -> Task:
        if "goal" not in self.top:
            raise MalformedFile(self.path, "it has no goal", "Add a goal: with deliver, hold, all or any")
        goal = self.goal(self.top["goal"], 0)
        held = Counter(
            item.type
            for container in self.reached()
            for item in self.house.contents.get(container.id, ())
            if can_carry(item.type)
        )
        task = Task(
            scenario=self.name,
            goal=goal,
            failure_cost=self.number("failure_cost", 400.0),
            budget_s=self.number("budget_s", 120.0),
            title=self.text(self.top["title"]) if "title" in self.top else self.name,
            available=tuple(sorted(held)),
            added=tuple(each for each in self.added() if was_added(self.house, each.item_type)),
        )
        found = support(goal, held)
        if found.kind is not Support.COMPLETE:
            raise ScenarioUnsupported(self.house.plan.name, self.name, found.message)
        return task

    def prepared(self) -> House:
        house = self.house
        for each in self.added():
            house = add_item(house, each.item_type, each.stands, scenario=self.name, rng=self.rng)
        return house

    def added(self) -> tuple[Added, ...]:
        found: list[Added] = []
        for node in self.sequence(self.top["add"]) if "add" in self.top else []:
            entry = self.mapping(node, ("item", "in"))
            if set(entry) != {"item", "in"}:
                raise self.wrong(node, "an addition needs item and in", "Write: - {item: WaterBottle, in: [Fridge]}")
            item_type = self.item_type(entry["item"])
            listed = entry["in"]
            nodes = listed.value if isinstance(listed, yaml.SequenceNode) else [listed]
            if not nodes:
                raise self.wrong(listed, "in has no container types", "Write for example: in: [Fridge, DiningTable]")
            found.append(Added(item_type=item_type, stands=tuple(self.container_type(n) for n in nodes)))
        return tuple(found)

    def goal(self, node: Any, depth: int) -> Goal:
        if depth > MAX_DEPTH:
            raise self.wrong(node, f"goals nest deeper than {MAX_DEPTH}", "Write it flatter")
        self.goals += 1
        if self.goals > MAX_GOALS:
            raise self.wrong(node, f"these are more than {MAX_GOALS} goals, aliases counted", "Write fewer")
        entry = self.mapping(node, ("all", "any", "deliver", "hold", "to", "with"))
        kinds = [key for key in ("all", "any", "deliver", "hold") if key in entry]
        if len(kinds) != 1:
            raise self.wrong(node, "a goal is one of deliver, hold, all, any", "Give exactly one of them")
        kind = kinds[0]
        allowed = {"all": (), "any": (), "hold": ("to",), "deliver": ("to", "with")}[kind]
        for key, _ in node.value:
            if key.value != kind and key.value not in allowed:
                what = f"'{key.value}' says nothing beside {kind}"
                raise self.wrong(key, what, "Remove it, or give it to each part" if not allowed else "Remove it")
        if kind in ("all", "any"):
            parts = tuple(self.goal(part, depth + 1) for part in self.sequence(entry[kind]))
            if not parts:
                raise self.wrong(entry[kind], f"{kind} has no parts", "List at least one goal under it")
            return AllOf(parts=parts) if kind == "all" else AnyOf(parts=parts)
        if "to" not in entry:
            raise self.wrong(node, f"{kind} has no place", "Add to: start, serving, random or a container")
        item_type, at = self.item_type(entry[kind]), self.place(entry["to"])
        if kind == "hold":
            return Holding(item_type=item_type, at=at)
        return Delivered(item_type=item_type, at=at, properties=self.properties(entry, item_type))

    def properties(self, entry: dict[str, Any], item_type: ItemType) -> tuple[str, ...]:
        if "with" not in entry:
            return ()
        node = entry["with"]
        nodes = node.value if isinstance(node, yaml.SequenceNode) else [node]
        for each in nodes:
            if not producers(item_type, self.text(each)):
                known = sorted({prop for prop, _ in EFFECTS.values() if producers(item_type, prop)})
                what = f"nothing makes a {readable_name(item_type)} {self.text(each)}"
                raise self.wrong(each, what, f"Known for it: {', '.join(known) or 'nothing'}")
        return tuple(self.text(each) for each in nodes)

    def item_type(self, node: Any) -> ItemType:
        known = {t for t, word in vocabulary().items() if word.carry} | set(self.house.item_types())
        return ItemType(self.named(node, known, "item type"))

    def container_type(self, node: Any) -> str:
        known = {t for t, word in vocabulary().items() if word.container}
        return self.named(node, known | {c.type for c in self.house.plan.containers}, "container type")

    def named(self, node: Any, known: set[str], kind: str) -> str:
        try:
            return type_named(self.text(node), known, kind=kind)
        except UnknownName as error:
            raise self.wrong(node, str(error).removesuffix("."), "Correct the name") from error

    def place(self, node: Any) -> LocationId:
        word = self.text(node)
        if word == "start":
            return START
        if word not in self.places or word == "random":
            self.places[word] = self.draw(node, word)
        return self.places[word]

    def draw(self, node: Any, word: str) -> LocationId:
        plan, containers = self.house.plan, self.reached()
        if word == "random":
            fitting = [c.id for c in containers]
        elif word == "serving":
            ranked = [[c.id for c in containers if c.type == kind] for kind in SERVING_TYPES]
            fitting = next((ids for ids in ranked if ids), [])
        elif any(c.id == word for c in containers):
            fitting = [c.id for c in containers if c.id == word]
        else:
            kind = self.container_type(node)
            fitting = [c.id for c in containers if c.type == kind]
        if not fitting:
            raise ScenarioUnsupported(plan.name, self.name, f"no place for '{word}'")
        return LocationId(fitting[int(self.rng.integers(len(fitting)))])

    def reached(self) -> tuple[Container, ...]:
        """The reachable containers; all if no travel costs are given."""
        reaches = None if self.travel is None else self.travel.reaches
        return tuple(c for c in self.house.plan.containers if reaches is None or reaches(LocationId(c.id)))

    def mapping(self, node: Any, allowed: tuple[str, ...]) -> dict[str, Any]:
        if not isinstance(node, yaml.MappingNode):
            raise self.wrong(node, "this must be a mapping of keys and values", f"Known keys: {', '.join(allowed)}")
        found: dict[str, Any] = {}
        for key, value in node.value:
            name = self.text(key)
            if name not in allowed:
                raise self.wrong(key, f"unknown key '{name}'", f"Known keys: {', '.join(allowed)}")
            if name in found:
                raise self.wrong(key, f"key '{name}' stands twice", "Remove one")
            found[name] = value
        return found

    def sequence(self, node: Any) -> list[Any]:
        if not isinstance(node, yaml.SequenceNode):
            raise self.wrong(node, "this must be a list", "Begin each entry with '- '")
        return list(node.value)

    def text(self, node: Any) -> str:
        if not isinstance(node, yaml.ScalarNode) or node.tag == NULL or not str(node.value).strip():
            raise self.wrong(node, "this must be a word", "Write a name")
        word = str(node.value).strip()
        if not word.isprintable():
            raise self.wrong(node, f"{word[:40]!r} cannot be printed on one line", "Write a name in plain letters")
        return word

    def number(self, key: str, default: float) -> float:
        if key not in self.top:
            return default
        node = self.top[key]
        if not isinstance(node, yaml.ScalarNode):
            raise self.wrong(node, f"{key} is not a number", "Give a number of at least 0")
        try:
            value = float(str(node.value))
        except ValueError:
            value = float("nan")
        if not isfinite(value) or value < 0:
            raise self.wrong(node, f"{key} is {str(node.value)[:40]!r}", "Give a number of at least 0")
        return value

    def wrong(self, node: Any, what: str, fix: str) -> MalformedFile:
        mark = node.start_mark
        return MalformedFile(f"{self.path}:{mark.line + 1}:{mark.column + 1}", what, fix)


def _compose(path: Path) -> Any:
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_BYTES:
        raise MalformedFile(path, f"a scenario file of more than {MAX_BYTES} bytes", "Check the path")
    try:
        node = yaml.compose(path.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except UnicodeDecodeError as error:
        raise MalformedFile(path, "it is not text in UTF-8", "Save it as UTF-8") from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f"{path}:{mark.line + 1}:{mark.column + 1}" if mark else str(path)
        raise MalformedFile(where, f"no YAML: {error.problem}", "Correct it there") from error
    except (yaml.YAMLError, RecursionError) as error:
        raise MalformedFile(path, f"no YAML: {' '.join(str(error).split())}", "Correct it") from error
    if node is None:
        raise MalformedFile(path, "it is empty", "Write a goal; docs/planning.md shows one")
    return node
