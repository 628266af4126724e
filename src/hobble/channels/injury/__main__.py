"""An earlier name of `hobble injury`, kept for a version."""

import runpy
import sys

if __name__ == "__main__":
    sys.argv.insert(1, "injury")
    runpy.run_module("hobble.cli", run_name="__main__")
