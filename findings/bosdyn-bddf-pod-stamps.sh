#!/usr/bin/env bash
# bosdyn-core 5.2.0: a number written to a BDDF log with a time comes back without it, and a vector cannot be written.
#
# Expected: PodSeriesWriter.write(timestamp_nsec, sample) stores the sample with its time ("nsec since unix epoch to timestamp
#   the data"), and PodSeriesReader gives both back. A series of dimension [3] takes "array/vector of POD values".
# What happens: samples are gathered in blocks of 2048 bytes, and the format has one time a block, that of the first sample:
#   of 300 doubles at irregular times two times are left, without a word. A vector fails in the writer (struct.error), however it
#   is given; written by hand as bytes, it fails in the reader (TypeError).
# Who is hurt: whoever keeps battery, joint or force readings in Spot's own log format: rates and delays can no longer be
#   told, and values that are spread evenly over a block are put at wrong times.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-core==5.2.0 bosdyn-api==5.2.0
cd "$folder"
cat > show.py <<'PY'
import struct

from bosdyn.api import bddf_pb2
from bosdyn.bddf import DataReader, DataWriter, PodSeriesReader, PodSeriesWriter

SCALAR, VECTOR, BYTES = ({"name": name} for name in ("scalar", "vector", "bytes"))
written = [(1_700_000_000_000_000_000 + number**2 * 1_000_000, float(number)) for number in range(300)]
with open("log.bddf", "wb") as stream, DataWriter(stream) as log:
    series = PodSeriesWriter(log, "test", SCALAR, bddf_pb2.TYPE_FLOAT64)
    for stamp, value in written:
        series.write(stamp, value)
    vectors = PodSeriesWriter(log, "test", VECTOR, bddf_pb2.TYPE_FLOAT64, dimensions=[3])
    for given in ((1.0, 2.0, 3.0), [1.0, 2.0, 3.0]):
        try:
            vectors.write(1, given)
        except struct.error as error:
            print("write", type(given).__name__, "struct.error:", error)
    number = log.add_pod_series("test", BYTES, bddf_pb2.TYPE_FLOAT64, dimension=[3])
    log.write_data(number, 1, struct.pack("<3d", 1, 2, 3))
reader = DataReader(filename="log.bddf")
series = PodSeriesReader(reader, SCALAR)
blocks = [series.read_samples(index) for index in range(series.num_data_blocks)]
values = [value for _, block in blocks for value in block]
print("values", len(values), values == [value for _, value in written], "times", len(blocks), "of", len(written))
try:
    print(PodSeriesReader(reader, BYTES).read_samples(0))
except TypeError as error:
    print("read TypeError:", error)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "write tuple struct.error: pack expected 3 items for packing (got 1)
write list struct.error: pack expected 3 items for packing (got 1)
values 300 True times 2 of 300
read TypeError: 'itertools.product' object cannot be interpreted as an integer" ]
