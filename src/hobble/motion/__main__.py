"""An earlier name of `hobble look` and `hobble rig`, kept for a version."""

import runpy

if __name__ == "__main__":
    runpy.run_module("hobble.cli", run_name="__main__")
