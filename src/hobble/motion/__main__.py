"""An earlier name of `hobble look` and `hobble rig`, kept for a version."""

import sys

from hobble.cli.__main__ import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
