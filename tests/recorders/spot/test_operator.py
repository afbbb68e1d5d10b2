"""Closed furniture: what nobody opened was not seen into, and is never recorded as empty."""

from __future__ import annotations

from dataclasses import replace

from spot_help import placed, robot

from recorders.spot.client.control import Control
from recorders.spot.run.operator import AgreeingOperator, KeyboardOperator, NoOperator, StopSwitch
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.world import ActionRefused, LookResult


class Refusing:
    """A helper who says no."""

    present = True

    def confirm(self, question: str) -> bool:
        return False


def test_what_the_helper_does_not_open_is_refused_and_not_empty() -> None:
    site = placed()[0]
    closed = next(ContainerId(c.id) for c in site.file.containers if c.closed)
    opened = next(ContainerId(c.id) for c in site.file.containers if not c.closed)
    with robot() as (_spot, connection):
        client = connection.client("graph-nav-service")
        client.set_localization(initial_guess_localization=_nowhere(), fiducial_init=2)
        settings = RunSettings(poll_s=0.5, look_s=1.0)

        def look(operator: object, container: ContainerId) -> object:
            world = SpotWorld(
                connection=connection, control=Control(connection), site=site, settings=settings, operator=operator
            )
            return world.look_into(container)

        refused = look(Refusing(), closed)
        assert isinstance(refused, ActionRefused)
        assert refused.reason == "nobody opened it"
        assert isinstance(look(Refusing(), opened), LookResult), "nobody is asked for what stands open"
        for nobody in (NoOperator(), KeyboardOperator(StopSwitch())):
            assert isinstance(look(nobody, closed), ActionRefused), "what nobody opened is not empty, also unattended"
        settings = replace(settings, furniture_open=True)
        assert isinstance(look(NoOperator(), closed), LookResult), "somebody opened it before the run"
        settings = replace(settings, furniture_open=False)
        helper = AgreeingOperator()
        assert isinstance(look(helper, closed), LookResult)
        assert helper.asked == [f"Open {closed}, then press y."]


def test_a_look_begins_once_the_helper_has_opened_however_long_that_took() -> None:
    site, fridge = placed("C")[0], ContainerId("fridge")
    with robot(configuration="C") as (spot, connection):
        pose = site.paths.standing_pose(LocationId(fridge))
        assert pose is not None
        spot.state.body.pose, spot.state.body.standing = pose, True
        connection.client("graph-nav-service").set_localization(_nowhere(), fiducial_init=2)

        class Slow:
            """A helper who takes half a minute."""

            present = True

            def confirm(self, question: str) -> bool:
                connection.clock.sleep(30.0)
                return True

        settings = RunSettings(poll_s=0.5, look_s=2.0)
        control = Control(connection)
        world = SpotWorld(
            connection=connection,
            control=control,
            site=site,
            settings=settings,
            operator=Slow(),
            at=LocationId(fridge),
        )
        looked = world.look_into(fridge)
    assert isinstance(looked, LookResult)
    assert [item.type for item in looked.items] == ["WaterBottle"]
    assert 2.0 <= (looked.end_ns - looked.start_ns) / 1e9 < 4.0
    assert looked.opened_by == "operator"


def _nowhere() -> object:
    from bosdyn.api.graph_nav import nav_pb2

    return nav_pb2.Localization()
