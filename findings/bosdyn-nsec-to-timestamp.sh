#!/usr/bin/env bash
# bosdyn-core 5.2.0: nsec_to_timestamp is a second late just below a full second.
#
# Expected: whole nanoseconds in, the same whole nanoseconds out.
# What happens: the seconds come from a division as floats, which rounds up within the last 128 ns or so of a second
#   (at present-day stamps), while the nanoseconds come from a remainder: the stamp is one second late.
# Who is hurt: whoever asks the robot for data by time ranges, or compares stamps of two sources.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-core==5.2.0 bosdyn-api==5.2.0
cd "$folder"
cat > show.py <<'PY'
from bosdyn.util import nsec_to_timestamp, timestamp_to_nsec

for nanos in (1_700_000_000_999_999_800, 1_700_000_000_999_999_900):
    print(timestamp_to_nsec(nsec_to_timestamp(nanos)) - nanos)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "0
1000000000" ]
