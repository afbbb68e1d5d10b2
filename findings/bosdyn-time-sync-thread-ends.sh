#!/usr/bin/env bash
# bosdyn-client 5.2.0: the time-sync thread ends at its first failed call, and its endpoint goes on with the old skew.
#
# Expected: a thread "for achieving and maintaining time-sync" asks again once the network is back, or the endpoint says
#   that its skew is old.
# What happens: one error of one call ends the thread; has_established_time_sync stays true and clock_skew stays what it
#   was, however long ago; nothing is raised where stamps are converted.
# Who is hurt: recordings over Wi-Fi: after one lost call every later stamp drifts with the clocks.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0
cd "$folder"
cat > show.py <<'PY'
import time

from bosdyn.api import time_sync_pb2
from bosdyn.client.exceptions import RpcError
from bosdyn.client.time_sync import TimeSyncClient, TimeSyncThread


class Robot(TimeSyncClient):
    """A robot whose clock is ahead by skew_s, and whose network fails while away."""

    skew_s, away = 3, False

    def get_time_sync_update(self, previous_round_trip, clock_identifier, **_):
        if self.away:
            raise RpcError(None, "away")
        answer = time_sync_pb2.TimeSyncUpdateResponse(clock_identifier="mine")
        answer.state.status = time_sync_pb2.TimeSyncState.STATUS_OK
        answer.state.best_estimate.clock_skew.seconds = self.skew_s
        return answer


robot = Robot()
thread = TimeSyncThread(robot)
thread.time_sync_interval_sec = 0.05
thread.start()
thread.wait_for_sync()
robot.away = True
time.sleep(1)
robot.away, robot.skew_s = False, 8
time.sleep(1)
endpoint = thread.endpoint
print("stopped", thread.stopped)
print("established", endpoint.has_established_time_sync, "skew", endpoint.clock_skew.seconds)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "stopped True
established True skew 3" ]
