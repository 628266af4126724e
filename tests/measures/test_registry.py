"""The descriptions of all measurements are read fast."""

import subprocess
import sys


def test_planning_imports_nothing_slow() -> None:
    """Descriptions are read at planning and in every job of a cluster, so their imports must be fast."""
    code = "import sys, hobble.config.models; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    slow = {"numba", "torch", "pandas", "jinja2", "scipy"}
    assert [name for name in done.stdout.split() if name in slow or name.endswith("_run")] == []
