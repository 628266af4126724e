"""The memory that a job has used, to compare it with what its rule requests."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path


def peak_memory_mb() -> float:
    """Peak resident memory of this process, in MB (10^6 bytes).

    Snakemake takes samples, which miss short jobs, and on Linux `ru_maxrss` starts at the size of the parent
    process. So on Linux the peak is read from the kernel's VmHWM.
    """
    try:
        peak = re.search(r"^VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
        if peak:
            return int(peak[1]) * 1024 / 1e6
    except OSError:
        pass
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
