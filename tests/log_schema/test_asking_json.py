"""How a run's estimator asks, as an entry of its settings: round trip, and entries that are none."""

from __future__ import annotations

import msgspec
import pytest

from workbench.beliefs.asking.answered_estimator import answered
from workbench.beliefs.asking.chat import ChatQuestions
from workbench.beliefs.asking.prompt_file import ChatEndpoint, Prompt
from workbench.beliefs.asking.state_questions import StateQuestions
from workbench.beliefs.estimators import estimator
from workbench.log_schema.asking_json import SETTING, AskingKind, asking_from_settings, estimator_to_settings
from workbench.log_schema.settings_json import MalformedSettings

PROMPT = Prompt(stem="rooms", model="m", text="{item} {containers} {seen}", temperature=0.5)


def test_a_prompt_is_kept_and_where_to_ask_is_not() -> None:
    chat = ChatQuestions(prompt=PROMPT, endpoint=ChatEndpoint(url="http://secret:1/v1", key_env="OUR_KEY"))
    entry = estimator_to_settings(answered(chat, may_ask=True))
    assert b"secret" not in msgspec.json.encode(entry)
    assert b"OUR_KEY" not in msgspec.json.encode(entry)
    info = asking_from_settings(msgspec.json.decode(msgspec.json.encode(entry)))
    assert info is not None
    assert (info.kind, info.name, info.model, info.names_alone) == (AskingKind.CHAT, PROMPT.name, "m", False)
    assert info.asking() == ChatQuestions(prompt=PROMPT)


def test_a_prompt_of_another_name_asks_nothing() -> None:
    entry = estimator_to_settings(answered(ChatQuestions(prompt=PROMPT), may_ask=False))
    entry[SETTING]["prompt"]["text"] = "another {item} {containers}"
    info = asking_from_settings(entry)
    assert info is not None
    assert info.asking() is None


def test_one_that_is_costly_as_a_whole_is_kept() -> None:
    entry = estimator_to_settings(answered(StateQuestions("e@1", None, model="m", names_alone=True), may_ask=False))
    info = asking_from_settings(entry)
    assert info is not None
    asking = info.asking()
    assert isinstance(asking, StateQuestions)
    assert (asking.name, asking.model, asking.names_alone) == ("e@1", "m", True)


def test_an_estimator_that_asks_nobody_has_no_entry() -> None:
    assert estimator_to_settings(estimator("counts")) == {}
    assert asking_from_settings({}) is None


@pytest.mark.parametrize("entry", [7, {}, {"kind": "spell", "name": "e"}, {"kind": "chat", "name": "e", "prompt": 7}])
def test_an_entry_that_is_none_is_one_line(entry: object) -> None:
    with pytest.raises(MalformedSettings, match=SETTING):
        asking_from_settings({SETTING: entry})
