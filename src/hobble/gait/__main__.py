"""An earlier name of `hobble gait`, kept for a version."""

import runpy
import sys

if __name__ == "__main__":
    sys.argv.insert(1, "gait")
    runpy.run_module("hobble.cli", run_name="__main__")
