#!/usr/bin/env bash
# numba 0.68.1: a compiled function's on-disk cache cannot be opened after a NamedTuple argument type was renamed.
#
# Expected: the cache index is stamped with the source file's time and size, so that after an edit of the source the
#   old entries are ignored and the function is compiled again.
# What happens: the index is unpickled whole, signatures included, before its stamp is compared. Where a signature
#   names a NamedTuple class that has since been renamed, unpickling raises AttributeError at the first call, for any
#   function of the same module, name and line number.
# Who is hurt: users of packages with @njit(cache=True) kernels over NamedTuples who update in place (git pull in an
#   editable install, or pip, which leaves .nbi and .nbc files in __pycache__): the first command after the update fails,
#   until __pycache__ is deleted by hand.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cd "$folder"
write_kernel() {
  cat > kernel.py <<PY
from typing import NamedTuple

from numba import njit


class $1(NamedTuple):
    metres: float


@njit(cache=True)
def twice(arguments):
    return 2 * arguments.metres
PY
}
write_kernel Query
first=$("$folder/venv/bin/python" -c 'import kernel; print(kernel.twice(kernel.Query(1.5)))')
write_kernel TourQuery
second=$("$folder/venv/bin/python" -c '
import kernel
try:
    print(kernel.twice(kernel.TourQuery(1.5)))
except AttributeError as error:
    print("AttributeError:", str(error).split(" on ")[0])
')
rm -rf __pycache__
third=$("$folder/venv/bin/python" -c 'import kernel; print(kernel.twice(kernel.TourQuery(1.5)))')
seen="first run: $first
after the rename: $second
without the cache: $third"
echo "$seen"
[ "$seen" = "first run: 3.0
after the rename: AttributeError: Can't get attribute 'Query'
without the cache: 3.0" ]
