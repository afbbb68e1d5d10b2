"""Runs on a robot that remember an earlier one: what it put down is where it is looked for, and the log replays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from spot_help import placed, robot, run_of

from recorders.earlier_runs import move_rates, read_history
from recorders.spot.run.run import run_and_record
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.runs.run import read
from workbench.beliefs.memory.move_rates import NS_PER_DAY
from workbench.log_schema.memory_json import memory_from_settings


@pytest.mark.slow
def test_a_second_run_remembers_what_the_first_one_saw_and_carried(tmp_path: Path) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    with robot() as (spot, connection):
        run_and_record(connection, run_of(spot), first)
    site, _ = placed()
    history = read_history([first], site.plan)
    memory = history.memory_at(history.runs[0].ended_ns + NS_PER_DAY, site.plan, move_rates(None))
    put = {a.item_types[0]: a.target for a in read(first).actions if a.action == "place"}
    taken = {a.item_types[0]: a.target for a in read(first).actions if a.action == "pick"}
    assert put
    for item_type, container in put.items():
        look = memory.by_container.get(container)  # type: ignore[call-overload]
        assert look is None or item_type in look.item_types
        assert item_type not in memory.by_container[taken[item_type]].item_types  # type: ignore[index]
    with robot() as (spot, connection):
        report = run_and_record(connection, replace(run_of(spot), memory=memory), second)
        assert report.ended.status == "done", report.ended.reason
    run = read(second)
    assert memory_from_settings(run.settings) == memory
    assert run.info.estimator.endswith(memory.digest)
    assert prepare_log(run, ReplaySettings(worlds=0)).reproduction.same
