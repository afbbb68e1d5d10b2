"""Items that the recorded looks may have overlooked: where they can be, how many, and how many misses are left.

A world with misses holds, besides what the log shows, at most `Evidence.misses` more items in containers that were
looked into while recording. Known contents are not doubted, and a replayed robot overlooks nothing. Where the task's
inventory lists a type that no look found though nothing was left to open, the looks and the inventory contradict one
another, and at least one item of each such type was overlooked.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations_with_replacement, islice

from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import MAX_ANSWERS, Answer, Relevance, imputed_items
from workbench.worlds.house import ContainerId, Item, ItemType
from workbench.worlds.knowledge import Knowledge

MAX_TRIED = 20_000
"""Contents of one container that are tried for whether they are possible; beyond this, they count as others."""


def contradicting_types(evidence: Evidence, relevance: Relevance) -> tuple[ItemType, ...]:
    """Types that are somewhere, by the inventory, though every place was opened without them; sorted."""
    if evidence.open or relevance.hidden:
        return ()
    return tuple(sorted(relevance.must_exist - evidence.seen_types()))


def misses_note(evidence: Evidence, contradicting: tuple[ItemType, ...]) -> str:
    """How many items are taken to have been overlooked, and in which looks; empty if none."""
    if not evidence.misses and not evidence.perception.perfect:
        return "the looks of this run could miss: bounds take them at their word; --misses K allows for K such items"
    if not evidence.misses:
        return ""
    count = f"{evidence.misses} item{'' if evidence.misses == 1 else 's'}"
    if not contradicting:
        return (
            f"at most {count} may have been overlooked in the {len(evidence.doubtful)} containers that were looked "
            "into: the bounds hold over all such worlds"
        )
    looks = f"the looks that may have missed: {', '.join(evidence.doubtful)}"
    return (
        f"the task lists {', '.join(contradicting)}, and every container was opened without it: at least one look "
        f"overlooked it. The bounds hold over all worlds in which no more than {count} escaped the looks; {looks}"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class PossibleContents:
    """What one container may hold beyond what the log shows of it, given what was found before.

    Attributes:
        most: per type that matters, how many more instances it may hold.
        missing: types that must be somewhere and were found nowhere.
        misses_left: how many items may still have been overlooked.
        spends: whether what it holds was overlooked: the log shows a look into it.
        open_left, doubtful_left: containers left besides this one, unopened and looked into.
    """

    most: Mapping[ItemType, int] = field(default_factory=dict[ItemType, int])
    missing: frozenset[ItemType]
    misses_left: int
    spends: bool
    open_left: int
    doubtful_left: int

    def allows(self, answer: Answer) -> bool:
        """Whether some consistent world has this answer: what is still missing must fit in what is left."""
        counted = Counter(answer)
        if any(n > self.most.get(t, 0) for t, n in counted.items()):
            return False
        left = self.misses_left - (len(answer) if self.spends else 0)
        if left < 0:
            return False
        missing = len(self.missing - counted.keys())
        return not missing or self.open_left > 0 or (self.doubtful_left > 0 and missing <= left)

    def options(self) -> tuple[tuple[Answer, ...], bool]:
        """The answers with the fewest items, at most MAX_ANSWERS, smallest first; whether there are others."""
        found: list[Answer] = []
        tried = 0
        for answer in islice(self._by_size(), MAX_TRIED + 1):
            tried += 1
            if self.allows(answer):
                if len(found) == MAX_ANSWERS:
                    return tuple(found), True
                found.append(answer)
        return tuple(found), tried > MAX_TRIED

    def _by_size(self) -> Iterator[Answer]:
        every = sum(self.most.values())
        largest = min(every, self.misses_left) if self.spends else every
        types = sorted(self.most)
        for size in range(largest + 1):
            for answer in combinations_with_replacement(types, size):
                if all(answer.count(t) <= self.most[t] for t in set(answer)):
                    yield answer


def possible_contents(
    evidence: Evidence, relevance: Relevance, container: ContainerId, knowledge: Knowledge
) -> PossibleContents:
    """What a container may hold beyond the log, at a look with this knowledge."""
    seen, shown = knowledge.first_seen, evidence.seen_types()
    found = {item.type for c in (*evidence.open, *evidence.doubtful) if c in seen for item in seen[c]}
    live = relevance.live(knowledge)
    if evidence.tags is not None:  # what was seen in passing is found too
        found |= {t for t in live if knowledge.has_known_instance(t)}
    there = Counter(item.type for item in evidence.contents.get(container, ()))
    known = shown | found
    most = {t: 0 if relevance.unique and t in known else max(0, relevance.most[t] - there[t]) for t in live}
    missing = frozenset[ItemType]() if relevance.hidden else relevance.must_exist.intersection(live) - known
    return PossibleContents(
        most=most,
        missing=missing,
        misses_left=evidence.misses_left(knowledge),
        spends=container in evidence.doubtful,
        open_left=sum(c not in seen and c != container for c in evidence.open),
        doubtful_left=sum(c not in seen and c != container for c in evidence.doubtful),
    )


def may_be_sighted(
    evidence: Evidence, relevance: Relevance, container: ContainerId, seeking: Iterable[ItemType], before: Knowledge
) -> Iterator[Item]:
    """Items whose tags a robot may see in a container in passing and turn for: one of each type that it seeks, or
    that the task needs and of which it knows none, if the container may hold one.

    Args:
        before: what the robot knows as it sets out.
    """
    sought = frozenset(seeking)
    shown = {item.type: item for item in reversed(evidence.shown_in(container))}
    for item_type in relevance.live_and_shown(before):
        if item_type not in sought and before.has_known_instance(item_type):
            continue
        if item_type in shown:
            yield shown[item_type]
        elif item_type in relevance.types and _may_hold(evidence, relevance, container, item_type, before):
            yield from imputed_items((item_type,), container, evidence.contents.get(container))


def _may_hold(
    evidence: Evidence, relevance: Relevance, container: ContainerId, item_type: ItemType, before: Knowledge
) -> bool:
    """Whether a container may hold an instance of a type beyond what the log shows: it is open, or the look into it
    missed that, and what is missing otherwise may still be somewhere."""
    if container not in evidence.contents:
        return True
    if container not in evidence.doubtful:
        return False
    possible = possible_contents(evidence, relevance, container, before)
    left = possible.misses_left - 1
    return left >= 0 and (possible.open_left > 0 or len(possible.missing - {item_type}) <= left)
