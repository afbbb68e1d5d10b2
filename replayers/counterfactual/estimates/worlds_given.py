"""Worlds for an estimate, sampled from what an estimator believes given contents that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds, sample_worlds
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Relevance
from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.scenarios.added_items import believe_scenario_items
from workbench.worlds.house import Contents
from workbench.worlds.knowledge import knowledge_at_start


def worlds_given(
    evidence: Evidence, known: Contents, relevance: Relevance, drawer: Estimator, *, count: int, seed: int
) -> SampledWorlds:
    """Samples worlds from a belief.

    Args:
        known: the contents of the containers that the estimator knows: of all that the log shows, or fewer.
        drawer: who believes.
    """
    belief = _believed(evidence, known, relevance, drawer)
    if evidence.misses:
        belief = _with_doubtful(evidence, belief, drawer)
    return sample_worlds(
        evidence,
        relevance,
        belief,
        count=count,
        rng=np.random.default_rng(seed),
        exists=relevance.must_exist,
    )


def _believed(evidence: Evidence, known: Contents, relevance: Relevance, drawer: Estimator) -> Belief:
    knowledge = knowledge_at_start(evidence.place.plan, evidence.travel, known)
    return believe_scenario_items(drawer.believe(knowledge, relevance.types), evidence.task, evidence.place.plan)


def _with_doubtful(evidence: Evidence, belief: Belief, drawer: Estimator) -> Belief:
    """A belief that also names the containers that were looked into: what was believed of them at the start."""
    at_start = knowledge_at_start(evidence.place.plan, evidence.travel, evidence.known)
    before = believe_scenario_items(drawer.believe(at_start, belief.item_types), evidence.task, evidence.place.plan)
    columns = [before.containers.index(c) for c in evidence.doubtful if c in before.containers]
    return replace(
        belief,
        containers=(*belief.containers, *(before.containers[i] for i in columns)),
        probability=np.concatenate(
            [belief.probability, before.only(belief.item_types).probability[:, columns]], axis=1
        ),
    )
