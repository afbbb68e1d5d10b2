"""Tables of rates: shipped, written and read again, and refused in one line."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from workbench.beliefs.memory.episodes import SMOOTHING, rates_from_episodes
from workbench.beliefs.memory.move_rates import (
    OTHERS,
    MoveRates,
    RateRow,
    rates_of,
    read_rates,
    shipped_rates,
    write_rates,
)
from workbench.errors import BadValue, FileMissing, MalformedFile
from workbench.worlds.house import ItemType

EPISODES = Path(__file__).parents[3].parent / "shared" / "placements" / "ithor_moves_2023.jsonl.gz"


def test_the_shipped_rates_tell_what_moves_often() -> None:
    rates = shipped_rates()
    assert rates.of(ItemType("Candle")) > rates.of(ItemType("Plate"))
    assert rates.of(ItemType("ObjaMug")) == rates.of(ItemType("Mug"))
    assert rates.of(ItemType("NobodyHasSeenThis")) == rates.others


@pytest.mark.skipif(not EPISODES.exists(), reason="the shared episodes are not here")
def test_the_shipped_rates_are_those_of_the_episodes(tmp_path: Path) -> None:
    write_rates(tmp_path / "rates.csv", rates_from_episodes(EPISODES))
    assert read_rates(tmp_path / "rates.csv") == shipped_rates()


def test_rates_survive_a_file(tmp_path: Path) -> None:
    rows = (
        RateRow(item_type=OTHERS, rate=0.2, moves=3, days=9.5),
        RateRow(item_type="Mug", rate=0.5, moves=1, days=2),
    )
    write_rates(tmp_path / "rates.csv", rows)
    assert read_rates(tmp_path / "rates.csv") == rates_of(rows)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a,b\n1,2\n",
        "item_type,moves_per_day,moves,days\nMug,0.1,1,1\n",
        "item_type,moves_per_day,moves,days\n*,0,1,1\n",
        "item_type,moves_per_day,moves,days\n*,nan,1,1\n",
        "item_type,moves_per_day,moves,days\n*,0.1,1\n",
        "item_type,moves_per_day,moves,days\n*,0.1,1,1\n*,0.2,1,1\n",
        "item_type,moves_per_day,moves,days\n*,much,1,1\n",
    ],
)
def test_a_file_that_holds_no_rates_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "rates.csv").write_text(text, encoding="utf-8")
    with pytest.raises(MalformedFile) as refused:
        read_rates(tmp_path / "rates.csv")
    assert "\n" not in str(refused.value)
    with pytest.raises(FileMissing):
        read_rates(tmp_path / "none.csv")
    with pytest.raises(BadValue):
        MoveRates(others=-1.0)


def test_episodes_count_a_type_in_every_episode_of_its_scenes(tmp_path: Path) -> None:
    lines = ['{"scene": "A", "moves": [["Mug", [0], [1]], ["Mug", [0], [2]]]}', '{"scene": "A", "moves": []}']
    lines += ['{"scene": "B", "moves": [["Book", [0], [1]]]}'] * 2
    (tmp_path / "moves.jsonl.gz").write_bytes(gzip.compress("\n".join(lines).encode()))
    rows = {row.item_type: row for row in rates_from_episodes(tmp_path / "moves.jsonl.gz")}
    assert (rows["Mug"].moves, rows["Mug"].days) == (1, 2)
    assert (rows["Book"].moves, rows["Book"].days) == (2, 2)
    assert rows["Book"].rate > rows[OTHERS].rate > rows["Mug"].rate
    assert SMOOTHING > 0
    (tmp_path / "bad.jsonl").write_text('{"scene": 3}\n', encoding="utf-8")
    with pytest.raises(MalformedFile, match="line 1"):
        rates_from_episodes(tmp_path / "bad.jsonl")
