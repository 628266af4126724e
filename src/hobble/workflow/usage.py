"""What a job has used, so that what its rule asks of a cluster can be held against it."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path


def peak_memory_mb() -> float:
    """The largest resident memory of this process so far, in MB (10^6 bytes).

    Snakemake's own figure comes from samples, which miss a job of a second altogether; `ru_maxrss` begins at
    the size of the process that started this one, so on Linux the kernel's mark of this program is read.
    """
    try:
        mark = re.search(r"^VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(), re.M)
        if mark:
            return int(mark[1]) * 1024 / 1e6
    except OSError:
        pass
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
