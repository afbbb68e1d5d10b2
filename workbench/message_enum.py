"""Outcomes of checks and commands: enumerations of messages, and single results that fill in the details."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Generic, Self, TypeVar


class MessageEnum(Enum):
    """The outcomes of one check or command.

    The value of a member is its message, with a field such as {item} for what differs from case to case; "" where
    there is nothing to say.
    """

    def result(self, **details: str) -> Result[Self]:
        """This outcome in one case.

        Args:
            details: the text of every field of the message.
        """
        return Result(kind=self, details=tuple(details.items()))


Kind = TypeVar("Kind", bound=MessageEnum, covariant=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Result(Generic[Kind]):
    """An outcome with its details, each the name and the text of a field of the message."""

    kind: Kind
    details: tuple[tuple[str, str], ...] = ()

    @property
    def message(self) -> str:
        """The outcome in words; "" where there is nothing to say."""
        return self.kind.value.format_map(dict(self.details))
