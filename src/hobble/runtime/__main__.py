"""An earlier name of `hobble export`, kept for a version."""

import sys

from hobble.cli.__main__ import main

if __name__ == "__main__":
    sys.exit(main(["export", *sys.argv[1:]]))
