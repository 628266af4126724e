"""Open the page on which you control a trained character with the keyboard.

hobble play                    opens the newest report under results/
hobble play results/injured    opens the report of the configuration `injured`
"""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

from hobble.core.errors import InputError

REPORT = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble play`."""
    parser.add_argument(
        "results",
        nargs="?",
        type=Path,
        help="results/<configuration>, or a report file; default: the newest report",
    )
    parser.add_argument("--print", action="store_true", help="print the address, open no browser")


def run(options: argparse.Namespace) -> int:
    """Open the page. Returns the exit status."""
    address = find_report(options.results).resolve().as_uri() + "#play"
    print(address)
    if not options.print and not webbrowser.open(address):
        print("No browser could be started. Open the address above in one.")
    return 0


def find_report(results: Path | None) -> Path:
    """The path of a report. results: a report, or the folder that holds it; None: the newest under results/.

    If there is no report, raises InputError with the command that makes one.
    """
    if results is None:
        found = sorted(Path("results").glob(f"*/{REPORT}"), key=lambda path: path.stat().st_mtime)
        if not found:
            raise InputError("results", "holds no report", fix="`make report` makes one.")
        return found[-1]
    path = results / REPORT if results.is_dir() or results.suffix != ".html" else results
    if not path.is_file():
        raise InputError(path, "no such report", fix=f"`snakemake -c2 {path}` makes it.")
    return path
