"""The history of a place from its logs: every look of every run, with what the robot itself took and put, and what
people say that the looks missed.

A simulated house begins every run as its file has it, so of a simulated run the robot's own deeds are not remembered;
of a robot's run they are. Replays that were recorded are of imagined worlds, and are left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from replayers.log_tools.log_paths import find_logs
from replayers.runs.correcting import corrections_of
from replayers.runs.run import Run, read
from workbench.beliefs.memory.history import (
    AnotherPlace,
    EarlierRun,
    History,
    NoRunOfPlace,
    SeveralPlaces,
    places_in_words,
    require_same_place,
)
from workbench.beliefs.memory.memory import PastLook
from workbench.errors import InputError, LiosError
from workbench.log_schema.events import ActionFinished, Observation
from workbench.remote.path import path_of
from workbench.terminal import counted
from workbench.worlds.house import ContainerId, FloorPlan, ItemType


class NoLooks(InputError):
    """Logs of which none shows the contents of a container."""

    def __init__(self, where: str) -> None:
        super().__init__(f"{where}: no log there shows what a container held. Give logs of runs that looked.")


class NoRepeatedLooks(InputError):
    """Logs in which no container was looked into by two runs."""

    def __init__(self, where: str) -> None:
        super().__init__(
            f"{where}: no container that held something was looked into again by a later run, so nothing is learned. "
            "Give logs of more runs."
        )


class LogsContradict(InputError):
    """Two runs of the same time that saw different things in one container."""

    def __init__(self, one: str, other: str, container: str) -> None:
        super().__init__(
            f"{one} and {other} are of the same time and show different things in {container}: they are not of one "
            "house. Give only one of them (simulated runs: lios record --day says when a run takes place)."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlierLogs:
    """The runs of logs, of any number of places.

    Attributes:
        runs: each once, without recorded replays.
        named: the ids of the runs whose logs were named themselves, and not found in a folder.
        where: the logs and folders as they were given.
        notes: what is no run, and why.
    """

    runs: tuple[Run, ...]
    named: frozenset[str]
    where: str
    notes: tuple[str, ...]

    def of_place(self, place: FloorPlan) -> History:
        """The history of a place. Logs of other places that a folder holds are left out, with a note.

        Raises:
            NoLooks, NoRunOfPlace: there is nothing to remember.
            AnotherPlace: a log that was named itself is of another place.
            ContainersChanged: a log is of this place with other containers.
            LogsContradict: two logs of one time disagree.
        """
        kept, elsewhere = list[Run](), list[str]()
        for run in self.runs:
            try:
                require_same_place(run.place.plan, place, str(run.path))
            except AnotherPlace:
                if run.info.run_id in self.named:
                    raise
                elsewhere.append(run.place.plan.name)
                continue
            kept.append(run)
        others = places_in_words(elsewhere)
        if elsewhere and not kept:
            raise NoRunOfPlace(place.name, others=others, where=self.where)
        left_out = (f"not remembered: {counted(len(elsewhere), 'log')} of {others}",) if elsewhere else ()
        return history_of(kept, where=self.where, notes=(*self.notes, *left_out))


def earlier_logs(logs: Sequence[Path]) -> EarlierLogs:
    """The runs of logs, or of folders of them. What a folder holds beside runs is left out, with a note.

    Raises:
        NoLogs: there is no log.
        LiosError: a log that is named itself cannot be read, or no log of a folder can.
    """
    runs, errors, of_named = dict[str, Run](), list[LiosError](), set[str]()
    named = {path for path in map(path_of, logs) if not path.is_dir()}
    for path in find_logs(list(logs)):
        try:
            run = read(path)
        except LiosError as error:
            if path in named:
                raise
            errors.append(error)
            continue
        known = runs.get(run.info.run_id)
        if run.info.source != "replay" and (known is None or (run.has_end and not known.has_end)):
            runs[run.info.run_id] = run
        if run.info.source != "replay":
            of_named |= {run.info.run_id} if path in named else set()
    if errors and not runs:
        raise errors[0]
    return EarlierLogs(
        runs=tuple(runs.values()),
        named=frozenset(of_named),
        where=", ".join(map(str, logs)),
        notes=tuple(f"not remembered: {error}" for error in errors),
    )


def read_history(logs: Sequence[Path], place: FloorPlan | None = None) -> History:
    """The history that logs hold, or folders of them. What a folder holds beside runs is left out, with a note.

    Args:
        place: the place whose history it is; None for the one place that all the logs are of.

    Raises:
        SeveralPlaces: no place is given, and the logs are of several.
        NoLogs, LiosError: as earlier_logs. And what EarlierLogs.of_place raises.
    """
    found = earlier_logs(logs)
    return history_of(found.runs, where=found.where, notes=found.notes) if place is None else found.of_place(place)


def places_of(logs: Iterable[Path]) -> tuple[FloorPlan, ...]:
    """The distinct places of the runs that logs hold; what cannot be read has none."""
    places: dict[FloorPlan, None] = {}
    for log in logs:
        with suppress(LiosError):
            places[read(log).place.plan] = None
    return tuple(places)


def history_of(runs: Sequence[Run], *, where: str = "", notes: tuple[str, ...] = ()) -> History:
    """The history of runs of one place; see read_history.

    Args:
        notes: what is to be said of it besides.
    """
    found = sorted(((_earlier(run), run) for run in runs), key=lambda pair: (pair[0].ended_ns, pair[0].id))
    looks = [list(_looks(run)) for _, run in found]
    if not any(looks):
        raise NoLooks(where)
    newest = found[-1][1].place.plan
    for earlier, run in found:
        try:
            require_same_place(run.place.plan, newest, earlier.log)
        except AnotherPlace:
            raise SeveralPlaces(where, places_in_words([run.place.plan.name for run in runs])) from None
    _require_agreement([earlier for earlier, _ in found], looks)
    everything = sorted(
        (look for of_run in looks for look in of_run), key=lambda look: (look.seen_ns, look.container)
    )
    return History(
        plan=newest,
        runs=tuple(earlier for earlier, _ in found),
        looks=tuple(everything),
        notes=(*notes, *(f"{earlier.log}: {note}" for earlier, run in found for note in corrections_of(run)[1])),
    )


def _earlier(run: Run) -> EarlierRun:
    stamps = [e.stamp.ns for e in (*run.observations, *run.actions, *(() if run.outcome is None else (run.outcome,)))]
    started = run.info.started.ns
    return EarlierRun(
        id=run.info.run_id, log=str(run.path), started_ns=started, ended_ns=max(stamps, default=started)
    )


def _looks(run: Run) -> Iterator[PastLook]:
    """What each container held whenever the log shows it, in the order of time.

    What a person says that the looks missed stood there at each of them.
    """
    corrections, _ = corrections_of(run)
    held: dict[str, dict[str, str]] = {}
    known = {c.id for c in run.place.plan.containers}
    for event in _in_order(run):
        if isinstance(event, ActionFinished):
            if _carries(event, held):
                yield _look(run, event.target, event.stamp.ns, held[event.target].values(), changed=True)
            continue
        if ContainerId(event.container) not in known:
            continue
        items = {item.id: item.type for item in event.items}
        before = held.get(event.container, {}) if event.look is not None else {}
        shown = {**before, **items}
        missed_items = {c.item.id: c.item.type for c in corrections if c.container == event.container}
        held[event.container] = {**shown, **missed_items}
        missed = 0.0 if event.look is None else 1.0 - min(event.look.p_detect, default=1.0)
        there = held[event.container].values()
        corrected = tuple(sorted(set(missed_items.values()) - set(shown.values())))
        yield replace(_look(run, event.container, event.stamp.ns, there, missed=missed), corrected=corrected)


def _in_order(run: Run) -> list[Observation | ActionFinished]:
    deeds = () if run.info.source == "simulation" else run.actions
    return sorted((*run.observations, *deeds), key=lambda e: (e.stamp.ns, isinstance(e, Observation)))


def _carries(action: ActionFinished, held: dict[str, dict[str, str]]) -> bool:
    """Whether an action changed what a seen container holds; changes it."""
    there = held.get(action.target)
    if there is None or not action.success or action.action not in ("pick", "place"):
        return False
    for index, item in enumerate(action.items):
        if action.action == "pick":
            there.pop(item, None)
        elif index < len(action.item_types):
            there[item] = action.item_types[index]
    return True


def _look(
    run: Run, container: str, stamp_ns: int, types: Iterable[str], *, missed: float = 0.0, changed: bool = False
) -> PastLook:
    return PastLook(
        container=ContainerId(container),
        seen_ns=stamp_ns,
        item_types=tuple(ItemType(t) for t in sorted(set(types))),
        run=run.info.run_id,
        missed=missed,
        changed=changed,
    )


def _require_agreement(runs: Sequence[EarlierRun], looks: Sequence[Sequence[PastLook]]) -> None:
    """Check that runs which overlap in time saw the same things."""
    seen = [{look.container: look for look in of_run if not look.changed and not look.missed} for of_run in looks]
    for i, one in enumerate(runs):
        for j in range(i + 1, len(runs)):
            other = runs[j]
            if one.started_ns >= other.ended_ns or other.started_ns >= one.ended_ns:
                continue
            for container in sorted(seen[i].keys() & seen[j].keys()):
                if seen[i][container].item_types != seen[j][container].item_types:
                    raise LogsContradict(one.log, other.log, container)
