"""Costly answers, each obtained once: from a log, from the cache on disk, or by asking."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import final

import msgspec

from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.files import cache_folder, write_atomically

MAX_QUESTION_BYTES, MAX_ANSWER_BYTES = 1 << 20, 1 << 20
MAX_CACHE_FILE_BYTES = 3 * (MAX_QUESTION_BYTES + MAX_ANSWER_BYTES)

FOLDER = "answers"
"""Of the cache folder."""


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """One answer.

    Attributes:
        estimator: who asked, with a hash of all that shapes question and answer: "chat-rooms@1a2b3c4d".
        model: who answered.
        question, answer: as sent and received.
        seconds: how long it took when it was asked.
    """

    estimator: str
    model: str
    question: str
    answer: str
    seconds: float


class NotAnswered(EstimatorFailed):
    """An answer is needed that nobody recorded, and nobody may be asked."""

    def __init__(self, estimator: str, question: str) -> None:
        lines = [line.strip() for line in question.splitlines() if line.strip()]
        shown = lines[0] if lines else ""
        super().__init__(
            estimator,
            f"nobody recorded its answer to {shown if len(shown) <= 70 else shown[:67] + '...'!r}",
            "Ask for it with --ask and --estimator, or hold the log's first belief fixed with --estimator first",
        )


@final
class AnswerBook:
    """The answers of one estimator, by question.

    Args:
        estimator: the estimator's name.
        known: answers of a log; those of other estimators are passed over.
        ask: asks a question; None where nobody may be asked.
    """

    def __init__(
        self,
        estimator: str,
        known: Iterable[Answer] = (),
        *,
        ask: Callable[[str], Answer] | None = None,
    ) -> None:
        self._estimator = estimator
        self._known = {a.question: a for a in known if a.estimator == estimator}
        self._ask = ask

    def answer(self, question: str) -> Answer:
        """The answer to a question.

        Raises:
            NotAnswered: nobody recorded it, and nobody may be asked.
            EstimatorFailed: no answer was given.
        """
        known = self._known.get(question) or self._from_cache(question)
        if known is None:
            if self._ask is None:
                raise NotAnswered(self._estimator, question)
            known = self._ask(question)
        return known

    def keep(self, answers: Sequence[Answer]) -> None:
        """Keep answers that were of use. Where the cache cannot be written, they are kept in memory alone."""
        for answer in answers:
            if answer.question in self._known:
                continue
            self._known[answer.question] = answer
            path = self._path(answer.question)
            if path is not None and not path.exists():
                with suppress(OSError):
                    path.parent.mkdir(parents=True, exist_ok=True)
                    write_atomically(path, msgspec.json.encode(answer))

    def _from_cache(self, question: str) -> Answer | None:
        path = self._path(question)
        if path is None:
            return None
        try:
            if path.stat().st_size > MAX_CACHE_FILE_BYTES:
                return None
            answer = msgspec.json.decode(path.read_bytes(), type=Answer)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
            return None
        return answer if (answer.estimator, answer.question) == (self._estimator, question) else None

    def _path(self, question: str) -> Path | None:
        root = cache_folder()
        if root is None:
            return None
        key = hashlib.sha256(f"{self._estimator}\n{question}".encode("utf-8", "surrogatepass")).hexdigest()
        return root / FOLDER / key[:2] / f"{key}.json"
