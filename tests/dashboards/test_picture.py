"""A picture or video is of a moment at which a run that is drawn goes on."""

from __future__ import annotations

from pathlib import Path

import pytest
from toy_run import toy_run

from dashboards.model.timeline import timeline_of
from dashboards.rendering.picture import Framing, draw_picture
from dashboards.rendering.video import draw_video
from workbench import cli
from workbench.errors import BadValue


def test_a_moment_after_the_end_is_refused_before_anything_is_drawn(tmp_path: Path) -> None:
    runs = [timeline_of(toy_run())]
    after = runs[0].duration_s + 1
    for at_s in (-1.0, after):
        with pytest.raises(BadValue, match=r"--at is .* within the runs"):
            draw_picture(runs, tmp_path / "a.png", at_s=at_s, framing=Framing())
    with pytest.raises(BadValue, match="--at is "):
        draw_video(runs, tmp_path / "a.mp4", framing=Framing(), from_s=after)
    with pytest.raises(BadValue, match="--until is "):
        draw_video(runs, tmp_path / "a.mp4", framing=Framing(), until_s=1e6)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--until=5", "--speed=9", "--fps=3"])
def test_what_is_of_videos_alone_is_refused_for_a_picture(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["render", "nowhere.mcap", "-o", str(tmp_path / "a.png"), option]) == 2
    assert f"{option.partition('=')[0]} is" in capsys.readouterr().err
