"""The report of a data set with many clips: the size of the page, compared with that of the original data
set.

    python benchmarks/report_of_many.py results/limp results/datasets/synthetic --clips 10000

Copies the reports of the data set's clips under new names, and links their rows and terrain, in a temporary
folder. Then it renders the page twice: with the clips as they are, and with `--clips` of them. Measurements
stay as they are, since accuracy and roll-outs of a large data set are measured on a sample.
"""

import argparse
import json
import resource
import tempfile
import time
from pathlib import Path

from hobble.core.files import read_json
from hobble.core.processors import processor_name
from hobble.models.load import load_network
from hobble.report.character import packed_comparisons, playable_with_recogniser
from hobble.report.gather import gather
from hobble.report.page import render_report
from hobble.runtime import Runtime

REPORTS = {"motion": "motion", "labels": "labels", "channels": "channels/injury"}
TABLES = {"rows": "database/clips", "terrain": "terrain/clips"}


def copies(dataset: Path, folder: Path, count: int) -> tuple[dict[str, list[str]], dict[str, str]]:
    """Files of `count` clips for `gather`, and their split: one of nine is held out."""
    names = sorted(path.stem for path in (dataset / "database/clips").glob("*.npz"))
    files: dict[str, list[str]] = {kind: [] for kind in (*REPORTS, *TABLES)}
    splits = {}
    for kind in files:
        (folder / kind).mkdir(parents=True)
    for i in range(count):
        source = names[i % len(names)]
        head, _, tail = source.partition("_")
        name = source if i < len(names) else f"{head}-{i}" + (f"_{tail}" if tail else "")
        splits[name] = "train" if i % 9 else "held_out"
        for kind, place in REPORTS.items():
            path = folder / kind / f"{name}.json"
            path.write_text(json.dumps(read_json(dataset / place / f"{source}.json") | {"clip": name}))
            files[kind].append(str(path))
        for kind, place in TABLES.items():
            path = folder / kind / f"{name}.npz"
            path.symlink_to((dataset / place / f"{source}.npz").resolve())
            files[kind].append(str(path))
    return files, splits


def rendered(results: Path, dataset: Path, count: int) -> tuple[float, float]:
    """Processor seconds and megabytes of the page of `count` clips."""
    with tempfile.TemporaryDirectory() as scratch:
        files, splits = copies(dataset, Path(scratch), count)
        start = time.process_time()
        weights = results / "network/weights.npz"
        material = gather(
            name=results.name,
            dataset=dataset.name,
            title=None,
            splits=splits,
            configuration=results / "configuration.yaml",
            measurements=sorted(map(str, (results / "evaluation").glob("*.json"))),
            pipeline=results / "pipeline.json",
            history=results / "network/history.csv",
            weights=weights,
            **files,
        )
        network = load_network(weights)
        runtime = Runtime.model_validate(material.resolved["configuration"]["runtime"])
        page = render_report(
            material,
            playable_with_recogniser(network, runtime),
            packed_comparisons(network, files["rows"], splits),
            (results.parent / "page/bundle.js").read_text(encoding="utf-8"),
        )
        return time.process_time() - start, len(page.encode()) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path, help="results of a configuration, with its report")
    parser.add_argument("dataset", type=Path, help="results of its data set")
    parser.add_argument("--clips", type=int, default=10_000)
    arguments = parser.parse_args()
    print(processor_name())
    few = len(list((arguments.dataset / "database/clips").glob("*.npz")))
    before = rendered(arguments.results, arguments.dataset, few)
    after = rendered(arguments.results, arguments.dataset, arguments.clips)
    for count, (seconds, size) in ((few, before), (arguments.clips, after)):
        print(f"{count:7,} clips: {seconds:6.1f} s of processor time, {size:5.1f} MB")
    print(f"ratios: {after[0] / before[0]:.1f} times the time, {after[1] / before[1]:.2f} times the size")
    print(f"memory at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000:.0f} MB")


if __name__ == "__main__":
    main()
