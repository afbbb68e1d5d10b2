"""Knowledge that a run takes over from earlier logs of its place: contents known before it begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import msgspec
from bosdyn.api import robot_state_pb2

from recorders.spot.client.errors import StillHolding
from workbench.log_schema.events import RunInfo
from workbench.terminal import counted
from workbench.worlds.house import ContainerId, Contents, Item, LocationId
from workbench.worlds.world import ActionRefused, LookResult

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlierLog:
    """A log that a run goes on from, by its file's name and its identity."""

    log: str
    run_id: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ResumedKnowledge:
    """What earlier logs of a place know now.

    Attributes:
        logs: the interrupted run first, then the other sessions of the same place.
        known: contents of the containers that were looked into, as they are by the logs now.
        put: items that were put down where nobody looked; the robot looks there before it plans.
        notes: what could not be taken over, in words.
    """

    logs: tuple[EarlierLog, ...]
    known: Contents = field(default_factory=lambda: MappingProxyType({}))
    put: Contents = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()

    def in_words(self) -> str:
        from_logs = ", ".join(one.log for one in self.logs)
        known = f"{counted(len(self.known), 'container')} known" + (
            f" ({', '.join(self.known)})" if self.known else ""
        )
        first = f"; looked into first: {', '.join(self.put)}" if self.put else ""
        return f"Taken over from {from_logs}: {known}{first}" + "".join(f"; {note}" for note in self.notes)

    def as_settings(self, known: Contents) -> dict[str, object]:
        """For the settings in the new log.

        Args:
            known: what was known when the run began: taken over, and looked at first.
        """
        return {
            "logs": [{"log": one.log, "run_id": one.run_id, "sha256": one.sha256} for one in self.logs],
            "known": {c: [item.id for item in items] for c, items in known.items()},
            "looked_first": sorted(self.put),
            "notes": list(self.notes),
        }

    def continued(self, info: RunInfo) -> RunInfo:
        """The identity of the run that goes on: it names the interrupted one."""
        before = self.logs[0]
        return msgspec.structs.replace(info, origin_run=before.run_id, origin_sha256=before.sha256)


def look_where_items_were_put(world: SpotWorld, earlier: ResumedKnowledge) -> None:
    """Let the world know what was taken over, after a look wherever an item was put down and nobody looked.

    What is beside such an item is unknown without a look. A look that is refused leaves the container unknown.

    Raises:
        StillHolding: the gripper holds something, and the logs do not say where it is from.
        RunStopped: as for every step.
    """
    _check_gripper(world)
    known: dict[ContainerId, tuple[Item, ...]] = dict(earlier.known)
    for container in earlier.put:
        went = world.go_to(LocationId(container))
        looked = went if isinstance(went, ActionRefused) else world.look_into(container)
        if isinstance(looked, LookResult):
            known = {place: _without(items, looked.items) for place, items in known.items()}
            known[container] = looked.items
    world.known = MappingProxyType({container: known[container] for container in sorted(known)})
    if earlier.put:
        world.start_here()


def _without(items: tuple[Item, ...], gone: tuple[Item, ...]) -> tuple[Item, ...]:
    return tuple(item for item in items if item not in gone)


def _check_gripper(world: SpotWorld) -> None:
    timeout_s = world.connection.timeout_s
    state: robot_state_pb2.RobotState = world.call(
        lambda: world.connection.client("robot-state").get_robot_state(timeout=timeout_s)
    )
    if state.manipulator_state.is_gripper_holding_item:
        raise StillHolding(str(world.connection.address))


def settings_of(earlier: ResumedKnowledge | None, known: Contents) -> Mapping[str, object]:
    """The settings entry of a run: empty where nothing was taken over."""
    return {} if earlier is None else {"resumed": earlier.as_settings(known)}
