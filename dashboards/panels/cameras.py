"""Panel of the newest picture of each camera, with its age."""

from __future__ import annotations

import base64

from markupsafe import Markup

from dashboards.panels.markup import html, name, text
from dashboards.sensing.pictures import Picture
from workbench.log_schema.events import NANO

STALE_S = 10.0


def cameras(pictures: tuple[Picture, ...], stamp_ns: int) -> Markup:
    """One figure for each camera; pictures are shown as received."""
    if not pictures:
        return Markup('<div class="lp"><p class="muted">No picture yet at this moment.</p></div>')
    return (
        Markup('<div class="lp cameras">')
        + Markup("").join(_figure(p, stamp_ns) for p in pictures)
        + Markup("</div>")
    )


def _figure(picture: Picture, stamp_ns: int) -> Markup:
    age_s = max(0.0, (stamp_ns - picture.stamp_ns) / NANO)
    old = html(' <span class="warn">{:.0f} s old</span>', age_s) if age_s > STALE_S else ""
    data = base64.b64encode(picture.data).decode("ascii")
    return html(
        '<figure><img alt="{}" title="{:.1f} s before this moment" src="data:{};base64,{}">'
        "<figcaption>{}{}</figcaption></figure>",
        text(picture.topic),
        age_s,
        picture.mime,
        data,
        name(picture.camera),
        old,
    )
