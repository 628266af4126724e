"""Write status files, which say what hurts in each clip, from a table of clips, links and severities.

hobble injury TABLE.csv FOLDER

TABLE.csv has the columns clip, link (such as LeftLeg-LeftFoot), severity, from, to. `from` and `to` are
frames of the clip's file, counted from 1. An empty `from` means the first frame, an empty `to` the last. A
file CLIP_injuries.txt is written beside each clip in FOLDER, where the workflow reads it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hobble.channels.injury.table import skeleton_links, write_statuses
from hobble.cli import batch


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble injury`."""
    parser.add_argument("table", type=Path, help="CSV with the columns clip, link, severity, from, to")
    parser.add_argument("folder", type=Path, help="the folder of the clips' BVH files")
    parser.add_argument(
        "--skeleton", default="holden31", help="the skeleton that defines the links (default holden31)"
    )


def run(options: argparse.Namespace) -> int:
    """Write the files and print their names. Returns the exit status."""
    links = skeleton_links(batch.skeleton_file(options.skeleton))
    for path in write_statuses(options.table, options.folder, links):
        print(path)
    return 0
