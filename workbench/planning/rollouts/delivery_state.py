"""The state of a delivery as arrays, and the scratch arrays of its rollouts (kernels.py)."""

from __future__ import annotations

from typing import NamedTuple

from workbench.arrays import Bools, Floats, Ints, Ints8


class DeliveryState(NamedTuple):
    """The state of a delivery as arrays, with K wants, n unsearched containers, L locations, F wants that a find may
    be planned for, and c candidates of each.

    Attributes:
        metres: travel distances, shape (L, L).
        containers, targets: location indices of the containers, shape (n,), and of the wants' targets, shape (K,).
        alternatives: bit masks of wants; meeting all wants of any one mask meets the goal.
        done: bit mask of the wants already met.
        hand: index of the want whose item is held, or -1.
        robot: location index.
        places, known: location indices of known instances, shape (K, any), and their number, shape (K,).
        chance: probability that a container holds the type, not conditioned on existence
            (remaining.unconditioned), shape (K, n).
        find: a want's row in the arrays below, or -1 where no find may be planned, shape (K,).
        candidates: container indices of the candidates of Eq. 1, shape (F, c).
        missing: remaining.still_missing_by_subset, shape (F, 2**c).
        onward: expected cost still to come after a subset has been searched, by the last one searched, shape
            (F, 2**c, c).
        beyond: cost of a find after all candidates have been searched, shape (F,).
        look, handle: action costs in cost units.
    """

    metres: Floats
    containers: Ints
    targets: Ints
    alternatives: Ints
    done: int
    hand: int
    robot: int
    places: Ints
    known: Ints
    chance: Floats
    find: Ints
    candidates: Ints
    missing: Floats
    onward: Floats
    beyond: Floats
    look: float
    handle: float


class Scratch(NamedTuple):
    """Scratch arrays that all rollouts from one state share, one after the other.

    A move is to look into a container (its index, below n), or to fetch a want's item, or to go on carrying it, and
    deliver it (n and the want's index).

    Attributes:
        number: which candidate of a find each container is, -1 for none, shape (F, n).
        searched: searched containers, shape (n,); subset: bit mask of each find's searched candidates, shape (F,).
        places, known: as in DeliveryState, plus the instances found since.
        legs: cost of delivering each want from the robot's location (row 0) and from each target, shape (K + 1, K).
        rest: cost of the remaining wants (a mask), by the want delivered last, shape (2**K, K + 1).
        keys, finds, first: cache of finds across worlds, by the move that led to where they begin, the find and the
            subset: the keys, the costs, and the candidates looked into first; shape (slots,).
        look: the candidate that each want's search from the robot's location looks into first, shape (K,).
        ahead: cost of a find that looks into each candidate first, shape (c,).
        worlds: the worlds, ordered so that those which have shown the same so far stand together, shape (worlds,).
        path: the moves that led to a state, one row each (kernels.MOVE and the following), shape (n + K + 1, 7).
        spent: the cost up to each of them, shape (n + K + 1,).
    """

    number: Ints
    searched: Bools
    subset: Ints
    known: Ints
    places: Ints
    legs: Floats
    rest: Floats
    keys: Ints
    finds: Floats
    first: Ints8
    look: Ints
    ahead: Floats
    worlds: Ints
    path: Ints
    spent: Floats
