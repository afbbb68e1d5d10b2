"""`lios site check`: reports what is missing in the survey of a real site."""

from __future__ import annotations

from typing import Annotated

from workbench.options import Json
from workbench.parameters import Argument


def check(
    site: Annotated[str, Argument(help="Survey file (site.yaml) or a shipped site: paper_home.")],
    json: Json = False,
) -> None:
    """Check the survey of a real place: reach, poses, map, waypoints, tags.

    Exits with 1 if something would stop a robot.

    Examples:

        lios site check paper_home

        lios site check home/site.yaml --json
    """
    from dataclasses import asdict

    from workbench.errors import Failed
    from workbench.terminal import counted, emit_json, emit_table, emit_text, say
    from workbench.worlds.house import LocationId
    from workbench.worlds.names import container_types
    from workbench.worlds.sites.check import check_site
    from workbench.worlds.sites.site import load_site

    place = load_site(site)
    findings = check_site(place)
    reachable = sum(place.travel.reaches(LocationId(container.id)) for container in place.plan.containers)
    errors = sum(finding.level == "error" for finding in findings)
    if json:
        emit_json(
            {
                "site": str(place.path),
                "name": place.name,
                "rooms": len(place.plan.rooms),
                "containers": len(place.plan.containers),
                "reachable": reachable,
                "tags": len(place.tags),
                "travel": place.travel_source,
                "errors": errors,
                "findings": [asdict(finding) for finding in findings],
                "container_types": list(container_types()),
            }
        )
    else:
        metres = place.travel.metres
        emit_text(
            f"{place.name}: {counted(len(place.plan.rooms), 'room')}, "
            f"{counted(len(place.plan.containers), 'container')}, {counted(len(place.tags), 'tag')}; "
            f"{counted(reachable, 'container')} reachable, "
            f"at most {metres.max() if metres.size else 0:.1f} m apart ({place.travel_source})"
        )
        if findings:
            emit_table([asdict(finding) for finding in findings], columns=("level", "where", "what", "fix"))
            if any("container type" in finding.fix for finding in findings):
                say(f"Container types: {', '.join(container_types())}.")
        else:
            say("Nothing is missing.")
    if errors:
        raise Failed(f"{place.path}: {counted(errors, 'finding')} would stop a robot. Correct them and check again.")
