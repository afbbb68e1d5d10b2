"""Sites to simulate in: which addresses name one, what stands where, and that the template records and replays."""

from __future__ import annotations

from pathlib import Path

import pytest

import recorders
import replayers
from workbench import cli
from workbench.errors import LiosError
from workbench.evaluation.simulated_site import SimulatedSite, simulated_site, site_address


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """The survey that `lios new site` writes, in the working folder."""
    monkeypatch.chdir(tmp_path)
    assert cli.run(["new", "site", "our-lab"]) == 0
    assert capsys.readouterr().out.strip() == "our-lab/site.yaml"
    return Path("our-lab/site.yaml")


def where(simulated: SimulatedSite) -> dict[str, str]:
    return {item.id: container for container, items in simulated.house.contents.items() for item in items}


def test_addresses_of_sites_and_of_houses(lab: Path) -> None:
    assert site_address(str(lab)) == (str(lab), "")
    assert site_address("our-lab") == ("our-lab", "")
    assert site_address(f"{lab}:B") == (str(lab), "B")
    assert site_address("paper_home:B") == ("paper_home", "B")
    assert site_address("houses:9") is None
    assert cli.run(["new", "house", "my-flat"]) == 0
    assert site_address("my-flat.yaml") is None


def test_the_template_records_and_replays_along_its_measured_lengths(lab: Path) -> None:
    assert len(lab.read_text().splitlines()) <= 15
    end = recorders.record("run.mcap", house=str(lab), find="mug", strategy="greedy")
    assert end.status == "done"
    at = where(simulated_site(str(lab), "", seed=0))["Mug|1"]
    # Greedy looks into the table first: 1.1 m away; the fridge is 3.2 m further, and 2.1 m from the start.
    assert end.travel_m == pytest.approx(2.2 if at == "table" else 1.1 + 3.2 + 2.1)
    (made,) = replayers.replay("run.mcap", "greedy", settings=replayers.ReplaySettings(worlds=10))
    assert made.cost == pytest.approx(end.cost)


def test_a_seed_draws_where_the_tagged_items_stand(lab: Path) -> None:
    drawn = [where(simulated_site(str(lab), "", seed=seed)) for seed in range(20)]
    assert all(set(places) == {"Mug|1", "Tomato|1"} for places in drawn)
    assert {places["Tomato|1"] for places in drawn} == {"fridge", "table"}
    assert drawn[3] == where(simulated_site(str(lab), "", seed=3))


def test_a_configuration_says_where_they_are() -> None:
    assert where(simulated_site("paper_home", "B", seed=5)) == {"WaterBottle|1": "desk", "CellPhone|1": "couch"}
    first = simulated_site("paper_home", "", seed=5)
    assert where(first) == {"WaterBottle|1": "countertop", "CellPhone|1": "dining_table"}
    assert first.house.plan.start.x_m == 10.0


def test_a_configuration_keeps_measured_lengths_from_the_same_start(lab: Path) -> None:
    (lab.parent / "configurations.yaml").write_text(
        "lios_configurations: 1\nconfigurations:\n"
        "  A: {start: {x_m: 2.5, y_m: 2.0}, contents: {fridge: [Mug|1]}}\n"
        "  B: {start: {x_m: 1.0, y_m: 2.0}, contents: {fridge: [Mug|1]}}\n"
    )
    assert where(simulated_site(str(lab), "", seed=0)) == {"Mug|1": "fridge"}
    with pytest.raises(LiosError, match="another start cannot be used"):
        simulated_site(str(lab), "B", seed=0)
    with pytest.raises(LiosError, match="A, B"):
        simulated_site(str(lab), "C", seed=0)


def test_a_survey_without_tags_is_refused(lab: Path) -> None:
    lab.write_text("\n".join(line for line in lab.read_text().splitlines() if not line.startswith("tags")))
    with pytest.raises(LiosError, match="nothing to find"):
        simulated_site(str(lab), "", seed=0)
