"""Write status files from a table. A status file says which links hurt in a clip, when and how much.

hobble injury TABLE.csv FOLDER

TABLE.csv has the columns clip, link (such as LeftLeg-LeftFoot), severity (0 to 10), from, to. `from` and `to`
are frames of the clip's file, counted from 1. An empty `from` means the first frame, an empty `to` the last.
FOLDER has the clips' BVH files. For each clip of the table, the command writes a file CLIP_injuries.txt
beside the clip's BVH file, where the workflow looks for it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hobble.channels.injury.table import skeleton_links, write_statuses
from hobble.cli import batch


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble injury`."""
    parser.add_argument("table", type=Path, help="CSV with the columns clip, link, severity, from, to")
    parser.add_argument("folder", type=Path, help="folder with the clips' BVH files")
    parser.add_argument(
        "--skeleton", default="holden31", help="skeleton that lists the links (default holden31)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the status files and print their paths. Returns the exit status."""
    links = skeleton_links(batch.skeleton_file(options.skeleton))
    for path in write_statuses(options.table, options.folder, links):
        print(path)
    return 0
