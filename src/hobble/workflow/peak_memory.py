"""The memory that a job has used, to compare it with what its rule requests."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path


def peak_memory_mb() -> float:
    """Peak resident memory of this process, in MB (10^6 bytes).

    Snakemake measures by sampling, which misses short jobs. `ru_maxrss` starts at the size of the parent
    process. So on Linux this reads the kernel's VmHWM.
    """
    try:
        mark = re.search(r"^VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
        if mark:
            return int(mark[1]) * 1024 / 1e6
    except OSError:
        pass
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
