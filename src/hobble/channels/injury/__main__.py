"""Writes status files from a table. A status file says which links hurt in a clip, when and how much.

A link is a pair of neighbouring joints.

python -m hobble.channels.injury TABLE.csv FOLDER --skeleton SKELETON.yaml
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hobble.channels.injury.table import skeleton_links, write_statuses
from hobble.core.errors import HobbleError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command. Returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m hobble.channels.injury", description="Writes status files from a table."
    )
    parser.add_argument("table", help="CSV with the columns clip, link, severity, from, to")
    parser.add_argument(
        "folder", help="folder with the clips' BVH files; the status files are written beside them"
    )
    parser.add_argument(
        "--skeleton",
        default="config/skeletons/holden31.yaml",
        help="skeleton file that lists the links",
    )
    options = parser.parse_args(arguments)
    try:
        for path in write_statuses(options.table, options.folder, skeleton_links(Path(options.skeleton))):
            print(path)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
