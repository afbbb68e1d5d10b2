"""The tables that a log gives and their columns: names, types, units and descriptions.

The descriptions travel with the data: Parquet files carry them as field metadata under the key "doc".
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from replayers.tables.arrow import pa

TEXT = pa.string()
WORD = pa.dictionary(pa.int32(), pa.string())
"""Repeated text; a categorical in pandas."""
WORDS = pa.list_(pa.string())
TIME = pa.timestamp("ns", tz="UTC")
NUMBER, WHOLE, YES = pa.float64(), pa.int64(), pa.bool_()


def _schema(*columns: tuple[str, pa.DataType, str]) -> pa.Schema:
    return pa.schema([pa.field(name, kind, metadata={"doc": doc}) for name, kind, doc in columns])


_RUN = ("run_id", WORD, "the run, as in the table runs")
_DECISION = ("decision", WHOLE, "number of the decision; 0 is before the first plan")
_STAMP = ("stamp", TIME, "when")

SCHEMAS: Mapping[str, pa.Schema] = MappingProxyType(
    {
        "runs": _schema(
            ("run_id", WORD, "the run's id; the same trial has the same id"),
            ("path", TEXT, "the log"),
            ("place", WORD, "house or site"),
            ("scenario", WORD, "find, deliver-3, breakfast, coffee, breakfast+coffee, any-of-three, or a user's"),
            ("strategy", WORD, "in lower case with hyphens"),
            ("estimator", WORD, "name with a short hash of its weights"),
            ("seed", WHOLE, "of the trial: scenario, start, draws"),
            ("started", TIME, "the world's clock when the run began"),
            ("title", TEXT, "one line for people"),
            ("source", WORD, "simulation, spot, import or replay"),
            ("origin_run", TEXT, "for a replay, the run that it was made from"),
            ("complete", YES, "the log was closed and holds its outcome"),
            ("status", WORD, "how it ended; missing where the recording stopped short"),
            ("cost", NUMBER, "what is charged: own_cost when done, the failure cost otherwise"),
            ("own_cost", NUMBER, "metres and their equivalents"),
            ("searches", WHOLE, "containers looked into during the run"),
            ("travel_m", NUMBER, "metres walked"),
            ("reason", TEXT, "why it ended"),
        ),
        "decisions": _schema(
            _RUN,
            _DECISION,
            _STAMP,
            ("robot_at", WORD, "location of the robot"),
            ("reason", TEXT, "why it was planned again"),
            ("status", WORD, "solved, no-plan, timed-out, solver-failed"),
            ("expected_cost", NUMBER, "of the plan; missing where none was found"),
            ("lower_bound", NUMBER, "no plan costs less; missing when nothing is proven"),
            ("optimal", YES, "proven over the places that the plan considers"),
            ("solver", WORD, "what made the plan"),
            ("note", TEXT, "why there is no plan, or what a pruning may lose"),
            ("steps", WHOLE, "in the plan"),
            ("first_step", WORD, "action of the plan's first step"),
            ("look_first", WORD, "container where the plan's first find looks first"),
            ("belief_s", NUMBER, "wall-clock seconds for the belief"),
            ("planning_s", NUMBER, "wall-clock seconds for the plan"),
        ),
        "observations": _schema(
            _RUN,
            _DECISION,
            _STAMP,
            ("container", WORD, "whose content became known"),
            ("robot_at", WORD, "location of the robot"),
            ("known_at_start", YES, "known before the run began"),
            ("item_types", WORDS, "what it held"),
            ("items", WORDS, "ids of the same items"),
            ("support", WORD, "in a replay: logged, implied or imputed"),
        ),
        "beliefs": _schema(
            _RUN,
            _DECISION,
            _STAMP,
            ("item_type", WORD, "sought"),
            ("container", WORD, "unsearched"),
            ("probability", NUMBER, "that at least one instance is there"),
            ("estimator", WORD, "name with a short hash of its weights"),
        ),
        "find_costs": _schema(
            _RUN,
            _DECISION,
            _STAMP,
            ("item_type", WORD, "to be found"),
            ("origin", WORD, "where the find starts"),
            ("target", WORD, "where it ends, item in hand"),
            ("cost", NUMBER, "expected, in metres and their equivalents"),
            ("kind", WORD, "optimistic, pessimistic or model"),
            ("belief_model", WORD, "independent, exists, exclusive or marginal"),
        ),
        "plans": _schema(
            _RUN,
            _DECISION,
            ("step", WHOLE, "from 0"),
            ("action", WORD, "move, pick, place, find, pour-water, ..."),
            ("origin", WORD, "location before"),
            ("target", WORD, "location after"),
            ("item_types", WORDS, "what it handles"),
            ("items", WORDS, "the instances, where known"),
            ("cost", NUMBER, "of the step, in metres and their equivalents"),
        ),
        "actions": _schema(
            _RUN,
            _DECISION,
            ("index", WHOLE, "of the action in the run"),
            ("start", TIME, "when it began"),
            ("end", TIME, "when it ended"),
            ("action", WORD, "move, search, pick, place, pour-water, ..."),
            ("origin", WORD, "location before"),
            ("target", WORD, "location after"),
            ("item_types", WORDS, "what it handled"),
            ("items", WORDS, "the instances, where known"),
            ("cost", NUMBER, "charged, in metres and their equivalents"),
            ("success", YES, "done, and not refused"),
            ("travel_m", NUMBER, "metres walked"),
            ("reason", TEXT, "why it failed"),
            ("support", WORD, "in a replay: logged, implied or imputed"),
        ),
        "poses": _schema(
            _RUN,
            _STAMP,
            ("frame", WORD, "in which the pose is given: map"),
            ("x_m", NUMBER, "metres"),
            ("y_m", NUMBER, "metres"),
            ("z_m", NUMBER, "metres, up"),
            ("yaw_rad", NUMBER, "radians, counter-clockwise from x"),
        ),
    }
)
"""Table by table."""
