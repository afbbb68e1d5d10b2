"""Beliefs of a language model: one question for each item type, about all containers of the place.

As in work that asks language models for such priors (arXiv:2603.23800). The answer is a JSON object of probabilities
by container; where it leaves one out, that is improbable.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, cast, final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.asking.prompt_file import CONTAINERS, ITEM, SEEN, ChatEndpoint, Prompt
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge

MIN_PROBABILITY, MAX_PROBABILITY = 0.001, 0.999
"""Probabilities are kept within these: a model that is certain may be wrong, and planning must go on."""

MAX_OBJECTS = 50
"""Opening braces that are tried for the JSON object in an answer."""

_FIELD = re.compile("|".join(re.escape(field) for field in (ITEM, CONTAINERS, SEEN)))


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ChatQuestions:
    """An AskingEstimator that asks a language model.

    Attributes:
        prompt: how it is asked.
        endpoint: where; None in a replay that asks nobody.
    """

    prompt: Prompt
    endpoint: ChatEndpoint | None = None

    @property
    def name(self) -> str:
        return self.prompt.name

    @property
    def model(self) -> str:
        return self.prompt.model

    @property
    def names_alone(self) -> bool:
        return self.prompt.names_alone

    def questions(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> tuple[str, ...]:
        containers, seen = _containers(knowledge), "" if self.names_alone else _seen(knowledge)
        return tuple(_filled(self.prompt.text, {ITEM: t, CONTAINERS: containers, SEEN: seen}) for t in item_types)

    def ask(self, question: str) -> str:
        if self.endpoint is None:
            raise EstimatorFailed(self.name, "it may not ask anything here")
        from workbench.beliefs.asking.chat_client import complete

        return complete(self.prompt, self.endpoint, question)

    def probabilities(
        self, knowledge: Knowledge, item_types: tuple[ItemType, ...], answers: tuple[str, ...]
    ) -> Floats:
        all_containers = frozenset(str(c.id) for c in knowledge.plan.containers)
        rows = [self._row(text, all_containers) for text in answers]
        return np.array(
            [[row.get(str(c), MIN_PROBABILITY) for c in knowledge.unsearched] for row in rows], dtype=np.float64
        ).reshape(len(item_types), len(knowledge.unsearched))

    def _row(self, answer: str, containers: frozenset[str]) -> dict[str, float]:
        """Probabilities by container, within LEAST and MOST.

        Raises:
            EstimatorFailed: no JSON object that names a container, or a value that is no probability.
        """
        for at in [m.start() for m in re.finditer(r"\{", answer)][:MAX_OBJECTS]:
            try:
                found: object = json.JSONDecoder().raw_decode(answer, at)[0]
            except (ValueError, RecursionError):
                continue
            named = {k: v for k, v in cast("dict[str, Any]", found).items() if k in containers}
            if named:
                return {c: self._probability(c, value) for c, value in named.items()}
        shown = " ".join(answer.split())[:60]
        raise EstimatorFailed(
            self.name,
            f"its answer {shown!r} holds no JSON object of probabilities by container",
            "Ask for it in the prompt, or use another model",
        )

    def _probability(self, container: str, value: object) -> float:
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else float("nan")
        if not isfinite(number) or not 0 <= number <= 1:
            raise EstimatorFailed(
                self.name,
                f"its answer gives {container[:40]} {str(value)[:40]!r}, which is not a probability",
                "Ask for it in the prompt, or use another model",
            )
        return min(MAX_PROBABILITY, max(MIN_PROBABILITY, number))


def _filled(text: str, values: Mapping[str, str]) -> str:
    """The prompt with its fields filled in, each once: what is filled in is not searched for fields."""
    return _FIELD.sub(lambda found: values[found.group()], text)


def _containers(knowledge: Knowledge) -> str:
    """One line a container: its id, its type and the kind of its room."""
    kinds = {room.id: room.kind for room in knowledge.plan.rooms}
    return "\n".join(f"{c.id}: {c.type} in {kinds[c.room]}" for c in knowledge.plan.containers)


def _seen(knowledge: Knowledge) -> str:
    """One line a searched container: what it held."""
    lines = [
        f"{c}: {', '.join(sorted(str(i.type) for i in items)) or 'nothing'}"
        for c, items in sorted(knowledge.first_seen.items())
    ]
    return "\n".join(lines) or "nothing yet"
