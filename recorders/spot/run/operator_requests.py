"""Requests by key from the operator of a run while the robot moves: pause, go on, skip, item seen."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from workbench.log_schema.corrections import said_there
from workbench.terminal import say
from workbench.worlds.house import Item

RUN_KEYS = "Keys: space or s stop, p pause, g go on, k skip this container, i it is there, n mark."
SKIPPED = "the operator skips it"


@dataclass(slots=True)
class OperatorRequests:
    """The operator's requests, set by a thread that reads keys and taken by the run.

    Attributes:
        paused: whether the robot stands until the operator lets it go on.
    """

    paused: bool = False
    _skip: bool = False
    _there: list[Item] = field(default_factory=list)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def skip(self) -> None:
        with self._lock:
            self._skip = True

    @property
    def skipping(self) -> bool:
        """Whether the container at hand is to be skipped; the request stays."""
        return self._skip

    def there(self, item: Item) -> None:
        with self._lock:
            self._there.append(item)

    def take_skip(self) -> bool:
        """Whether the container at hand is to be skipped; the request is then taken."""
        with self._lock:
            skip, self._skip = self._skip, False
            return skip

    def take_there(self) -> tuple[Item, ...]:
        """The items that the operator says are here; returned once."""
        with self._lock:
            items, self._there = tuple(self._there), []
            return items

    def forget(self) -> None:
        """Drop requests about a container that the robot has left."""
        self.take_skip()
        self.take_there()


@dataclass(slots=True)
class RunKeys:
    """The keys of a run but for those that stop it and answer questions.

    Args:
        requests: what the keys set.
        items: the items that "it is there" may be about; the first nine.
        note: writes a note into the log.
    """

    requests: OperatorRequests
    items: Sequence[Item]
    note: Callable[[str], None]
    _choosing: bool = False

    def press(self, key: str) -> None:
        choosing, self._choosing = self._choosing, False
        lower = key.lower()
        if choosing and key.isdecimal() and 1 <= int(key) <= len(self.items[:9]):
            self._say_there(self.items[int(key) - 1])
        elif lower in ("m", "n"):
            self.note("mark")
        elif lower == "p":
            self.requests.paused = True
            self._say("Pause: the robot stands until g is pressed; an arm motion is ended first")
        elif lower == "g":
            self.requests.paused = False
            self._say("The robot may go on")
        elif lower == "k":
            self.requests.skip()
            self._say("Skip this container")
        elif lower == "i" and len(self.items) == 1:
            self._say_there(self.items[0])
        elif lower == "i" and self.items:
            self._choosing = True
            said = ", ".join(f"{number} {item.id}" for number, item in enumerate(self.items[:9], 1))
            say(f"Which is here? {said}; any other key: none.")

    def _say_there(self, item: Item) -> None:
        self.requests.there(item)
        self._say(said_there(item.id))

    def _say(self, text: str) -> None:
        self.note(text)
        say(text)
