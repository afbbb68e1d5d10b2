"""Runs a third-party planner in a separate process, where it cannot break or stall a replay, or see the truth.

It receives views over a pipe and answers decisions. What it raises, a decision that takes too long, an answer that
is no decision, and asking for the truth are turned into a decision without a plan, which ends the run as
"planner-failed" with the reason. The process holds neither the log nor its path, so there is no truth to find.
Views and decisions cross the pipe in memory by multiprocessing's own encoding; nothing of it is ever stored.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from bdb import BdbQuit
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from importlib.machinery import PathFinder
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from types import MappingProxyType
from typing import Any, Self, cast, final

from workbench.debugging import show_traceback
from workbench.errors import LiosError
from workbench.planning.guarded_strategy import checked_decision
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.strategies import (
    StrategyNotLoaded,
    canonical_name,
    is_strategy,
    strategy_plugin,
    why_refused,
)
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin, Plugin
from workbench.third_party.calls import LOADING_S, exception_text
from workbench.worlds.house import ItemType

MAX_RESTARTS = 3
"""A planner that had to be stopped this often is not restarted."""


def _read_only(entries: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(entries)


def _read_only_mapping(mapping: MappingProxyType[Any, Any]) -> tuple[Any, ...]:
    return _read_only, (dict(mapping),)


ForkingPickler.register(MappingProxyType, _read_only_mapping)
"""Read-only mappings may cross the pipe."""


class AnswerKind(StrEnum):
    """What came of asking a planner.

    Attributes:
        OK: it answered. RAISED: its code raised. ASKED_FOR_TRUTH: it wants the contents of the house.
        GONE: its process died, or took too long. BROKEN: it is not asked any more, or answered with the wrong type.
    """

    OK = "ok"
    RAISED = "raised"
    ASKED_FOR_TRUTH = "asked-for-truth"
    GONE = "gone"
    BROKEN = "broken"


@dataclass(frozen=True, slots=True)
class PlannerAnswer:
    """An answer of a planner; its content is the reason, in words, where the kind is not OK."""

    kind: AnswerKind
    content: object

    @property
    def reason(self) -> str:
        return str(self.content)


NOT_LOADED = PlannerAnswer(AnswerKind.BROKEN, "it was not loaded")
USER_STOPS = (BdbQuit, KeyboardInterrupt)
"""What a user's q in a debugger and Ctrl-C raise."""
WRONG_TYPES = PlannerAnswer(AnswerKind.BROKEN, "its relevant_types are not a tuple")


class AskedForTruth(Exception):
    """A planner accessed the contents of the house."""


@final
class HiddenTruth:
    """Stands in for the house that the oracle would receive; any access to it counts as asking for the truth."""

    def __getattr__(self, name: str) -> Any:
        raise AskedForTruth(f"it asks for the truth (house.{name})")

    def __bool__(self) -> bool:
        return False


def is_foreign(name: str, *, origin: NameOrigin) -> bool:
    """Whether a name means a planner from outside: "module:Class" or an installed entry point; no NAME@SOLVER is.

    Raises:
        UnknownName: neither a built-in nor an installed one.
        NotFromLog: "module:Class" that a log gives.
    """
    if canonical_name(name.partition("@")[0]) is not None:
        return False
    strategy_plugin(name, origin=origin)
    return True


def require_planner(name: str) -> None:
    """Refuses a user's name under which no planner can be: unknown, or of a module that is not there.

    Runs none of its code.

    Raises:
        UnknownName: neither a built-in nor an installed one.
        StrategyNotLoaded: "module:Class" of a module that is neither in this folder nor installed.
    """
    if is_foreign(name, origin=NameOrigin.USER) and ":" in name:
        top = name.partition(":")[0].partition(".")[0]
        if PathFinder.find_spec(top, [os.getcwd(), *sys.path]) is None:
            raise StrategyNotLoaded(name, f"there is no module {top} here or installed")


def loaded_once(name: str, *, in_process: bool = False) -> tuple[str, PlannerAnswer | None]:
    """A planner's own name, and what keeps it from loading, as a misspelt class does; None if nothing does.

    One that asks for the truth is there; what becomes of it is a replay's status.
    """
    kind = InThisProcess if in_process else Sandboxed
    with kind(name, origin=NameOrigin.USER) as planner:
        fault = planner.fault
    return planner.name, None if fault is None or fault.kind is AnswerKind.ASKED_FOR_TRUTH else fault


def foreign_planner(
    name: str, *, origin: NameOrigin, timeout_s: float, in_process: bool
) -> Sandboxed | InThisProcess:
    """A planner from outside, in a separate process or, for a debugger, in this one."""
    if in_process:
        return InThisProcess(name, origin=origin)
    return Sandboxed(name, origin=origin, timeout_s=timeout_s)


def is_from_outside(planner: Strategy) -> bool:
    """Whether a planner was made by foreign_planner."""
    return isinstance(planner, Sandboxed | InThisProcess)


@final
class InThisProcess:
    """A planner from outside in this process and without a time limit, so that a debugger stops in it.

    Otherwise as Sandboxed: what it raises, and what is no decision, become a decision without a plan. Only Ctrl-C and
    leaving the debugger end the command.

    Args:
        name, origin: as for Sandboxed.

    Attributes:
        fault: as of Sandboxed.
    """

    def __init__(self, name: str, *, origin: NameOrigin) -> None:
        found = strategy_plugin(name, origin=origin)
        with found.import_path():
            made = _tried(lambda: load_foreign(found), stops=USER_STOPS)
        self.fault: PlannerAnswer | None = None if made.kind is AnswerKind.OK else made
        self._planner: Strategy | None = cast("Strategy | None", made.content if self.fault is None else None)
        self.name = self._planner.name if self._planner is not None else name

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The types for which it requests beliefs; none if it cannot say."""
        planner = self._planner
        if planner is None:
            return ()
        answer = _tried(lambda: planner.relevant_types(task), stops=USER_STOPS)
        types = _types_in(answer)
        if types is None:
            self.fault = self.fault or _fault_of_types(answer)
        return types or ()

    def decide(self, view: View) -> Decision:
        planner = self._planner
        if self.fault is not None or planner is None:
            return _decision(self.fault or NOT_LOADED, self.name)
        return _decision(_tried(lambda: planner.decide(view), stops=USER_STOPS), self.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


@final
class Sandboxed:
    """A Strategy whose decisions are made in a separate process. A context manager.

    Args:
        name: "module:Class", "module:factory" or the name of an entry point in the group lios.strategies.
        origin: who gives the name; its process has the working folder on its import path only for a user's.
        timeout_s: the longest that one decision may take.

    Attributes:
        fault: what keeps it from deciding anything at all, such as asking for the truth when made; None while it can.
    """

    def __init__(self, name: str, *, origin: NameOrigin, timeout_s: float = 10.0) -> None:
        self._spec = name
        self._origin = origin
        self._timeout_s = timeout_s
        self._process: Any = None
        self._pipe: Connection | None = None
        self._restarts = 0
        self.fault: PlannerAnswer | None = None
        self._name = name
        self._start()

    @property
    def name(self) -> str:
        """The planner's own name; the name by which it was requested if it cannot be loaded."""
        return self._name

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The types for which it requests beliefs; none if it cannot say."""
        answer = self._ask("types", task, self._timeout_s)
        types = _types_in(answer)
        if types is None:
            self.fault = self.fault or _fault_of_types(answer)
        return types or ()

    def decide(self, view: View) -> Decision:
        return _decision(self._ask("decide", view, self._timeout_s), self._name)

    def close(self) -> None:
        """Ends its process. Safe to call twice."""
        if self._process is not None and self._process.is_alive():
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process, self._pipe = None, None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, far = context.Pipe()
        self._process = context.Process(target=_serve, args=(far, self._spec, self._origin, os.getcwd()), daemon=True)
        self._process.start()
        far.close()
        answer = self._await(LOADING_S)
        if answer.kind is AnswerKind.OK:
            self._name = str(answer.content)
        else:
            self.fault = answer
            self.close()

    def _ask(self, what: str, value: object, timeout_s: float) -> PlannerAnswer:
        if self.fault is None and self._pipe is None:
            self._start()
        if self.fault is not None:
            return PlannerAnswer(AnswerKind.BROKEN, self.fault.reason)
        assert self._pipe is not None, "a planner without a fault has a process"
        try:
            self._pipe.send((what, value))
        except OSError:
            return self._stopped("its process died")
        answer = self._await(timeout_s)
        return self._stopped(answer.reason) if answer.kind is AnswerKind.GONE else answer

    def _await(self, timeout_s: float) -> PlannerAnswer:
        assert self._pipe is not None, "awaited without a process"
        if not self._pipe.poll(timeout_s):
            return PlannerAnswer(AnswerKind.GONE, f"it made no decision within {timeout_s:g} s")
        try:
            return self._pipe.recv()
        except (EOFError, OSError):
            return PlannerAnswer(AnswerKind.GONE, "its process died")

    def _stopped(self, why: str) -> PlannerAnswer:
        self.close()
        self._restarts += 1
        if self._restarts >= MAX_RESTARTS:
            self.fault = PlannerAnswer(AnswerKind.GONE, f"{why} ({self._restarts} times; not tried again)")
        return PlannerAnswer(AnswerKind.GONE, why)


def _types_in(answer: PlannerAnswer) -> tuple[ItemType, ...] | None:
    """The item types of an answer; None where it has none."""
    if answer.kind is not AnswerKind.OK or not isinstance(answer.content, tuple):
        return None
    return tuple(ItemType(str(t)) for t in cast("tuple[object, ...]", answer.content))


def _fault_of_types(answer: PlannerAnswer) -> PlannerAnswer:
    return WRONG_TYPES if answer.kind is AnswerKind.OK else answer


def _decision(answer: PlannerAnswer, name: str) -> Decision:
    """The answer, or a decision without a plan that says why it is none."""
    if answer.kind is not AnswerKind.OK:
        return Decision(plan=Plan(status=PlanStatus.SOLVER_FAILED, note=answer.reason, solver=name))
    return checked_decision(answer.content, name)


def _serve(pipe: Connection, spec: str, origin: NameOrigin, folder: str) -> None:
    """The child process: loads the planner, then answers one request after the other.

    What the planner prints goes to standard error: standard output is the command's answer, which a machine may read.
    """
    sys.stdout = sys.stderr
    with suppress(OSError):
        os.dup2(2, 1)
    with suppress(OSError):
        os.chdir(folder)
    try:
        found = strategy_plugin(spec, origin=origin)
    except LiosError as error:
        pipe.send(PlannerAnswer(AnswerKind.RAISED, str(error)))
        return
    with found.import_path():
        _answer(pipe, found)


def _answer(pipe: Connection, found: Plugin) -> None:
    planner: list[Strategy] = []

    def load() -> str:
        planner.append(load_foreign(found))
        return planner[0].name

    pipe.send(_tried(load))
    if not planner:
        return
    while True:
        try:
            what, value = pipe.recv()
        except EOFError:
            return
        ask: Callable[[], object] = (
            (lambda v=value: planner[0].decide(v))
            if what == "decide"
            else (lambda v=value: planner[0].relevant_types(v))
        )
        answer = _tried(ask)
        try:
            pipe.send(answer)
        except (TypeError, AttributeError, ValueError) as error:
            pipe.send(PlannerAnswer(AnswerKind.RAISED, f"its answer cannot be sent: {error}"))


def _tried(ask: Callable[[], object], *, stops: tuple[type[BaseException], ...] = ()) -> PlannerAnswer:
    """What is answered, or why nothing is; KeyboardInterrupt where one of `stops` is raised."""
    try:
        return PlannerAnswer(AnswerKind.OK, ask())
    except stops as error:
        raise KeyboardInterrupt from error
    except AskedForTruth as error:
        return PlannerAnswer(AnswerKind.ASKED_FOR_TRUTH, str(error))
    except (Exception, KeyboardInterrupt, SystemExit) as error:  # noqa: BLE001  third-party code may raise anything
        show_traceback(error)
        return PlannerAnswer(AnswerKind.RAISED, exception_text(error))


def load_foreign(found: Plugin) -> Strategy:
    """The planner of a plug-in: a class, a factory of a house, or a ready strategy.

    Raises:
        AskedForTruth: it cannot be made without the house.
        TypeError: it is no strategy, or calls itself as a built-in one does.
    """
    made: Any = found.load()
    if isinstance(made, type) or not is_strategy(made):
        made = _make(made)
    if (refused := why_refused(made)) is not None:
        raise TypeError(f"{found.name}: {refused}")
    return made


def _make(factory: Any) -> Any:
    """Calls a factory without an argument, or with None for the house; if that fails, with a HiddenTruth."""
    try:
        return factory() if isinstance(factory, type) else factory(None)
    except (TypeError, AttributeError, ValueError, KeyError):
        return factory(HiddenTruth())
