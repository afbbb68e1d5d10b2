#!/usr/bin/env bash
# foxglove-schemas-flatbuffer 0.4.0 and foxglove-schemas-protobuf 0.4.0: what is left out means something else in each.
#
# Expected: the schemas of one set, of the same names and fields, in two encodings mean the same: a message that names some
#   of its fields says the same in both.
# What happens: a Quaternion without fields is the identity in FlatBuffers (w is 1) and the zero quaternion in protobuf,
#   which is no rotation; a Color with red alone is opaque white in FlatBuffers (all default to 1) and invisible red in
#   protobuf (alpha 0). The packages' readmes do not tell.
# Who is hurt: whoever carries code that writes one encoding over to the other: poses whose orientation was left out, an
#   identity before, have a quaternion of length 0, colours have alpha 0, and red turns white the other way round.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check foxglove-schemas-flatbuffer==0.4.0 foxglove-schemas-protobuf==0.4.0 flatbuffers==25.12.19 protobuf==7.36.2
cd "$folder"
cat > show.py <<'PY'
import flatbuffers
from foxglove_schemas_flatbuffer import Color as FlatColor
from foxglove_schemas_flatbuffer import Quaternion as FlatQuaternion
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion

builder = flatbuffers.Builder(0)
FlatQuaternion.QuaternionStart(builder)
builder.Finish(FlatQuaternion.QuaternionEnd(builder))
turn = FlatQuaternion.Quaternion.GetRootAs(bytes(builder.Output()), 0)
builder = flatbuffers.Builder(0)
FlatColor.ColorStart(builder)
FlatColor.ColorAddR(builder, 1.0)
builder.Finish(FlatColor.ColorEnd(builder))
red = FlatColor.Color.GetRootAs(bytes(builder.Output()), 0)
print("FlatBuffers xyzw", turn.X(), turn.Y(), turn.Z(), turn.W(), "rgba", red.R(), red.G(), red.B(), red.A())
turn, red = Quaternion.FromString(Quaternion().SerializeToString()), Color.FromString(Color(r=1).SerializeToString())
print("protobuf    xyzw", turn.x, turn.y, turn.z, turn.w, "rgba", red.r, red.g, red.b, red.a)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "FlatBuffers xyzw 0.0 0.0 0.0 1.0 rgba 1.0 1.0 1.0 1.0
protobuf    xyzw 0.0 0.0 0.0 0.0 rgba 1.0 0.0 0.0 0.0" ]
