"""Replays strategies over a log that is still growing, round by round: the ghosts beside the run.

A round replays every strategy over the log as it is on disk, with everything unobserved as branches. How many
branches are followed depends on the speed of the rounds before, so that a round takes about QUICK_S. Where the tree
of runs is wider than that, its bounds are outer ones; while nothing is added to the log, further rounds follow more.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import final

import msgspec

from replayers.batch.compare import cost_difference
from replayers.batch.log_replayer import log_path
from replayers.batch.replay_log import write_replay_log
from replayers.batch.store import SUFFIX, StoredReplay, to_stored, write_replay
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import Replay, replay_on
from replayers.counterfactual.results import Proof
from replayers.live.ghost_bounds import Basis, GhostBounds, GhostReport, tightened, verdict_line
from replayers.runs.growing_log import GrowingLog
from replayers.runs.run import Run
from workbench.errors import InputError, LiosError
from workbench.files import atomic, file_name_of
from workbench.planning.strategies import canonical_name, needs_truth
from workbench.plugins import NameOrigin

QUICK_S, DEEP_S = 0.6, 1.0
"""How long the replays of a round should take, in seconds: of all strategies together after the log has grown, and of
one strategy while it does not grow."""
MIN_SEGMENTS, MAX_SEGMENTS = 20, 2000
"""Segments of the loop that the bounds of one strategy may take in a round, however little or much time it takes."""
BUDGET_GROWTH = 4
"""By how much more the next round over the same log may follow."""
CLIMB = 10
"""Segments for each climb towards the cheapest and the most expensive run (Budget)."""

CHANGED: Mapping[str, str] = MappingProxyType(
    {
        "run_id": "another run",
        "beliefs": "who believes",
        "refused": "something was refused",
        "misses": "a look must have missed something",
        "corrected": "somebody corrected what was seen",
        "lost": "something is missing from the log",
    }
)
"""The fields of Basis in words."""


class AnotherRun(InputError):
    """The log that is followed holds another run or task than at first."""

    def __init__(self, path: Path, was: str, now: str) -> None:
        super().__init__(
            f"{path}: it now holds another run ({now}; before, {was}), so its ghosts end. Start lios view again."
        )


@final
class Ghosts:
    """The ghosts beside one log.

    Args:
        log: the log being recorded.
        strategies: their names.
        output: a folder for their recordings; None for none.
        origin: who gives the names.
        clock: seconds that only grow.
        max_segments: segments of the loop that the bounds of one strategy may take in a round, at most.
    """

    def __init__(
        self,
        log: Path,
        strategies: tuple[str, ...],
        *,
        output: Path | None = None,
        origin: NameOrigin = NameOrigin.LOG,
        clock: Callable[[], float] = time.perf_counter,
        max_segments: int = MAX_SEGMENTS,
    ) -> None:
        self._log = GrowingLog(log)
        self._strategies = strategies
        self._output = output
        self._origin = origin
        self._clock = clock
        self._most = max_segments
        self._first: Run | None = None
        self._run: Run | None = None
        self._basis: Basis | None = None
        self._before: dict[str, GhostBounds] = {}
        self._recorded: dict[str, tuple[str, str | None, int]] = {}
        self._news = False
        """A round was given up for what has come since."""
        self._segments = MIN_SEGMENTS
        self._pace = 0.0
        """Segments a second, in the round before."""
        self._followed = 0
        """Segments that the last round took."""
        self._last = GhostReport()
        self._settled = False
        """A further round over the same log would follow no more."""

    def next_round(self) -> GhostReport | None:
        """Replays over the log as it now is; None where that would give nothing new.

        Raises:
            AnotherRun: the log was replaced by one of another run.
            LiosError: the log cannot be read.
        """
        began = self._clock()
        news = self._look() or self._news
        self._news = False
        run = self._run
        if run is None:
            return None
        if not news and not self._can_go_deeper():
            return self._end(run)
        if not run.plans:  # until then the log does not show all that the robot knew at the start
            self._settled = True
            return GhostReport(note="Waiting for the first decision.")
        if news:
            affordable = int(self._pace * QUICK_S / (len(self._strategies) + 1))
            self._segments = min(max(affordable, MIN_SEGMENTS), self._most)
            self._settled, self._followed = False, 0
        report = self._replayed(run, began, deeper=not news)
        self._last = report or self._last
        return report

    def _end(self, run: Run) -> GhostReport | None:
        """The last report once more, after a run that has ended; None otherwise."""
        if not run.complete or self._last.ended:
            return None
        self._last = msgspec.structs.replace(self._last, ended="The run has ended.")
        return self._last

    def _look(self) -> bool:
        """Takes up what was added to the log; whether any of it matters to a replay."""
        found = self._log.read()
        if found is None:
            return False
        before, self._run = self._run, found
        self._first = self._first or found
        was, now = self._first.info, found.info
        if (was.run_id, self._first.task) != (now.run_id, found.task):
            raise AnotherRun(self._log.path, was.title or was.run_id, now.title or now.run_id)
        return before is None or _what_matters(before) != _what_matters(found)

    def _can_go_deeper(self) -> bool:
        """Whether a round that follows more of the same log is possible in time; then it is what comes next."""
        if self._run is None or self._settled:
            return False
        affordable = min(int(self._pace * DEEP_S), self._most)
        if self._segments >= affordable:
            self._settled = True
            return False
        self._segments = min(self._segments * BUDGET_GROWTH, affordable)
        return True

    def _replayed(self, run: Run, began: float, *, deeper: bool) -> GhostReport | None:
        """A round; None where the log has grown before a deeper one was done."""
        budget = Budget(segments=self._segments, finish=self._segments, draws=0, climb=CLIMB)
        prepared = prepare_log(run, ReplaySettings(worlds=0, budget=budget))
        prepared_s = self._clock()
        note = self._rebased(prepared)
        made: dict[str, Replay | LiosError] = {}
        for name in self._names(run):
            if deeper and self._look():
                self._news = True
                return None
            try:
                made[name] = replay_on(prepared, name, origin=self._origin)
            except LiosError as error:
                made[name] = error
        followed = sum(replay.segments for replay in made.values() if isinstance(replay, Replay))
        now = self._clock()
        if followed:
            self._pace = followed / max(now - prepared_s, 1e-3)
        self._settled = deeper and followed <= self._followed
        self._followed = followed
        bounds = self._bounds(run, prepared, made)
        self._record(prepared, made)
        return GhostReport(
            log_bytes=self._log.end,
            opened=len(prepared.evidence.contents),
            decisions=len(run.plans),
            seconds=self._clock() - began,
            segments=self._segments,
            bounds=bounds,
            line=verdict_line(bounds),
            note=note or (prepared.reproduction.why if not prepared.claims else ""),
        )

    def _names(self, run: Run) -> tuple[str, ...]:
        """The driven strategy, where it can be replayed, and the ghosts."""
        driven = canonical_name(run.info.strategy) or run.info.strategy
        replayable = canonical_name(driven) is not None and not needs_truth(driven)
        first = (driven,) if replayable or driven in self._strategies else ()
        return tuple(dict.fromkeys((*first, *self._strategies)))

    def _rebased(self, prepared: PreparedLog) -> str:
        """Forgets earlier bounds where the log rests on something else than before; then it says so."""
        evidence = prepared.evidence
        refused = (*evidence.refused_searches, *evidence.refused_moves, *evidence.refused_picks, *evidence.left)
        basis = Basis(
            run_id=evidence.info.run_id,
            beliefs=(
                f"{type(prepared.estimator).__name__} {prepared.estimator.name}",
                prepared.static_beliefs,
                prepared.exact_beliefs,
            ),
            refused=tuple(sorted(str(name) for name in refused)),
            misses=evidence.misses,
            corrected=tuple(correction.words for correction in evidence.corrections),
            lost=evidence.gaps.lost,
        )
        before, self._basis = self._basis, basis
        if before is None or before == basis:
            return ""
        self._before = {}
        changed = next(f for f in basis.__struct_fields__ if getattr(basis, f) != getattr(before, f))
        return f"Bounds began anew: the log now shows otherwise what they rest on ({CHANGED[changed]})."

    def _bounds(
        self, run: Run, prepared: PreparedLog, made: Mapping[str, Replay | LiosError]
    ) -> tuple[GhostBounds, ...]:
        """The bounds of a round, nowhere wider than those before; the driven strategy is first."""
        stored = {
            name: to_stored(prepared, replay, key="") for name, replay in made.items() if isinstance(replay, Replay)
        }
        driven = canonical_name(run.info.strategy) or run.info.strategy
        found: list[GhostBounds] = [] if driven in made else [_driven_as_recorded(run)]
        for name, replay in made.items():
            found.append(_bounds_of(name, replay, driven=name == driven))
        if run.outcome is not None and found[0].driven:
            found[0] = msgspec.structs.replace(found[0], charged=run.outcome.cost)
        first = found[0]
        own = stored.get(driven)
        for i, ghost in enumerate(found[1:], 1):
            other = stored.get(ghost.strategy)
            found[i] = _compared(ghost, first, own, other)
        kept = tuple(tightened(b, self._before.get(b.strategy)) for b in found)
        self._before = {b.strategy: b for b in kept}
        return kept

    def _record(self, prepared: PreparedLog, made: Mapping[str, Replay | LiosError]) -> None:
        """Records the ghosts' runs over the log alone, each with its bounds beside it."""
        if self._output is None:
            return
        for name in self._strategies:
            replay = made.get(name)
            if not isinstance(replay, Replay) or not replay.events:
                continue
            kept, record = self._before[name], to_stored(prepared, replay, key="")
            if record.bounds is not None:
                figures = replace(record.bounds, lower=kept.lower, upper=kept.upper)
                record = msgspec.structs.replace(record, bounds=figures, exact=kept.exact)
            path = ghost_log(self._output, name)
            write_replay(path.with_suffix(".json"), record)
            outcome = (replay.status.value, replay.unseen, len(replay.events))
            if self._recorded.get(name) != outcome:  # to the same unopened container it goes the same way
                with atomic(path) as draft:
                    write_replay_log(draft, prepared, replay, force=True)
                self._recorded[name] = outcome


def _what_matters(run: Run) -> tuple[object, ...]:
    """How much of a run a replay goes by there is; a robot's pictures and poses leave it as it is."""
    events = (
        run.observations,
        run.sightings,
        run.answers,
        run.beliefs,
        run.plans,
        run.actions,
        run.corrections,
    )
    return (*map(len, events), run.outcome, run.closed, len(run.damage))


def ghost_log(folder: Path, name: str) -> Path:
    """Where the run of a ghost is recorded."""
    return log_path(folder / f"{file_name_of(name)}{SUFFIX}")


def _bounds_of(name: str, replay: Replay | LiosError, *, driven: bool) -> GhostBounds:
    if isinstance(replay, LiosError) or replay.bounds is None:
        why = str(replay) if isinstance(replay, LiosError) else replay.reason
        status = "" if isinstance(replay, LiosError) else replay.status.value
        return GhostBounds(strategy=name, driven=driven, status=status, trouble=why or "it has no bounds")
    bounds = replay.bounds
    return GhostBounds(
        strategy=name,
        driven=driven,
        lower=bounds.lower,
        upper=bounds.upper,
        outer=(bounds.lower_proof, bounds.upper_proof) != (Proof.EXACT, Proof.EXACT),
        status=replay.status.value,
    )


def _driven_as_recorded(run: Run) -> GhostBounds:
    """Bounds of a driven strategy that cannot be replayed: unless it fails, it costs what it has spent or more."""
    name = run.info.strategy or "the driven run"
    if run.outcome is not None:
        cost = run.outcome.cost
        return GhostBounds(strategy=name, driven=True, lower=cost, upper=cost, status=run.outcome.status)
    spent = sum(action.cost for action in run.actions)
    return GhostBounds(strategy=name, driven=True, lower=min(spent, run.task.failure_cost), outer=True)


def _compared(
    ghost: GhostBounds, driven: GhostBounds, own: StoredReplay | None, other: StoredReplay | None
) -> GhostBounds:
    """A ghost with the bounds of the driven strategy's cost minus its own."""
    if ghost.trouble or driven.trouble:
        return ghost
    least, most = driven.lower - ghost.upper, driven.upper - ghost.lower
    if own is not None and other is not None and own.bounds is not None and other.bounds is not None:
        difference = cost_difference(own, other)
        least, most = max(least, difference.least), min(most, difference.most)
    return msgspec.structs.replace(ghost, least_extra=least, most_extra=most)
