"""The posterior after looks in vain, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from toy import BED, DESK, TABLE, item, toy_plan, toy_travel

from workbench.beliefs.after_looks import after_looks, posterior_after_misses
from workbench.beliefs.belief import Belief
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import PERFECT, Perception

MUG, BOOK = ItemType("Mug"), ItemType("Book")


def _belief() -> Belief:
    rows = np.array([[0.5, 0.5, 1.0], [0.2, 0.2, 0.0]])
    return Belief(item_types=(MUG, BOOK), containers=(TABLE, BED, DESK), probability=rows, estimator="toy@0")


def _looked() -> Knowledge:
    """One look into the table, two into the desk, none into the bed."""
    knowledge = Knowledge(plan=toy_plan(), travel=toy_travel())
    for container in (TABLE, DESK, DESK):
        again = frozenset({container} & knowledge.first_seen.keys())
        knowledge = knowledge.with_another_look_at(again).seen(container, ())
    return knowledge


def test_a_look_in_vain_lowers_a_chance_and_never_to_zero() -> None:
    """Bayes: 0.5 * 0.25 / (0.5 + 0.5 * 0.25) = 0.2 for the mug on the table, 0.2 * 0.5 / (0.8 + 0.1) = 1/9 for the
    book. What is certainly in the desk is there after any number of looks in vain."""
    seen = Perception(p_detect=0.5, by_type={MUG: 0.75})
    after = after_looks(_belief(), _looked(), seen)
    assert after.of(MUG) == pytest.approx([0.2, 0.5, 1.0])
    assert after.of(BOOK) == pytest.approx([1 / 9, 0.2, 0.0])
    assert after.p_detect == (0.75, 0.5)
    assert after.only((BOOK,)).p_detect == (0.5,)


def test_with_perfect_looks_a_belief_is_as_it_was() -> None:
    belief = _belief()
    assert after_looks(belief, _looked(), PERFECT) is belief
    assert belief.detects(MUG) == 1.0


def test_another_look_adds_what_it_shows_and_forgets_nothing() -> None:
    knowledge = Knowledge(plan=toy_plan(), travel=toy_travel()).seen(TABLE, (item("Mug|1"),))
    assert TABLE not in knowledge.unsearched
    again = knowledge.with_another_look_at(frozenset({TABLE}))
    assert TABLE in again.unsearched
    after = again.seen(TABLE, (item("Book|1"),))
    assert after.items_at[TABLE] == after.first_seen[TABLE] == (item("Mug|1"), item("Book|1"))  # type: ignore[index]
    assert TABLE not in after.unsearched
    assert after.looks(TABLE) == 2


def test_posterior_by_hand() -> None:
    """A half and a miss of 0.2: 0.1 / 0.6; what cannot be missed is not there, however certain it was."""
    left = posterior_after_misses(np.array([0.5, 0.5, 1.0, 1.0]), np.array([0.2, 0.0, 0.3, 0.0]))
    assert left == pytest.approx([1 / 6, 0.0, 1.0, 0.0])
