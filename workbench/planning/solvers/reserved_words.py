"""Words of planners' PDDL grammars that no object may be named, by grammar.

A planner whose lexer knows a word everywhere reads an object of that name as a part of the language: ENHSP takes an
object `start` for the time specifier and then says that the task has no plan. Names of a problem that are in this
table get a number (pddl.pddl_names), for every planner alike, so that one printed task serves all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType


def _words(text: str) -> frozenset[str]:
    return frozenset(re.findall(r"\S+", text))


RESERVED_WORDS: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        "PDDL 3.1": _words(
            "define domain problem requirements types constants predicates functions constraints action derived "
            "parameters precondition effect condition duration objects init goal metric length serial parallel "
            "durative-action and or not imply forall exists when either number object increase decrease assign "
            "scale-up scale-down minimize maximize total-time total-cost is-violated preference always sometime "
            "within at-most-once sometime-after sometime-before always-within hold-during hold-after undefined "
            "at over start end all time"
        ),
        "PDDL 3.1, requirements": _words(
            "strips typing negative-preconditions disjunctive-preconditions equality existential-preconditions "
            "universal-preconditions quantified-preconditions conditional-effects fluents numeric-fluents "
            "object-fluents adl durative-actions duration-inequalities continuous-effects derived-predicates "
            "timed-initial-literals timed-initial-effects preferences action-costs contingent"
        ),
        "PDDL+": _words("process event"),
        "ENHSP": _words("unknown oneof abs sin cos tan asin acos atan constraint belief sqrt pow"),
        "unified-planning": _words("bool boolean integer real true false"),
        "this domain": _words(
            "object location item move pick place find rob-at hand-is-free holding is-at missing done move-cost "
            "find-cost"
        ),
    }
)

RESERVED: frozenset[str] = frozenset[str]().union(*RESERVED_WORDS.values())
