"""Hill climbing over consistent worlds towards a strategy's cheapest and most expensive run.

In a kitchen a container can answer in thousands of ways, of which branch-and-bound follows those with the fewest
items. Changing one item type in one container at a time finds runs that cost less, or more, than those. Every end
found is the cost in a consistent world; nothing found here bounds anything.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from replayers.counterfactual.bounds.bounds import Bounds
from replayers.counterfactual.relevance import NOTHING, Answer
from replayers.counterfactual.run_tree import Choose, Leaf, RunTree, UnobservedLook
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId, ItemType

Answers = Mapping[ContainerId, Answer]


def climbed_ends(tree: RunTree, known: Bounds, *, max_segments: int) -> tuple[Leaf, Leaf]:
    """The ends of a climb downwards and of one upwards.

    Args:
        known: the bounds so far. The climbs start from their cheapest and most expensive ends; down, from the run
            in the world whose first open container holds all that matters, if that is cheaper.
        max_segments: of each climb.
    """
    lucky = all_in_first(tree)
    low = min((known.cheapest or lucky, lucky), key=lambda leaf: leaf.cost)
    cheapest = climb(tree, low, up=False, max_segments=max_segments)
    return cheapest, climb(tree, known.most_expensive or lucky, up=True, max_segments=max_segments)


def climb(tree: RunTree, start: Leaf, *, up: bool, max_segments: int) -> Leaf:
    """The cheapest, or the most expensive, end on a first-improvement climb from the end of a run.

    Args:
        up: towards more expensive ends.
        max_segments: new segments of the loop after which no further world is tried.
    """
    spent = tree.segments + max_segments
    best = start
    improved = True
    while improved:
        improved = False
        for answers in _neighbours(tree, best):
            if tree.segments >= spent:
                return best
            end = tree.follow(_chooser(answers))
            if (end.cost - best.cost if up else best.cost - end.cost) > NEAR_COST:
                best, improved = end, True
                break
    return best


def all_in_first(tree: RunTree) -> Leaf:
    """The end of the run in the world whose first open container holds all that matters."""
    first = True

    def choose(unobserved: UnobservedLook) -> Answer:
        nonlocal first
        answer, first = (_possible(unobserved) if first else NOTHING), False
        return answer if _allows(unobserved, answer) else unobserved.options[0]

    return tree.follow(choose)


def _neighbours(tree: RunTree, leaf: Leaf) -> Iterator[Answers]:
    """The worlds that differ in one type in one of the containers that the run searched."""
    answers = {filled.container: filled.answer for filled in leaf.filled}
    for filled in leaf.filled:
        for item_type in filled.live:
            there = tuple(t for t in filled.answer if t != item_type)
            changed = there if item_type in filled.answer else tuple(sorted((*there, item_type)))
            yield {**answers, filled.container: changed}


def _chooser(answers: Answers) -> Choose:
    def choose(unobserved: UnobservedLook) -> Answer:
        answer = tuple(t for t in answers.get(unobserved.container, NOTHING) if t in unobserved.live)
        return answer if _allows(unobserved, answer) else unobserved.options[0]

    return choose


def _allows(unobserved: UnobservedLook, answer: Answer) -> bool:
    """Whether a container can give an answer: types that the options name, and all that the last one must hold."""
    if answer in unobserved.options:
        return True
    return (
        unobserved.others
        and set(answer) <= set(_possible(unobserved))
        and (
            Counter(unobserved.options[0]) <= Counter(answer)
            if unobserved.possible is None
            else unobserved.allows(answer)
        )
    )


def _possible(unobserved: UnobservedLook) -> tuple[ItemType, ...]:
    return tuple(sorted({t for option in unobserved.options for t in option}))
