"""Benchmark: ten minutes with a simulated Spot driven around its home, with pictures at 10 Hz; counts lost messages.

`python tests/benchmarks/spot_session.py [SECONDS] [-o LOG]`: the robot, who drives it, and `lios spot record` run as
three processes, in real time. Prints what `lios spot record --json` answers, then `lios doctor`'s verdict.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from recorders.spot.run.site_tasks import delivery_of
from workbench.worlds.sites.site import load_site

PORT = 50444
LIOS = [sys.executable, "-c", "import sys; from workbench.cli import run; sys.exit(run(sys.argv[1:]))"]
ROUND = (
    "wp-bed", "wp-desk", "wp-tv-stand", "wp-couch", "wp-garbage-can", "wp-fridge", "wp-countertop", "wp-sink",
    "wp-dining-table",
)  # fmt: skip
STAND_S = 5.0


def drive(certificate: Path, seconds: float) -> None:
    """What an operator does with the tablet: from waypoint to waypoint, standing a while at each."""
    from bosdyn.api.graph_nav import graph_nav_pb2, nav_pb2

    from recorders.spot.client.connection import Connection, Credentials, RobotAddress
    from recorders.spot.client.control import Control

    end = time.monotonic() + seconds
    going = graph_nav_pb2.NavigationFeedbackResponse.STATUS_FOLLOWING_ROUTE
    login = Credentials(username="user", password="simulated")
    with (
        Connection(RobotAddress(host="127.0.0.1", port=PORT), login, certificate=certificate) as connection,
        Control(connection, own_estop=True),
    ):
        client = connection.client("graph-nav-service")
        client.set_localization(
            nav_pb2.Localization(), fiducial_init=graph_nav_pb2.SetLocalizationRequest.FIDUCIAL_INIT_NEAREST
        )
        turn = 0
        while time.monotonic() < end:
            number = client.navigate_to(ROUND[turn % len(ROUND)], 120.0)
            while time.monotonic() < end and client.navigation_feedback(number).status == going:
                time.sleep(0.5)
            time.sleep(STAND_S)
            turn += 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", type=float, nargs="?", default=600.0)
    parser.add_argument("-o", "--output", type=Path, default=Path("ten.mcap"))
    parser.add_argument("--drive", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.drive is not None:
        drive(given.drive, given.seconds)
        return 0
    environment = {**os.environ, "BOSDYN_CLIENT_USERNAME": "user", "BOSDYN_CLIENT_PASSWORD": "simulated"}
    with tempfile.TemporaryDirectory(prefix="lios-ten-") as folder:
        certificate = Path(folder) / "robot.pem"
        simulate = ["spot", "simulate", "--port", str(PORT), "--certificate", str(certificate)]
        robot = subprocess.Popen([*LIOS, *simulate])
        driver = None
        try:
            while not certificate.exists():
                time.sleep(0.1)
            driver = subprocess.Popen(
                [sys.executable, __file__, str(given.seconds + 30), "--drive", str(certificate)], env=environment
            )
            time.sleep(8.0)
            there = ["--robot", f"127.0.0.1:{PORT}", "--certificate", str(certificate), "--site", "paper_home"]
            task = ["--task", str(delivery_of(load_site("paper_home")))]
            how = [*task, "--for", str(given.seconds), "--images-hz", "10", "--json", "--force"]
            record = [*LIOS, "spot", "record", *there, *how, "-o", str(given.output)]
            told = subprocess.run(record, env=environment, stdout=subprocess.PIPE, check=True, text=True).stdout
        finally:
            for process in (driver, robot):
                if process is not None:
                    process.terminate()
                    process.wait()
    print(json.dumps(json.loads(told), indent=1))
    return subprocess.run([*LIOS, "doctor", str(given.output)], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
