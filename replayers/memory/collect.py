"""The history of a place from its logs: every look of every run, with what the robot itself took and put, and what
people say that the looks missed.

A simulated house begins every run as its file has it, so of a simulated run the robot's own deeds are not remembered;
of a robot's run they are. Replays that were recorded are of imagined worlds, and are left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from replayers.log_tools.log_paths import find_logs
from replayers.runs.correcting import corrections_of
from replayers.runs.run import Run, read
from workbench.beliefs.memory.history import EarlierRun, History, require_same_place
from workbench.beliefs.memory.memory import PastLook
from workbench.errors import InputError, LiosError
from workbench.log_schema.events import ActionFinished, Observation
from workbench.remote.path import path_of
from workbench.worlds.house import ContainerId, ItemType


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


def read_history(logs: Sequence[Path]) -> History:
    """The history that logs hold, or folders of them. What a folder holds beside runs is left out, with a note.

    Raises:
        NoLogs, NoLooks: there is nothing to remember.
        AnotherPlace, ContainersChanged: the logs are not of one place with the same containers.
        LogsContradict: two logs of one time disagree.
        LiosError: a log that is named itself cannot be read, or no log of a folder can.
    """
    runs, errors = dict[str, Run](), list[LiosError]()
    named = {path for path in map(path_of, logs) if not path.is_dir()}
    for path in find_logs(list(logs)):
        try:
            run = read(path)
        except LiosError as error:
            if path in named:
                raise
            errors.append(error)
            continue
        if run.info.source != "replay":
            runs.setdefault(run.info.run_id, run)
    if errors and not runs:
        raise errors[0]
    notes = tuple(f"not remembered: {error}" for error in errors)
    return history_of(tuple(runs.values()), where=", ".join(map(str, logs)), notes=notes)


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
        require_same_place(run.place.plan, newest, earlier.log)
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
