"""The input of the compiled recipe search (astar.py) and its integer codes.

They are in a separate module because importing numba takes a while.
"""

from __future__ import annotations

from typing import NamedTuple

from workbench.arrays import Floats, Ints

FETCH, PLACE, CARRY, PREPARE, CHOOSE = range(5)
"""Moves of the search: (kind, slot or operation, place)."""

SOLVED, NO_PLAN, LIMIT = range(3)
"""How the search ended."""


class RecipeArrays(NamedTuple):
    """A recipe as arrays: its slots, its operations, and the costs between the problem's places.

    Attributes:
        d: distances in metres, shape (places, places).
        fetch: cost of walking to a slot's nearest instance, picking it and carrying it on; shape
            (slots, places, places); infinite without an instance.
        least: minimum of the reduced fetch cost over its origins, shape (potentials, slots, places).
        potential: shape (potentials, places); see lower_bounds.py.
        standing: whether an instance stands there already, shape (slots, places).
        end, in_hand: end: required final place of each slot, -1 for any; in_hand: whether it must be held there.
        op_slot, op_where: slots of each operation, -1 for none, and 1 for those in hand; shape (operations, parts).
        op_after: bit mask of operations that come before; they have smaller numbers.
        link: of each operation the one before and the one after at which the same slot stands, -1 for none, that
            slot (of the one after), and 1 if a tool must be put down before another operation; shape
            (operations, 4).
        n_ops: number of operations; the arrays have a row even if there is none.
        c: cost of a manipulation.
    """

    d: Floats
    fetch: Floats
    least: Floats
    potential: Floats
    standing: Ints
    end: Ints
    in_hand: Ints
    op_slot: Ints
    op_where: Ints
    op_after: Ints
    link: Ints
    n_ops: int
    c: float


class RecipeQuery(NamedTuple):
    """Where one search begins, and how far it goes.

    Attributes:
        robot, hand: the robot's location; the slot in its hand, or -1.
        spent: cost incurred before the first move.
        bound: only plans cheaper than this are sought.
        max_nodes: node limit.
        first: slot that must be fetched (or carried) first, or -1.
        staging: whether items may be put down at intermediate places where they are not used.
        weight: weight of the heuristic; 1 gives the optimum, larger weights find a plan sooner.
    """

    robot: int
    hand: int
    spent: float
    bound: float
    max_nodes: int
    first: int = -1
    staging: bool = False
    weight: float = 1.0
