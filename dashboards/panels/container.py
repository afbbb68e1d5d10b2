"""Panel of one container: what it held and when that was seen, belief over time, and why it was or was not chosen."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

from dashboards.model.clock import UNITS, Clock
from dashboards.model.container_history import Consideration, ContainerHistory, ItemCount
from dashboards.palette import FOUND, css, run_colour
from dashboards.panels.chart import Line, chart
from dashboards.panels.markup import chip, command, name, number, percent, place, table, text
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

MAX_TYPES = 200
"""Item types that are listed."""
NOTHING_CHOSEN = (
    '<div class="lp"><p class="muted">Click a container, in the view or in the table of beliefs, to see what it held'
    " and why it was or was not chosen.</p></div>"
)

NO_TRUTH = '<div class="lp"><p class="muted">This log holds no ground truth.</p></div>'


def container(history: ContainerHistory, clock: Clock, focus: str) -> str:
    """The container as the run in focus had it at the moment shown."""
    what = f"{_head(history)}{_contents(history, clock)}{_truth(history)}"
    why = _considered(history, clock, focus)
    return f'<div class="lp container">{what}</div>{_belief(history, clock, focus)}<div class="lp">{why}</div>'


def _head(history: ContainerHistory) -> str:
    wide, deep, high = history.container.size_m
    way = "not reachable" if not history.reachable else f"{number(history.way_m)} m from the last decision's place"
    if history.reachable and history.way_m is None:
        way = "way unknown"
    room = name(readable_name(history.room))
    size = f"{wide:.2f} x {deep:.2f} x {high:.2f} m"
    return f'<h2>{place(history.container.id)}</h2><p class="muted">{room} · {size} · {way}</p>'


def _contents(history: ContainerHistory, clock: Clock) -> str:
    if history.contents is not None:
        when = "Known at the start" if history.known else f"Searched at {_moment(history.searched_ns, clock)}"
        return f"<h3>What was there</h3><p>{when}.</p>{_items(history.contents)}"
    later = f"; it is searched at {_moment(history.searched_ns, clock)}" if history.searched_ns is not None else ""
    never = "" if later else ", and this run never does"
    return f"<h3>What was there</h3><p>Nobody has opened it yet{later}{never}.</p>"


def _truth(history: ContainerHistory) -> str:
    if history.truth is None:
        return ""
    said = "<b>Ground truth at the start</b>, which the robot did not know"
    return f'<div class="warn">{said}{_items(history.truth)}</div>'


def _items(items: Sequence[ItemCount]) -> str:
    if not items:
        return "<p>It was empty.</p>"
    rows = "".join(f"<li>{_item(item)}</li>" for item in items[:MAX_TYPES])
    left = f'<p class="muted">and {len(items) - MAX_TYPES} more types</p>' if len(items) > MAX_TYPES else ""
    return f'<ul class="items">{rows}</ul>{left}'


def _item(item: ItemCount) -> str:
    many = f" x {item.count}" if item.count > 1 else ""
    taken = "" if not item.taken else " <small>taken by the robot</small>"
    if 0 < item.taken < item.count:
        taken = f" <small>{item.taken} taken by the robot</small>"
    wanted = " " + chip("goal", css(FOUND), dark=True) if item.wanted else ""
    return f"{name(readable_name(item.item_type))}{many}{wanted}{taken}"


def _belief(history: ContainerHistory, clock: Clock, focus: str) -> str:
    if not history.belief:
        return '<div class="lp"><p class="muted">No decision says what was believed of it.</p></div>'
    timeline = clock.timelines[0]
    ends = [stamp for stamp, _ in history.belief[1:]]
    later = [stamp for stamp in timeline.decision_ns if stamp > history.belief[-1][0]]
    ends.append(later[0] if later else timeline.end_ns)
    points = [
        (clock.reading(at), p) for (begin, p), end in zip(history.belief, ends, strict=True) for at in (begin, end)
    ]
    line = Line(name=readable_name(history.container.type), colour=css(run_colour(0)), points=points, keyed=False)
    title = f"Belief in {readable_name(focus)} here"
    return chart(title, [line], end=clock.end, unit=UNITS[clock.alignment], shown=lambda value, _: percent(value))


def _considered(history: ContainerHistory, clock: Clock, focus: str) -> str:
    if not history.considerations:
        return ""
    rows = [
        [
            f'<span class="seek" {command(f"seek {clock.reading(c.stamp_ns):.9f}")}>{c.number}</span>',
            percent(nan if c.probability is None else c.probability),
            number(c.cost_here),
            number(c.cost_taken),
            _reason(c, history.container.id),
        ]
        for c in history.considerations
    ]
    head = ("decision", f"P({readable_name(focus)})", "cost if first", "cost taken", "why")
    made = table(head, rows, key="considered", classes=("n", "n", "n", "n", ""))
    title = '<h3 title="Expected costs of the search, by Eq. 1, under the belief of that decision.">'
    return f"{title}When and why it was or was not chosen</h3>{made}"


def _reason(c: Consideration, container_id: str) -> str:
    if not c.first:
        return "no search in this plan"
    if c.first == container_id:
        return "<b>chosen</b>: the first look"
    if not c.rank:
        return f"not in the order of search; {place(c.first)} was first"
    if c.cost_here is None or c.cost_taken is None:
        return f"{c.rank}. in the order; {place(c.first)} was first"
    more = c.cost_here - c.cost_taken
    if more > NEAR_SHOWN_COST:
        return f"{c.rank}. in the order: a look here first would have cost {number(more)} more than {place(c.first)}"
    if more < -NEAR_SHOWN_COST:
        return f"{c.rank}. in the order, though by Eq. 1 {number(-more)} cheaper than {place(c.first)}"
    return f"{c.rank}. in the order: the same cost as {place(c.first)}"


def _moment(stamp_ns: int | None, clock: Clock) -> str:
    if stamp_ns is None:
        return ""
    second = clock.timelines[0].seconds(stamp_ns)
    return f'<span class="seek" {command(f"seek {clock.reading(stamp_ns):.9f}")}>{text(f"{second:.1f} s")}</span>'
