"""Makes the sample logs of this folder again: `python logs/make.py [FOLDER] [--spot]`.

The same seeds give the same runs: all topics under /search/ but /search/timing hold the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

HERE = Path(__file__).resolve().parent
ESTIMATOR = "counts"

SIMULATED: Mapping[str, tuple[int, RequestedTask, str]] = {
    "find-greedy": (9, RequestedTask(find="mug"), "greedy"),
    "find-lios": (9, RequestedTask(find="mug"), "lios"),
    "find-conditioned-lios": (9, RequestedTask(find="mug"), "conditioned-lios"),
    "deliver-3": (5, RequestedTask(scenario="deliver-3"), "model-lios"),
    "breakfast": (5, RequestedTask(scenario="breakfast"), "model-lios"),
}
"""Log, shipped house, task, strategy."""

CUT_FROM, CUT_AT = "deliver-3", 0.605
"""The log that is cut off, and what share of its bytes is left: it ends within a chunk."""

SPOT_HOMES = ("A", "B", "C", "D")
SPOT_STRATEGIES: Mapping[str, str] = {
    "model-lios": "",
    "pes-greedy": "-pes-greedy",
    "pes-lios": "-pes-lios",
    "conditioned-lios": "-conditioned-lios",
}
"""Strategy of a Spot log, and how its name goes on after that of the configuration."""
RAW_HOME = "A"
"""Configuration A, which the paper tells most of, also holds bosdyn's messages as they came and a depth camera."""


def make_simulated(folder: Path) -> list[Path]:
    """Records the simulated runs and cuts one off."""
    made = []
    for name, (house, wish, strategy) in SIMULATED.items():
        trial = trial_for(wish, load_house(f"{shipped_houses()}:{house}"), strategy=strategy, estimator=ESTIMATOR)
        record_trial(trial, folder / f"{name}.mcap", force=True)
        made.append(folder / f"{name}.mcap")
    whole = (folder / f"{CUT_FROM}.mcap").read_bytes()
    (folder / "cut-off.mcap").write_bytes(whole[: int(len(whole) * CUT_AT)])
    return [*made, folder / "cut-off.mcap"]


def make_spot(folder: Path) -> list[Path]:
    """Runs the paper's four configurations on a simulated Spot; needs the extra "spot"."""
    from replayers.commands.evaluate.spot import spot

    made = []
    for home in SPOT_HOMES:
        spot(
            strategies=",".join(SPOT_STRATEGIES),
            configurations=home,
            output=folder,
            raw=home == RAW_HOME,
            cross=False,
            force=True,
        )
        for strategy, end in SPOT_STRATEGIES.items():
            log = folder / f"spot-home-{home}{end}.mcap"
            (folder / f"spot_{home}_{strategy}.mcap").replace(log)
            made.append(log)
    return made


def main() -> None:
    words = [word for word in sys.argv[1:] if word != "--spot"]
    folder = Path(words[0]) if words else HERE
    folder.mkdir(parents=True, exist_ok=True)
    made = make_simulated(folder)
    if "--spot" in sys.argv:
        made += make_spot(folder)
    for log in made:
        print(f"{log.stat().st_size / 1000:8.0f} kB  {log}")


if __name__ == "__main__":
    main()
