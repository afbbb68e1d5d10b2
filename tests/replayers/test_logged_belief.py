"""Source of beliefs in a replay: the log's own where they suffice, its estimator where beliefs depend on what is
seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import msgspec
import numpy as np
import pytest
from toy import BED, COUNTER, DESK, TABLE
from toy_logs import MUG, simulated_log, toy_evidence

from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.counterfactual.logged_belief import (
    HELD,
    LoggedBelief,
    NoBelief,
    RecordedBeliefs,
    covers,
    estimator_for,
)
from replayers.runs.run import read
from workbench.errors import UnknownName
from workbench.worlds.knowledge import knowledge_at_start


def recorded(tmp_path: Path) -> Evidence:
    return evidence_of(read(simulated_log(tmp_path / "run.mcap")))


def by(evidence: Evidence, estimator: str, *, static_beliefs: bool = True) -> Evidence:
    return replace(
        evidence, info=msgspec.structs.replace(evidence.info, estimator=estimator), static_beliefs=static_beliefs
    )


def test_the_logs_first_belief_serves_where_names_alone_count(tmp_path: Path) -> None:
    evidence = recorded(tmp_path)
    believer = estimator_for(evidence, (MUG,))
    assert isinstance(believer.estimator, LoggedBelief)
    assert believer.static_beliefs
    assert believer.note == ""
    start = knowledge_at_start(evidence.place.plan, evidence.place.travel, evidence.known)
    belief = believer.estimator.believe(start, (MUG,))
    assert belief.containers == (COUNTER, TABLE, BED, DESK)
    assert belief.of(MUG) == pytest.approx([evidence.first_belief[MUG, c] for c in belief.containers])


def test_a_belief_that_names_not_every_container_does_not_suffice(tmp_path: Path) -> None:
    """The hand-made run believed about the counter and the table only, by weights that are not here."""
    evidence = toy_evidence(tmp_path)
    assert not covers(evidence, (MUG,))
    believer = estimator_for(evidence, (MUG,))
    assert believer.estimator.name.startswith("counts@")
    assert "the run used counts@1a2b3c4d" in believer.note
    with pytest.raises(NoBelief, match="--estimator"):
        estimator_for(evidence, (MUG,), name="first")
    with pytest.raises(NoBelief):
        estimator_for(by(evidence, "somebody's@1"), (MUG,))


def test_an_estimator_that_learns_is_asked_again_if_it_is_here_and_held_fixed_if_not(tmp_path: Path) -> None:
    evidence = recorded(tmp_path)
    gone = estimator_for(by(evidence, "somebody's@1", static_beliefs=False), (MUG,))
    assert isinstance(gone.estimator, LoggedBelief)
    assert gone.note == HELD
    other_weights = estimator_for(by(evidence, "best@00000000"), (MUG,))
    assert other_weights.note == HELD
    changed = estimator_for(by(evidence, evidence.info.estimator, static_beliefs=False), (MUG,))
    assert changed.estimator.name == evidence.info.estimator
    assert isinstance(estimator_for(evidence, (MUG,), name="first").estimator, LoggedBelief)


def test_another_estimator_may_be_named(tmp_path: Path) -> None:
    evidence = recorded(tmp_path)
    assert estimator_for(evidence, (MUG,), name="counts").note == ""
    with pytest.raises(UnknownName, match="counts"):
        estimator_for(evidence, (MUG,), name="nobody")


def test_recorded_beliefs_come_one_after_the_other(tmp_path: Path) -> None:
    run = read(simulated_log(tmp_path / "run.mcap", name="opt-greedy"))
    evidence = evidence_of(run)
    changed = msgspec.structs.replace(run.beliefs[1], probability=((0.9,) * len(run.beliefs[1].containers),))
    beliefs = RecordedBeliefs(evidence, (run.beliefs[0], changed))
    start = knowledge_at_start(evidence.place.plan, evidence.place.travel, evidence.known)
    first = beliefs.believe(start, (MUG,))
    assert first.of(MUG) == pytest.approx(run.beliefs[0].probability[0])
    after = start.seen(TABLE, ())
    assert beliefs.believe(after, (MUG,)).of(MUG) == pytest.approx(np.full(len(changed.containers), 0.9))
    assert beliefs.believe(start, (MUG,)).of(MUG) == pytest.approx(run.beliefs[0].probability[0])
    assert (
        LoggedBelief(replace(evidence, first_belief=MappingProxyType({}))).believe(start, (MUG,)).of(MUG).sum() == 0
    )
