"""Tolerances: how close two numbers count as equal, and what counts as nothing, for each kind of number.

Parameters of models, such as the least probability of an estimator, are no tolerances and stand beside their model.
"""

from __future__ import annotations

NEAR_COST = 1e-6
"""Costs closer than this are equal: logs round to six decimals, and sums of the same legs in another order differ by
less."""
NEAR_ROUNDED = 2e-6
"""Numbers (of costs: shares of them, at least of 1) closer than this are equal where both are rounded by a log."""
NEAR_LOGGED_COST = 1e-5
"""The total of a run and its replay are equal if closer than this share of it (at least of 1)."""
NEAR_LOGGED_SUM = 1e-2
"""Sums of the rounded costs of a whole run are equal if closer than this."""
NEAR_SAMPLED_COST = 1e-4
"""Costs of sampled worlds closer than this are one value."""
NEAR_SHOWN_COST = 0.05
"""Costs closer than this look equal: they are shown with one decimal."""

RELATIVE = 1e-9
"""Costs that differ by less than this share of them are equal in a decision (workbench/search/ties.py)."""
MIN_SCALE = 1.0
"""Metres (or probability): below it the tolerance of a decision shrinks no further."""
ROUNDING_SHARE = 1e-12
"""A bound is lowered by this share, so that a sum in another order does not exceed it by rounding."""

ROUNDING = 1e-9
"""More than rounding adds to a sum of a few numbers near 1; such sums are compared and cut to integers with it."""
NEAR_PROBABILITY = 1e-6
"""Probabilities may pass 1 by this much, by rounding."""
EQUAL_PROBABILITY = 1e-12
"""Probabilities closer than this are equal: only the last bits differ."""
NEWTON_STEP = 1e-14
"""A smaller step of Newton's method ends it."""
NO_CHANCE = 1e-12
"""Added to every probability; of containers that are believed to hold nothing, the nearest then comes first."""

MIN_LENGTH_M = 1e-6
"""A shorter segment is a point: it has no direction."""
MIN_AREA_M2 = 1e-6
"""A smaller polygon has no inside."""
MIN_ANGLE_RAD = 1e-6
"""A smaller rotation is none."""
MIN_SLOPE = 1e-6
"""A flatter ray is level."""
MIN_STEP_S = 1e-6
"""A shorter step of a simulation is made this long, so that it ends."""
DEGENERATE = 1e-12
"""Below this cross product, part of a direction or squared size of a quaternion, there is no direction."""
TINY = 1e-9
"""Used in place of 0 where a length or duration divides, or where 0 would mean that there is no edge."""
SMALLEST = 1e-300
"""Used in place of 0 in a denominator of a continued fraction."""
FRACTION_ACCURACY = 1e-15
"""A continued fraction ends at a factor closer to 1 than this."""

NEAR_SHOWN_S = 0.1
"""Moments in seconds that a person read off a view, which shows tenths."""
