"""An item is in one container, however near others stand and however its tag wobbles."""

from __future__ import annotations

import pytest

from recorders.spot.tags.item_places import MARGIN_M, ItemPlaces, container_at
from workbench.worlds.house import ContainerId, ItemId
from workbench.worlds.sites.site import Site, load_site

BOTTLE = ItemId("WaterBottle|1")
FRIDGE, COUNTERTOP = ContainerId("fridge"), ContainerId("countertop")
NEARER_COUNTERTOP, NEARER_FRIDGE = (3.35, 4.4, 0.9), (3.4, 4.4, 0.9)
"""Between the two, which stand 0.325 m apart: within the margin of both."""


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


def test_between_two_containers_the_nearer_one_has_it(home: Site) -> None:
    assert container_at(home.plan, NEARER_COUNTERTOP, margin_m=MARGIN_M) == COUNTERTOP
    assert container_at(home.plan, NEARER_FRIDGE, margin_m=MARGIN_M) == FRIDGE
    assert container_at(home.plan, (7.0, 2.4, 0.5), margin_m=MARGIN_M) is None


@pytest.mark.parametrize("order", [(FRIDGE, COUNTERTOP), (COUNTERTOP, FRIDGE)])
def test_neighbours_never_both_get_one_item(home: Site, order: tuple[ContainerId, ContainerId]) -> None:
    """Each look sees it on its own side, as a tag that is placed differently from two standing poses."""
    places = ItemPlaces(home.plan, margin_m=MARGIN_M)
    at = {FRIDGE: NEARER_FRIDGE, COUNTERTOP: NEARER_COUNTERTOP}
    for container in order:
        places.settle(container, places.shown_in(container, {BOTTLE: [at[container]]}))
    first, second = order
    assert places.shown_in(first, {BOTTLE: [at[first]]}) == (BOTTLE,)
    assert places.shown_in(second, {BOTTLE: [at[second]]}) == ()
    places.moved(BOTTLE)
    assert places.shown_in(second, {BOTTLE: [at[second]]}) == (BOTTLE,)


def test_all_sightings_of_a_look_count_and_not_the_last(home: Site) -> None:
    places = ItemPlaces(home.plan, margin_m=MARGIN_M)
    assert places.shown_in(COUNTERTOP, {BOTTLE: [NEARER_COUNTERTOP] * 4 + [NEARER_FRIDGE]}) == (BOTTLE,)
    assert places.shown_in(FRIDGE, {BOTTLE: [NEARER_COUNTERTOP] * 4 + [NEARER_FRIDGE]}) == ()
    assert places.shown_in(COUNTERTOP, {BOTTLE: []}) == ()
