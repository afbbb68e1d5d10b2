"""What distinguishes states of knowledge to a strategy, and a strategy that decides once for each of them."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import final

from replayers.counterfactual.decisions.needed_items import NeededItems
from replayers.counterfactual.decisions.watched_belief import Read, decide_watched
from replayers.counterfactual.relevance import Relevance
from workbench.caches import Cache
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge, Places

MAX_CACHED_DECISIONS = 50_000


@final
@dataclass(frozen=True, slots=True)
class StateKey:
    """The key by which states are the same to a strategy: where things that still matter stand, and where one may
    still look; where beliefs depend on every observation, also all that was found.

    Attributes:
        relevance: which types still matter.
        static_beliefs: whether beliefs depend on names alone, or are not used.
        misses_left: where looks may have missed, how many items may still be overlooked.
        needed: of items that still matter, which distinguish states; None where all do.
    """

    relevance: Relevance
    static_beliefs: bool
    misses_left: Callable[[Knowledge], int] | None = None
    needed: NeededItems | None = None

    def __call__(self, knowledge: Knowledge) -> Hashable:
        live = self.relevance.live_and_shown(knowledge)
        held = knowledge.holding.id if knowledge.holding else None
        return (
            live,
            knowledge.robot_at,
            held,
            tuple([(at, item.id) for t in live for at, item in self._where(t, knowledge)]),
            knowledge.unsearched,
            knowledge.facts,
            knowledge.closed,
            () if self.static_beliefs else tuple((c, knowledge.first_seen[c]) for c in sorted(knowledge.first_seen)),
            self.misses_left(knowledge) if self.misses_left is not None else 0,
        )

    def _where(self, item_type: ItemType, knowledge: Knowledge) -> Places:
        return knowledge.where(item_type) if self.needed is None else self.needed.of(item_type, knowledge)


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionBasis:
    """What a decision was made by.

    Attributes:
        view: all that the strategy was shown.
        read: of the view's belief, the item types whose rows the strategy read.
    """

    view: View
    read: Read


@final
class MemoizedStrategy:
    """A strategy that is asked once for each state that it can distinguish.

    Args:
        watch: whether to note which beliefs it reads; otherwise it counts as reading none.

    Attributes:
        basis: that of the last decision; None before the first.
        ambiguous: since this was last set to False, several plans were equally good in some state, so that what the
            key leaves out decided.
    """

    def __init__(self, strategy: Strategy, key: StateKey, *, watch: bool) -> None:
        self._strategy = strategy
        self._key = key
        self._key_of_all = replace(key, needed=None)
        self._watch = watch
        self._made: Cache[Hashable, tuple[Decision, Read, bool, bool]] = Cache(MAX_CACHED_DECISIONS)
        self._apart: Cache[Hashable, tuple[Decision, Read]] = Cache(MAX_CACHED_DECISIONS)
        self.basis: DecisionBasis | None = None
        self.ambiguous = False

    @property
    def name(self) -> str:
        return self._strategy.name

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return self._strategy.relevant_types(task)

    def decide(self, view: View) -> Decision:
        made, read, clear, by_key = self._made.get(self._key(view.knowledge), lambda: self._decide(view))
        if not clear:
            self.ambiguous = True
            made, read = self._apart.get(self._key_of_all(view.knowledge), lambda: self._ask(view))
        elif not by_key:
            made, read = self._ask(view)
        self.basis = DecisionBasis(view=view, read=read)
        return made

    def _decide(self, view: View) -> tuple[Decision, Read, bool, bool]:
        """A decision, what it read, whether only one plan is best, and whether the key holds all items that it
        names: where manipulations cost nothing, a plan may handle what no longer matters."""
        needed = self._key.needed
        made, read = self._ask(view)
        clear = needed is None or needed.one_plan_is_best(view.knowledge)
        live = self._key.relevance.live_and_shown(view.knowledge)
        by_key = view.costs.manipulation > 0 or all(t in live for step in made.plan.steps for t in step.item_types)
        return made, read, clear, by_key

    def _ask(self, view: View) -> tuple[Decision, Read]:
        return decide_watched(self._strategy, view) if self._watch else (self._strategy.decide(view), ())
