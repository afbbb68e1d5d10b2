"""Whether figures of speed are compared with their aims: only on request, since machines differ and are shared.

LIOS_TIMINGS=1 pytest tests/benchmarks -s -n0
"""

from __future__ import annotations

import os

HOLD_FIGURES = os.environ.get("LIOS_TIMINGS") == "1"
