"""Claims about pairs of strategies, such as "conditioned-lios > model-lios", judged on comparisons, as JUnit XML too.

A claim names the outcome that must not be. It is judged by what is certain (bounds over every consistent world) or by
the interval of the mean difference in drawn worlds.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, final
from xml.sax.saxutils import escape, quoteattr

from replayers.batch.compare import StrategyComparison
from workbench.errors import BadValue, UnknownName
from workbench.planning.strategies import resolved_name

Evidence = Literal["bounds", "interval"]
NAME = r"\S+(?: by \S+)?"
"""The name of a strategy, or STRATEGY by ESTIMATOR."""
FORM = '"A > B" or "A < B", and after it, if wanted, "by bounds" or "by interval" (the default)'


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """That one strategy costs more than another.

    Attributes:
        text: as it was given.
        dearer, cheaper: names of strategies.
        evidence: what must be positive: with "bounds" the mean difference in every consistent world, with "interval"
            the 95 % interval of the mean difference in drawn worlds.
    """

    text: str
    dearer: str
    cheaper: str
    evidence: Evidence


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """A claim and what the logs say of it.

    Attributes:
        holds: it is shown; what is not shown does not hold.
        low, high: the ends of the mean difference, dearer minus cheaper; infinite where there is no end.
        words: the same as a sentence.
    """

    claim: Claim
    holds: bool
    low: float
    high: float
    words: str


def parse_claim(text: str) -> Claim:
    """The claim of a text.

    Raises:
        BadValue: it has another form.
    """
    match = re.fullmatch(rf"\s*({NAME})\s*([<>])\s*({NAME}?)(?:\s+by\s+(bounds|interval))?\s*", text)
    if match is None:
        raise BadValue("--fail-if", text, FORM)
    left, sign, right, evidence = match.groups()
    if (" by " in left) != (" by " in right):  # the names of one folder are all of one form
        raise BadValue("--fail-if", text, FORM)
    dearer, cheaper = (left, right) if sign == ">" else (right, left)
    return Claim(
        text=text.strip(),
        dearer=_resolved(dearer),
        cheaper=_resolved(cheaper),
        evidence="bounds" if evidence == "bounds" else "interval",
    )


def _resolved(name: str) -> str:
    """A name without aliases; "A by E" is a strategy with an estimator (beliefs_apart.py)."""
    given, by, estimator = name.partition(" by ")
    return resolved_name(given) + by + estimator


def judge(claim: Claim, pairs: Sequence[StrategyComparison], *, replayed: Iterable[str] = ()) -> Judgement:
    """What comparisons say of a claim.

    Args:
        replayed: strategies that were replayed, among them those that can be compared with no other.

    Raises:
        UnknownName: a strategy that was not replayed.
        BadValue: two that were not replayed over the same logs.
    """
    names = sorted({name for pair in pairs for name in (pair.a, pair.b)} | set(replayed))
    for name in (claim.dearer, claim.cheaper):
        if name not in names:
            raise UnknownName("strategy", name, names, where="these replays")
    pair = next((p for p in pairs if {p.a, p.b} == {claim.dearer, claim.cheaper}), None)
    if pair is None:
        raise BadValue("--fail-if", claim.text, "about two strategies that were replayed over the same logs")
    low, high = _ends(pair, claim.evidence)
    if pair.a != claim.dearer:
        low, high = -high, -low
    holds = low > 0
    how = "in every consistent world" if claim.evidence == "bounds" else "95 % interval of drawn worlds"
    verdict = "holds" if holds else "is not shown"
    return Judgement(
        claim=claim,
        holds=holds,
        low=low,
        high=high,
        words=f"{claim.text} {verdict}: {claim.dearer} minus {claim.cheaper} is {low:.2f} to {high:.2f} over "
        f"{pair.logs} logs ({how})",
    )


def junit_xml(judged: Sequence[Judgement]) -> str:
    """The judgements as JUnit XML: one test case each, which fails where the claim holds."""
    failures = sum(j.holds for j in judged)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<testsuites tests="{len(judged)}" failures="{failures}">',
        f'  <testsuite name="lios compare" tests="{len(judged)}" failures="{failures}" errors="0" skipped="0">',
    ]
    for j in judged:
        case = f"    <testcase classname={quoteattr('lios.compare')} name={quoteattr('not ' + j.claim.text)}"
        if j.holds:
            lines += [f"{case}>", f"      <failure message={quoteattr(j.words)}>{escape(j.words)}</failure>"]
            lines.append("    </testcase>")
        else:
            lines += [f"{case}>", f"      <system-out>{escape(j.words)}</system-out>", "    </testcase>"]
    return "\n".join([*lines, "  </testsuite>", "</testsuites>", ""])


def _ends(pair: StrategyComparison, evidence: Evidence) -> tuple[float, float]:
    """The ends of a minus b. One log has no interval over logs, and so shows nothing by it."""
    if evidence == "bounds":
        return pair.least, pair.most
    if pair.drawn is None or pair.drawn.trials < 2:
        return float("-inf"), float("inf")
    low, high = pair.drawn.interval
    return low, high
