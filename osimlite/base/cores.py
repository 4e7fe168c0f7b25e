"""Number of processor cores for parallel work."""

from __future__ import annotations

import os
import sys


def count_cores() -> int:
    """Return the number of processor cores that this process may use.

    On Linux these are the cores of its affinity mask, elsewhere all cores.
    """
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
