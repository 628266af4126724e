"""Measures the memory that a job has used, to compare it with what the job's rule requests."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path


def peak_memory_mb() -> float:
    """Peak resident memory of this process, in MB (10^6 bytes).

    Snakemake measures memory only now and then, so it misses short jobs. On Linux the peak is read from the
    kernel's VmHWM, because there `ru_maxrss` starts at the size of the parent process.
    """
    try:
        peak = re.search(r"^VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
        if peak:
            return int(peak[1]) * 1024 / 1e6
    except OSError:
        pass
    unit_bytes = 1 if sys.platform == "darwin" else 1024  # unit of `ru_maxrss`
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit_bytes / 1e6
