"""The state that a run of a certificate is in, as the checker keeps it: what two branches go on from alike.

Branches that reach the same state cost the same from there on, so a certificate writes out the first one alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from typing import final

from replayers.certificates.claim import ClaimedItem, ClaimedStep
from replayers.counterfactual.evidence import Evidence
from workbench.worlds.house import START, ContainerId


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class KnownState:
    """Where the robot is, what it holds, what it opened, where the items that it knows of stand, and what it found.

    Attributes:
        items: by id, the type and the location; None for the one in the robot's hand.
        found: the types that unopened containers turned out to hold.
    """

    evidence: Evidence = field(repr=False)
    at: str = START
    held: str | None = None
    opened: frozenset[str] = frozenset()
    items: Mapping[str, tuple[str, str | None]] = field(default_factory=dict[str, tuple[str, str | None]])
    found: frozenset[str] = frozenset()

    def after(self, steps: tuple[ClaimedStep, ...]) -> KnownState:
        at, held, opened, items = self.at, self.held, set(self.opened), dict(self.items)
        for step in steps:
            at = step.target
            if step.action == "search":
                opened.add(at)
                seen = {item.id: (item.type, at) for item in self.evidence.contents[ContainerId(at)]}
                items = {**seen, **items}
            for item in step.items:
                held = item if step.action == "pick" else None
                items[item] = (items[item][0], None if step.action == "pick" else at)
        return replace(self, at=at, held=held, opened=frozenset(opened), items=items)

    def answered(self, container: str, inside: tuple[ClaimedItem, ...]) -> KnownState:
        return replace(
            self,
            opened=self.opened | {container},
            items={**self.items, **{item.id: (item.type, container) for item in inside}},
            found=self.found | {item.type for item in inside},
        )

    def key(self, needs: AbstractSet[str], wanted: AbstractSet[tuple[str, str]], sure: AbstractSet[str]) -> Hashable:
        """What a run goes on from.

        Args:
            needs: the items that it picks up or puts down.
            wanted: item types with where the goal wants them; how many of them stand there matters of all others.
            sure: the types that matter only by whether one was found.
        """
        rest = Counter(at for i, at in self.items.items() if i not in needs and i != self.held and at in wanted)
        items = frozenset((i, at) for i, at in self.items.items() if i in needs or i == self.held)
        return self.at, self.held, self.opened, items, frozenset(rest.items()), self.found & sure


def state_at_start(evidence: Evidence) -> KnownState:
    items: dict[str, tuple[str, str | None]] = {
        item.id: (item.type, container) for container in evidence.known for item in evidence.contents[container]
    }
    return KnownState(evidence=evidence, opened=frozenset(evidence.known), items=items)
