"""Notes of people on a run, marked on the timeline."""

from __future__ import annotations

from pathlib import Path
from shutil import copy

from dashboards.library.library import Library
from dashboards.model.clock import Clock
from dashboards.panels.phase_strip import strip
from replayers.log_tools.notes import add_note

LOGS = Path(__file__).resolve().parents[2] / "logs"


def test_a_note_stands_on_its_runs_row_at_its_time_with_escaped_words(tmp_path: Path) -> None:
    log = Path(copy(sorted(p for p in LOGS.glob("*.mcap"))[0], tmp_path))
    library = Library([log])
    timeline = library.timeline(0)
    clock = Clock(timelines=(timeline,))
    assert "▼" not in strip(clock, ["a"], [(0, 0, 0)], [library.notes(0)])
    middle = (timeline.start_ns + timeline.end_ns) // 2
    add_note(log, "the <b>drawer</b> stuck", at=f"{(middle - timeline.start_ns) / 1e9:.3f}", author="Ada")
    library.reread(0)
    drawn = strip(clock, ["a"], [(0, 0, 0)], [library.notes(0)])
    (note,) = library.notes(0)
    x = 100 * clock.reading(note.start_ns) / clock.end
    assert f'<text x="{x:.3f}%"' in drawn
    assert "<title>Ada: the &lt;b&gt;drawer&lt;/b&gt; stuck</title>" in drawn
    assert "▼ note" in drawn
