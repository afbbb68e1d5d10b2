"""The state of a robot's session in the dashboard: what is wrong, what comes next, and the keys while it is live."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from mcap.writer import Writer

from dashboards.palette import FAILED, css
from dashboards.panels.live.session_status import OPERATOR, session_status
from dashboards.sensing.robot_sensors import sensors_of
from recorders.spot import record_session
from recorders.spot.session.topics import SESSION_STATUS, SessionStatus, fact_channel
from workbench.log_schema.events import NANO, Stamp

WELL = SessionStatus(
    stamp=Stamp.of(100 * NANO),
    battery_percent=72.0,
    localized=True,
    silent_s=0.1,
    tags=("WaterBottle|1",),
    dropped=0,
    disk_free_mb=12_300,
    doing="search @ fridge",
)


def shown(status: SessionStatus | None, *, seconds_later: float = 0.0, live: bool = False, by: str = "x") -> str:
    return str(session_status(status, round((100 + seconds_later) * NANO), live=live, strategy=by))


def test_a_session_that_goes_well_tells_its_figures_and_what_comes_next() -> None:
    words = shown(WELL)
    for said in ("battery 72 %", "localised", "link up", "12.3 GB free", "Next: search @ fridge", "WaterBottle|1"):
        assert said in words
    for unsaid in ("not localised", "no answer", "dropped", "as of", "Keys"):
        assert unsaid not in words
    assert shown(None) == ""


@pytest.mark.parametrize(
    ("change", "later", "said"),
    [
        ({"localized": False}, 0.0, "not localised"),
        ({"silent_s": 3.4}, 0.0, "no answer for 3 s"),
        ({"dropped": 12}, 0.0, "12 messages dropped"),
        ({}, 8.0, "as of 8 s ago"),
        ({"tags": ()}, 0.0, "Sees no tag"),
        ({"tags": tuple(f"tag {n}" for n in range(9))}, 0.0, "and 3 more"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, object], later: float, said: str) -> None:
    assert said in shown(msgspec.structs.replace(WELL, **change), seconds_later=later)


def test_low_figures_are_marked() -> None:
    well, low = shown(WELL), shown(msgspec.structs.replace(WELL, battery_percent=12.0, disk_free_mb=300))
    assert low.count(css(FAILED)) == 2
    assert css(FAILED) not in well
    assert "battery" not in shown(msgspec.structs.replace(WELL, battery_percent=-1.0))


def test_keys_are_told_while_it_is_live_those_of_whoever_drives() -> None:
    assert "space or s stop" in shown(WELL, live=True, by="pes-greedy")
    assert "o opened" in shown(WELL, live=True, by=OPERATOR)
    assert record_session.OPERATOR == OPERATOR


def test_the_newest_state_at_a_moment_is_read_from_the_log(tmp_path: Path) -> None:
    """Also of a log that was cut off, and a damaged message is none."""
    path, spec = tmp_path / "a.mcap", fact_channel(SessionStatus)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema(spec.schema_name, spec.schema_encoding, spec.schema_data)
        channel = writer.register_channel(SESSION_STATUS, "json", schema)
        for second in (1, 2, 3):
            told = msgspec.structs.replace(WELL, stamp=Stamp.of(second * NANO), doing=f"step {second}")
            data = msgspec.json.encode(told) if second < 3 else b"{"
            writer.add_message(channel, second * NANO, data, second * NANO)
        writer.finish()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-150])
    for log in (path, cut):
        robot_sensors = sensors_of(log)
        assert robot_sensors is not None
        assert robot_sensors.has_status
        assert robot_sensors.status(0) is None
        doing = [status.doing for s in (1, 2.9) if (status := robot_sensors.status(round(s * NANO))) is not None]
        assert doing == ["step 1", "step 2"]
        assert robot_sensors.status(3 * NANO) is None
