"""Panel of one container: what it held and when that was seen, belief over time, and why it was or was not chosen."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

from markupsafe import Markup

from dashboards.model.clock import UNITS, Clock
from dashboards.model.containers.container_history import Consideration, ContainerHistory, ItemCount
from dashboards.palette import GOAL, SEARCHED, css, run_colour
from dashboards.panels.chart import Line, chart
from dashboards.panels.markup import chip, command, html, name, number, percent, place, table, text
from workbench.tolerances import NEAR_SHOWN_COST
from workbench.worlds.names import readable_name

MAX_TYPES = 200
"""Item types that are listed."""
NOTHING_CHOSEN = Markup(
    '<div class="lp"><p class="muted">Click a container, in the view or in the table of '
    "beliefs, to see what it held and why it was or was not chosen.</p></div>"
)

NO_TRUTH = Markup('<div class="lp"><p class="muted">This log holds no ground truth.</p></div>')


def container(history: ContainerHistory, clock: Clock, focus: str) -> Markup:
    """The container as the run in focus had it at the moment shown."""
    what = _head(history) + _contents(history, clock) + _missed(history, focus) + _truth(history)
    why = _considered(history, clock, focus)
    return html(
        '<div class="lp container">{}</div>{}<div class="lp">{}</div>', what, _belief(history, clock, focus), why
    )


def _head(history: ContainerHistory) -> Markup:
    wide, deep, high = history.container.size_m
    distance = (
        "not reachable" if not history.reachable else f"{number(history.distance_m)} m from the last decision's place"
    )
    if history.reachable and history.distance_m is None:
        distance = "distance unknown"
    room = name(readable_name(history.room))
    size = f"{wide:.2f} x {deep:.2f} x {high:.2f} m"
    return html('<h2>{}</h2><p class="muted">{} · {} · {}</p>', place(history.container.id), room, size, distance)


def _contents(history: ContainerHistory, clock: Clock) -> Markup:
    if history.contents is not None:
        how = "Seen in passing" if history.in_passing else "Searched"
        when = "Known at the start" if history.known else html("{} at {}", how, _moment(history.searched_ns, clock))
        return html("<h3>What was there</h3><p>{}.</p>{}", when, _items(history.contents))
    how = "seen in passing" if history.in_passing else "searched"
    later = (
        html("; it is {} at {}", how, _moment(history.searched_ns, clock)) if history.searched_ns is not None else ""
    )
    never = "" if later else ", and this run never does"
    return html("<h3>What was there</h3><p>Nobody has opened it yet{}{}.</p>", later, never)


def _missed(history: ContainerHistory, focus: str) -> Markup:
    """The chance that is left after looks in vain by the moment shown; nothing before the first."""
    if history.in_vain is None or not history.in_vain.by_now:
        return Markup("")
    times = "1 look" if history.in_vain.by_now == 1 else f"{history.in_vain.by_now} looks"
    return html(
        "<p>{} in vain: {} was believed here with {}; a look detects it with {}, so {} is left.</p>",
        times,
        name(readable_name(focus)),
        percent(history.in_vain.prior),
        percent(history.in_vain.p_detect),
        percent(history.in_vain.left),
    )


def _truth(history: ContainerHistory) -> Markup:
    if history.truth is None:
        return Markup("")
    said = Markup("<b>Ground truth at the start</b>, which the robot did not know")
    return html('<div class="warn">{}{}</div>', said, _items(history.truth))


def _items(items: Sequence[ItemCount]) -> Markup:
    if not items:
        return Markup("<p>It was empty.</p>")
    rows = Markup("").join(html("<li>{}</li>", _item(item)) for item in items[:MAX_TYPES])
    left = html('<p class="muted">and {} more types</p>', len(items) - MAX_TYPES) if len(items) > MAX_TYPES else ""
    return html('<ul class="items">{}</ul>{}', rows, left)


def _item(item: ItemCount) -> Markup:
    many = f" x {item.count}" if item.count > 1 else ""
    taken = "" if not item.taken else Markup(" <small>taken by the robot</small>")
    if 0 < item.taken < item.count:
        taken = html(" <small>{} taken by the robot</small>", item.taken)
    wanted = " " + chip("goal", css(GOAL)) if item.wanted else ""
    return html("{}{}{}{}", name(readable_name(item.item_type)), many, wanted, taken)


def _belief(history: ContainerHistory, clock: Clock, focus: str) -> Markup:
    if not history.belief:
        return Markup('<div class="lp"><p class="muted">No decision says what was believed of it.</p></div>')
    timeline = clock.timelines[0]
    ends = [stamp for stamp, _ in history.belief[1:]]
    later = [stamp for stamp in timeline.decision_ns if stamp > history.belief[-1][0]]
    ends.append(later[0] if later else timeline.end_ns)
    points = [
        (clock.reading(at), p) for (begin, p), end in zip(history.belief, ends, strict=True) for at in (begin, end)
    ]
    line = Line(name=readable_name(history.container.type), colour=css(run_colour(0)), points=points, keyed=False)
    title = f"Belief in {readable_name(focus)} here"
    return chart(
        title,
        [line, *_after_looks(history, clock)],
        end=clock.end,
        unit=UNITS[clock.alignment],
        shown=lambda value, _: percent(value),
    )


def _after_looks(history: ContainerHistory, clock: Clock) -> list[Line]:
    """What is left of the first belief after each look in vain, as steps."""
    if history.in_vain is None:
        return []
    steps = history.in_vain.posterior
    ends = [*(at for at, _ in steps[1:]), clock.timelines[0].end_ns]
    points = [(clock.reading(at), p) for (begin, p), end in zip(steps, ends, strict=True) for at in (begin, end)]
    return [Line(name="left after looks in vain", colour=css(SEARCHED), points=points, dashed=True)]


def _considered(history: ContainerHistory, clock: Clock, focus: str) -> Markup:
    if not history.considerations:
        return Markup("")
    rows = [
        [
            html('<span class="seek" {}>{}</span>', command(f"seek {clock.reading(c.stamp_ns):.9f}"), c.number),
            percent(nan if c.probability is None else c.probability),
            number(c.cost_here),
            number(c.cost_taken),
            _reason(c, history.container.id),
        ]
        for c in history.considerations
    ]
    head = ("decision", f"P({readable_name(focus)})", "cost if first", "cost taken", "why")
    made = table(head, rows, key="considered", classes=("n", "n", "n", "n", ""))
    title = Markup('<h3 title="Expected costs of the search, by Eq. 1, under the belief of that decision.">')
    return html("{}When and why it was or was not chosen</h3>{}", title, made)


def _reason(c: Consideration, container_id: str) -> Markup:
    if not c.first:
        return text("no search in this plan")
    if c.first == container_id:
        return Markup("<b>chosen</b>: the first look")
    if not c.rank:
        return html("not in the order of search; {} was first", place(c.first))
    if c.cost_here is None or c.cost_taken is None:
        return html("{}. in the order; {} was first", c.rank, place(c.first))
    more = c.cost_here - c.cost_taken
    if more > NEAR_SHOWN_COST:
        return html(
            "{}. in the order: a look here first would have cost {} more than {}",
            c.rank,
            number(more),
            place(c.first),
        )
    if more < -NEAR_SHOWN_COST:
        return html("{}. in the order, though by Eq. 1 {} cheaper than {}", c.rank, number(-more), place(c.first))
    return html("{}. in the order: the same cost as {}", c.rank, place(c.first))


def _moment(stamp_ns: int | None, clock: Clock) -> Markup:
    if stamp_ns is None:
        return Markup("")
    second = clock.timelines[0].seconds(stamp_ns)
    return html(
        '<span class="seek" {}>{}</span>', command(f"seek {clock.reading(stamp_ns):.9f}"), text(f"{second:.1f} s")
    )
