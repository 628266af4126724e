"""The subcommands of `hobble` for a trained character: play, export, study."""

import argparse
import webbrowser
from pathlib import Path
from typing import get_args

from hobble.cli.command import arg, command
from hobble.core.errors import HobbleError, InputError
from hobble.core.section import PhaseMode
from hobble.measures import study
from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.runtime.generated import write_motions


@command(
    "a trained character",
    arg("results", nargs="?", type=Path, help="its folder, or a report; default: the newest report"),
    arg("--print", action="store_true", help="print the address, open no browser"),
)
def play(options: argparse.Namespace) -> int:
    """Open the page on which you control a trained character with the keyboard.

    hobble play                    opens the newest report under results/
    hobble play results/injured    opens the report of the configuration `injured`
    """
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
        found = sorted(Path("results").glob("*/report.html"), key=lambda path: path.stat().st_mtime)
        if not found:
            raise InputError("results", "holds no report", fix="`make report` makes one.")
        return found[-1]
    path = results / "report.html" if results.is_dir() or results.suffix != ".html" else results
    if not path.is_file():
        raise InputError(path, "no such report", fix=f"`snakemake -c2 {path}` makes it.")
    return path


TO = "onnx: one file; bin: files as in the release of Holden et al.; bvh: some walks that it generates"
MODE = "how the network's weights are interpolated over the phase; cubic is exact"


@command(
    "a trained character",
    arg("to", choices=("onnx", "bin", "bvh"), help=TO),
    arg("network", help="weights.npz, the folder that holds it, or a folder of .bin files"),
    arg("target", help="the file or folder to write"),
    arg("--mode", choices=get_args(PhaseMode), default="cubic", help=MODE),
    arg("--skeleton", help="a file of config/skeletons, for a network file that has no skeleton"),
)
def export(options: argparse.Namespace) -> int:
    """Export a network (onnx, bin), or motions that it generates (bvh).

    hobble export onnx results/holden/network holden.onnx --mode cubic
    hobble export bin results/holden/network out/holden
    hobble export bvh out/holden out/walks --skeleton config/skeletons/holden31.yaml
    """
    network = load_network(options.network, options.skeleton)
    if options.to != "bvh":
        print(network.export(options.to, options.target, options.mode))
        return 0
    if network.skeleton is None:
        raise HobbleError("the network has no skeleton: pass one with --skeleton")
    tracks = write_motions(network, options.target, Runtime(mode=options.mode))
    print(f"{options.target}: {', '.join(scenario.name for scenario, _ in tracks)}")
    return 0


command("a trained character", study.add_arguments, name="study", text=str(study.__doc__))(study.run)
