"""The certificate of what a strategy costs over one log, as JSON in a zip file: docs/certificates.md says each field.

Written here, and checked by tools/check_claim.py, which imports nothing of this project.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec

from workbench.errors import OutputExists
from workbench.files import atomic, file_to_replace, make_folder

CLAIM_VERSION = 2
CLAIM_MEMBER = "claim.json"
STAMP = (1980, 1, 1, 0, 0, 0)
"""The time of the member in the zip file: the same claim gives the same bytes."""


class ClaimedItem(msgspec.Struct, frozen=True, kw_only=True):
    id: str
    type: str


class ClaimedStep(msgspec.Struct, frozen=True, kw_only=True):
    """One action of the run, with what it costs."""

    action: str
    origin: str
    target: str
    items: tuple[str, ...]
    cost: float


class ClaimedEnd(msgspec.Struct, frozen=True, kw_only=True):
    """The end of a run: whether the goal is met, and what is charged for the whole run."""

    done: bool
    charged: float


class ClaimedOuter(msgspec.Struct, frozen=True, kw_only=True):
    """A branch that was not followed: it costs at least this, and nothing says how much at most."""

    least: float
    why: str


class ClaimedLook(msgspec.Struct, frozen=True, kw_only=True):
    """A look into a container that nobody opened, and what follows each of its answers.

    Attributes:
        live: the item types that still matter.
        cost: of the look.
        others: what follows all answers besides the listed ones; None where the list holds every one.
    """

    container: str
    live: tuple[str, ...]
    cost: float
    answers: tuple[ClaimedAnswer, ...]
    others: ClaimedOuter | None = None


class ClaimedNode(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A segment of the run; then a look, an end, or an outer bound: exactly one of them.

    Attributes:
        id: names the branch, where others go on as it does.
        times: with an id, how many others do.
        needs: with an id, the items known at its start that it picks up or puts down; of all others it only matters
            how many stand where the goal wants them.
        same: instead of all else, the branch as which this one goes on.
    """

    id: int | None = None
    same: int | None = None
    times: int | None = None
    needs: tuple[str, ...] | None = None
    steps: tuple[ClaimedStep, ...] = ()
    look: ClaimedLook | None = None
    end: ClaimedEnd | None = None
    outer: ClaimedOuter | None = None


class ClaimedAnswer(msgspec.Struct, frozen=True, kw_only=True):
    items: tuple[ClaimedItem, ...]
    then: ClaimedNode


class ClaimedBound(msgspec.Struct, frozen=True, kw_only=True):
    """One end of the claim.

    Attributes:
        cost: None where no bound is known.
        kind: "leaf" where a run ends with it, "outer" where it follows from outer bounds.
        world: per container that is opened, the item types in it; None for an outer bound.
        path: the numbers of the answers on the way there, from 0.
    """

    cost: float | None
    kind: str
    world: dict[str, tuple[str, ...]] | None
    path: tuple[int, ...] | None


class CostClaim(msgspec.Struct, frozen=True, kw_only=True):
    """What a strategy costs over one log, with everything that shows it.

    Attributes:
        log, log_sha256: the log's file name and hash.
        strategy, strategy_version, estimator: who was run; nobody but this program can run them again.
        types: the item types that matter in containers that nobody opened.
        seal: SHA-256 of all the rest.
    """

    version: int = CLAIM_VERSION
    log: str
    log_sha256: str
    strategy: str
    strategy_version: str
    estimator: str
    types: tuple[str, ...]
    failure_cost: float
    lower: ClaimedBound
    upper: ClaimedBound
    tree: ClaimedNode
    seal: str = ""


NOT_FOLLOWED, BELIEFS, UNLISTED = "not followed", "beliefs are not known here", "more answers than are listed"
"""Why a branch has an outer bound."""

_SAID = {
    NOT_FOLLOWED: "not followed (more are with --branches)",
    BELIEFS: "not followed, since beliefs follow what else a container holds",
    UNLISTED: "of more answers than are listed",
}


def open_branches(tree: ClaimedNode) -> tuple[str, ...]:
    """How many branches of a tree have outer bounds, in words for each reason."""
    found: Counter[str] = Counter()
    left = [tree]
    while left:
        node = left.pop()
        outer = node.outer or (node.look.others if node.look else None)
        found.update([outer.why] if outer else [])
        left += [answer.then for answer in node.look.answers] if node.look else []
    return tuple(
        f"{found[why]:,} branch{'es' * (found[why] > 1)} {words}" for why, words in _SAID.items() if found[why]
    )


def sealed(claim: CostClaim) -> dict[str, Any]:
    """The claim as JSON values, with its seal."""
    values: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(claim))
    values["seal"] = seal_of(values)
    return values


def seal_of(values: dict[str, Any]) -> str:
    """SHA-256 over the canonical JSON of everything but the seal."""
    rest = {name: value for name, value in values.items() if name != "seal"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def write_claim(path: Path, values: dict[str, Any], *, force: bool = False) -> None:
    """Writes a sealed claim; the same claim gives the same bytes.

    Raises:
        OutputExists: the file exists and force is not given.
    """
    if path.exists() and not force:
        raise OutputExists(path)
    file = file_to_replace(path)
    make_folder(file.parent)
    with atomic(file) as draft, zipfile.ZipFile(draft, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr(zipfile.ZipInfo(CLAIM_MEMBER, STAMP), json.dumps(values, indent=1), zipfile.ZIP_DEFLATED)
