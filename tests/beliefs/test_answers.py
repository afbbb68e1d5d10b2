"""Answers: each asked for once, kept on disk, and never taken for another's."""

from __future__ import annotations

from pathlib import Path

import pytest

from workbench.beliefs.asking.answers import FOLDER, Answer, AnswerBook, NotAnswered


def an_answer(question: str, *, estimator: str = "e@1", answer: str = "yes") -> Answer:
    return Answer(estimator=estimator, model="m", question=question, answer=answer, seconds=0.5)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    return tmp_path / FOLDER


def test_an_answer_of_the_log_is_taken_and_another_estimators_is_not() -> None:
    book = AnswerBook("e@1", [an_answer("a"), an_answer("b", estimator="e@2")])
    assert book.answer("a") == an_answer("a")
    with pytest.raises(NotAnswered, match=r"nobody recorded its answer to 'b'\. Ask for it with --ask"):
        book.answer("b")


def test_what_was_kept_is_not_asked_again_by_anyone() -> None:
    asked: list[str] = []

    def ask(question: str) -> Answer:
        asked.append(question)
        return an_answer(question)

    book = AnswerBook("e@1", ask=ask)
    book.keep([book.answer("a")])
    assert book.answer("a") == AnswerBook("e@1").answer("a") == an_answer("a")
    assert asked == ["a"]
    book.answer("b")
    assert asked == ["a", "b"]
    with pytest.raises(NotAnswered):
        AnswerBook("e@1").answer("b")


def test_the_cache_tells_estimators_apart_and_distrusts_its_files(own_cache: Path) -> None:
    AnswerBook("e@1", ask=an_answer).keep([an_answer("a")])
    with pytest.raises(NotAnswered):
        AnswerBook("e@2").answer("a")
    (file,) = own_cache.rglob("*.json")
    whole = file.read_bytes()
    for data in (b"", b"{}", whole[:-1], whole.replace(b'"a"', b'"c"'), b"\xff", whole.replace(b"e@1", b"e@2")):
        file.write_bytes(data)
        with pytest.raises(NotAnswered):
            AnswerBook("e@1").answer("a")


def test_without_a_cache_answers_are_kept_in_memory(monkeypatch: pytest.MonkeyPatch, own_cache: Path) -> None:
    monkeypatch.setenv("LIOS_CACHE", "off")
    book = AnswerBook("e@1", ask=an_answer)
    book.keep([an_answer("a", answer="kept")])
    assert book.answer("a").answer == "kept"
    assert not own_cache.exists()


def test_a_cache_that_cannot_be_written_costs_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "file"))
    book = AnswerBook("e@1")
    book.keep([an_answer("a")])
    assert book.answer("a") == an_answer("a")
