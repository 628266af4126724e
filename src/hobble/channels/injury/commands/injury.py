"""Write injury files from a table of clips, links and severities.

hobble injury TABLE.csv FOLDER

TABLE.csv has the columns clip, link, severity, from, to. The last two are frames of the clip's file, counted
from 1; empty means its first and last frame. The files NAME_injuries.txt are written beside the clips in
FOLDER, where the workflow reads them.
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
