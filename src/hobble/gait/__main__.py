"""An earlier name of `hobble gait`, kept for a version."""

import sys

from hobble.cli.__main__ import main

if __name__ == "__main__":
    sys.exit(main(["gait", *sys.argv[1:]]))
