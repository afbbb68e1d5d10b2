"""The settings entry that says how a costly estimator of a run asks its questions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any

import msgspec

from workbench.beliefs.asking.answered_estimator import AnsweredEstimator, AskingEstimator
from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.asking.chat import ChatQuestions
from workbench.beliefs.asking.prompt_file import Prompt
from workbench.beliefs.asking.state_questions import StateQuestions
from workbench.beliefs.belief import Estimator
from workbench.log_schema.events import EstimatorAnswer
from workbench.log_schema.settings_json import MalformedSettings

SETTING = "estimator"
"""The key among a run's settings; left out where the estimator asks nobody."""


class AskingKind(StrEnum):
    """How the questions of an estimator come about."""

    CHAT = "chat"
    """From the prompt, which is in the log."""
    STATE = "state"
    """They are states of knowledge."""
    OWN = "own"
    """By code of its own, which is not in the log."""


class AskingInfo(msgspec.Struct, frozen=True, kw_only=True):
    """How an estimator asks.

    Attributes:
        names_alone: whether no observation changes its beliefs.
        prompt: of a chat.
    """

    kind: AskingKind
    name: str
    model: str = ""
    names_alone: bool = False
    prompt: Prompt | None = None

    def asking(self) -> AskingEstimator | None:
        """What asks the same questions, and nobody; None where that takes code of its own."""
        if self.kind is AskingKind.CHAT and self.prompt is not None and self.prompt.name == self.name:
            return ChatQuestions(prompt=self.prompt)
        if self.kind is AskingKind.STATE:
            return StateQuestions(self.name, None, model=self.model, names_alone=self.names_alone)
        return None


def estimator_to_settings(estimator: Estimator) -> dict[str, Any]:
    """The entry for a run's settings; empty for an estimator that asks nobody."""
    if not isinstance(estimator, AnsweredEstimator):
        return {}
    asking = estimator.asking
    kind = AskingKind.OWN
    if isinstance(asking, ChatQuestions):
        kind = AskingKind.CHAT
    elif isinstance(asking, StateQuestions):
        kind = AskingKind.STATE
    info = AskingInfo(
        kind=kind,
        name=asking.name,
        model=asking.model,
        names_alone=asking.names_alone is True,
        prompt=asking.prompt if isinstance(asking, ChatQuestions) else None,
    )
    return {SETTING: msgspec.to_builtins(info)}


def asking_from_settings(settings: Mapping[str, Any]) -> AskingInfo | None:
    """How the estimator of a run asks; None where it asks nobody.

    Raises:
        MalformedSettings: the entry is invalid.
    """
    if SETTING not in settings:
        return None
    try:
        return msgspec.convert(settings[SETTING], AskingInfo)
    except msgspec.ValidationError as error:
        raise MalformedSettings(f"{SETTING}: {error}") from error


def answers_in(events: Iterable[EstimatorAnswer]) -> tuple[Answer, ...]:
    """A log's answers, as an estimator takes them."""
    return tuple(
        Answer(estimator=e.estimator, model=e.model, question=e.question, answer=e.answer, seconds=e.seconds)
        for e in events
    )
