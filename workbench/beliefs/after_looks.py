"""Beliefs after looks that can miss: the Bayesian posterior of items that n looks did not show, never zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import Perception


def after_looks(belief: Belief, knowledge: Knowledge, perception: Perception) -> Belief:
    """The belief given that earlier looks into its containers did not show what is sought.

    With the prior P, the chance p that one look detects, and n looks that did not show the item:

        P (1 - p)^n / (1 - P + P (1 - p)^n)

    A belief over containers that nobody looked into is returned as it is. Where perception is not perfect, the answer
    also says how surely a look detects each of its types.
    """
    if perception.perfect:
        return belief
    looks = np.array([knowledge.looks(c) for c in belief.containers], dtype=np.float64)
    detect = np.array([perception.of(t) for t in belief.item_types], dtype=np.float64)
    posterior = posterior_after_misses(belief.probability, (1.0 - detect[:, None]) ** looks[None, :])
    posterior = np.where(looks[None, :] > 0, posterior, belief.probability)
    return replace(belief, probability=posterior, p_detect=tuple(float(p) for p in detect))


def posterior_after_misses(prior: Floats, missed: Floats) -> Floats:
    """P m / (1 - P + P m), by Bayes: what is left of a prior P after looks that miss what is there with chance m.

    Args:
        prior, missed: in [0, 1], float64, of shapes that broadcast. Where a certain item cannot have been missed, 0.
    """
    unseen = prior * missed
    among = 1.0 - prior + unseen
    return np.divide(unseen, among, out=np.zeros_like(among), where=among > 0)
