"""Are figures of speed held to their aims? Only when asked for: machines differ, and are shared with other work.

LIOS_TIMINGS=1 pytest tests/benchmarks -s -n0
"""

from __future__ import annotations

import os

HOLD_FIGURES = os.environ.get("LIOS_TIMINGS") == "1"
