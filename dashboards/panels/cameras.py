"""Panel of the newest picture of each camera, with its age."""

from __future__ import annotations

import base64

from dashboards.panels.markup import name, text
from dashboards.sensing.pictures import Picture
from workbench.log_schema.events import NANO

STALE_S = 10.0


def cameras(pictures: tuple[Picture, ...], stamp_ns: int) -> str:
    """One figure for each camera; pictures are shown as received."""
    if not pictures:
        return '<div class="lp"><p class="muted">No picture yet at this moment.</p></div>'
    return '<div class="lp cameras">' + "".join(_figure(p, stamp_ns) for p in pictures) + "</div>"


def _figure(picture: Picture, stamp_ns: int) -> str:
    age_s = max(0.0, (stamp_ns - picture.stamp_ns) / NANO)
    old = f' <span class="warn">{age_s:.0f} s old</span>' if age_s > STALE_S else ""
    data = base64.b64encode(picture.data).decode("ascii")
    return (
        f'<figure><img alt="{text(picture.topic)}" title="{age_s:.1f} s before this moment"'
        f' src="data:{picture.mime};base64,{data}"><figcaption>{name(picture.camera)}{old}</figcaption></figure>'
    )
