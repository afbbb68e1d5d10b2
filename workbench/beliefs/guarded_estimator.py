"""A wrapper that runs a third-party estimator in this process and turns its faults into one error.

An exception, an answer that is no belief about what was asked, or one that takes too long becomes EstimatorFailed.
What the estimator prints goes to standard error, since standard output carries the command's result.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar, final

from workbench.beliefs.belief import Belief, Estimator
from workbench.debugging import show_traceback
from workbench.errors import LiosError, Unsupported
from workbench.plugins import quoted
from workbench.third_party.calls import TimeLimitReached, exception_text, redirected_and_timed
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge

BELIEF_LIMIT_S = 60.0
"""The longest that third-party code may take for one belief, or for one answer."""

Answered = TypeVar("Answered")


class EstimatorFailed(Unsupported):
    """An estimator gave no belief.

    Args:
        name: the estimator's.
        why: what went wrong, without a full stop.
        fix: what to do next, as a sentence without a full stop.
    """

    def __init__(self, name: str, why: str, fix: str = "Correct it, or name another with --estimator") -> None:
        super().__init__(f"estimator {quoted(name)}: {' '.join(why.split())}. {fix}.")


def guarded_call(name: str, call: Callable[[], Answered], *, limit_s: float | None = None) -> Answered:
    """What a call of third-party code returns.

    Args:
        name: the estimator's, for the error.
        limit_s: the longest that it may take; BELIEF_LIMIT_S by default. It holds in the main thread only.

    Raises:
        EstimatorFailed: it raised, or took longer.
    """
    limit = BELIEF_LIMIT_S if limit_s is None else limit_s
    try:
        with redirected_and_timed(limit):
            return call()
    except TimeLimitReached:
        raise EstimatorFailed(name, f"it did not answer within {limit:g} s") from None
    except EstimatorFailed:
        raise
    except LiosError as error:
        raise EstimatorFailed(name, str(error).rstrip(".")) from error
    except (Exception, SystemExit) as error:
        show_traceback(error)
        raise EstimatorFailed(name, exception_text(error)) from error


@final
@dataclass(frozen=True, slots=True)
class GuardedEstimator:
    """An Estimator that answers with a belief about what was asked, in time, or raises EstimatorFailed.

    Attributes:
        estimator: the wrapped third-party estimator.
        limit_s: the longest that it may take for one belief; None for BELIEF_LIMIT_S.
    """

    estimator: Estimator
    limit_s: float | None = None

    @property
    def name(self) -> str:
        return self.estimator.name

    @property
    def names_alone(self) -> bool:
        """Whether it says that no observation changes its beliefs."""
        return getattr(self.estimator, "names_alone", False) is True

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over knowledge.unsearched.

        Raises:
            EstimatorFailed: it raised, took too long, or answered with something else.
        """
        made: object = guarded_call(
            self.name, lambda: self.estimator.believe(knowledge, item_types), limit_s=self.limit_s
        )
        return checked_belief(made, self.name, knowledge, item_types)


def checked_belief(made: object, name: str, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
    """An answer, if it is a belief about these item types in the unsearched containers.

    Raises:
        EstimatorFailed: it is not.
    """
    if not isinstance(made, Belief):
        what = "nothing" if made is None else type(made).__name__
        raise EstimatorFailed(name, f"it returned {what} instead of a Belief")
    for field, kind in (("item_types", tuple), ("containers", tuple), ("estimator", str)):
        held = getattr(made, field)
        if not isinstance(held, kind):  # a log of it could not be read
            raise EstimatorFailed(name, f"its belief has {field} of type {type(held).__name__}, not {kind.__name__}")
    if made.item_types != item_types:
        raise EstimatorFailed(
            name, f"its belief is about {_some(made.item_types)}, and was asked about {_some(item_types)}"
        )
    if made.containers != knowledge.unsearched:
        raise EstimatorFailed(
            name,
            f"its belief names {len(made.containers)} containers ({_some(made.containers)}), not the "
            f"{len(knowledge.unsearched)} of knowledge.unsearched in their order",
        )
    return made


def _some(names: tuple[str, ...]) -> str:
    shown = ", ".join(str(name)[:40] for name in names[:3])
    return f"{shown}, ..." if len(names) > 3 else shown or "nothing"
