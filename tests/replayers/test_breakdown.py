"""How many overlooked items a certain claim survives."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from sample_logs import write_toy_log
from toy import BED, COUNTER, DESK, TABLE
from toy_logs import InOrder
from toy_replays import kept

from replayers.batch.breakdown import Breakdown, breakdowns, fewest_misses, in_words
from replayers.batch.compare import compare
from replayers.batch.store import StoredReplay, replay_path
from workbench.cli import run as lios


def records(folder: Path, uppers: Sequence[float]) -> list[StoredReplay]:
    """Two planners over one log, of which the quick one costs at most so much with 0, 1, 2, ... items overlooked; the
    slow one costs 17 at least."""
    quick = kept(InOrder((TABLE, COUNTER), name="quick"), folder)
    slow = kept(InOrder((BED, DESK, TABLE, COUNTER), name="slow"), folder)
    assert quick.bounds is not None
    assert slow.bounds is not None
    least = msgspec.structs.replace(slow, groups=(), bounds=replace(slow.bounds, lower=17.0, upper=30.0))
    made = []
    for misses, upper in enumerate(uppers):
        bounds = replace(quick.bounds, lower=5.0, upper=upper)
        made += [msgspec.structs.replace(quick, groups=(), bounds=bounds, misses=misses)]
        made += [msgspec.structs.replace(least, misses=misses)]
    return made


def test_by_hand_a_claim_breaks_down_where_its_bounds_first_overlap(tmp_path: Path) -> None:
    first = records(tmp_path, [10.0, 16.0, 18.0])
    other = [
        msgspec.structs.replace(r, sha256="2", run_id="2", log="2.mcap") for r in records(tmp_path, [10.0, 20.0])
    ]
    every = [*first, *other]
    base = fewest_misses(every)
    assert [(r.sha256 == "2", r.strategy, r.misses) for r in base] == [
        (False, "quick", 0),
        (False, "slow", 0),
        (True, "quick", 0),
        (True, "slow", 0),
    ]
    pairs = compare(base, rng=np.random.default_rng(0))
    found = breakdowns(pairs, every)
    assert found == (
        Breakdown(cheaper="quick", dearer="slow", overlooked=1, certain=2, replayed=2, still=1, broken=("2.mcap",)),
        Breakdown(
            cheaper="quick", dearer="slow", overlooked=2, certain=2, replayed=1, still=0, broken=(first[0].log,)
        ),
    )
    assert in_words(found) == (
        "quick is certainly cheaper than slow on 2 logs; on 1 of them still if 1 item was overlooked; "
        "on none of the 1 replayed so if 2 items were overlooked",
    )


def test_what_the_inventory_implies_is_no_further_item(tmp_path: Path) -> None:
    """A log that contradicts itself allows for one item from the start: two are one more."""
    every = [r for r in records(tmp_path, [10.0, 10.0, 18.0]) if r.misses]
    (found,) = breakdowns(compare(fewest_misses(every), rng=np.random.default_rng(0)), every)
    assert (found.overlooked, found.certain, found.still) == (1, 1, 0)


def test_the_commands_keep_the_numbers_apart_and_tell_where_a_claim_breaks_down(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, folder = write_toy_log(tmp_path / "a.mcap"), tmp_path / "replays"
    ask = ["replay", str(log), "-s", "greedy,model-lios,conditioned-lios", "--worlds", "0", "-o", str(folder)]
    assert lios(ask) == 0
    alone = {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*.replay.json")}
    assert lios([*ask, "--misses", "1"]) == 0
    assert lios([*ask, "--misses", "2"]) == 0
    capsys.readouterr()
    assert {name: (folder / name).read_bytes() for name in alone} == alone
    assert len(list(folder.rglob("misses-2/*.replay.json"))) == len(alone) == 3
    assert lios(["compare", str(folder), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {row["logs"] for row in answer["rows"]} == {1}
    certain = sum(row["wins"] + row["loses"] for row in answer["rows"])
    assert len(answer["breakdowns"]) == 2 * certain
    for one in answer["breakdowns"]:
        assert one["replayed"] == one["certain"] == 1
        assert one["still"] + len(one["broken"]) == 1


def test_replays_without_misses_lie_where_they_always_lay(tmp_path: Path) -> None:
    usual = replay_path(tmp_path, "12345678", "run", "greedy")
    assert replay_path(tmp_path, "12345678", "run", "greedy", misses=0) == usual
    assert replay_path(tmp_path, "12345678", "run", "greedy", misses=2) == usual.parent / "misses-2" / usual.name
