"""What a change must not change: motion, labels, weights and measurements of two checkouts.

    python benchmarks/goldens.py write FOLDER [motion] [labels] [test] [limp]    # in each checkout
    python benchmarks/goldens.py compare FOLDER OTHER

`motion` and `labels` run the commands `hobble motion` and `hobble labels` on every folder of clips below
shared/mocap and shared/wild; `test` and `limp` run the workflow. Only commands and files are used, no
function of the package, so both checkouts can look quite different. `compare` exits with 1 if anything
differs and says by how much.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SHARED = Path(os.environ.get("HOBBLE_SHARED", ROOT.parent / "shared"))
PARTS = ("motion", "labels", "test", "limp")
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")
# Costs and names of processors differ from run to run.
VOLATILE = re.compile(r"seconds|milliseconds|_ms|memory|_mb|processor|version|time_of|created|load|threads")


def run(*command: str | Path) -> str:
    """Run a command with this checkout's package. Returns what it printed, without absolute paths."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=ROOT,
        env=environment,
        text=True,
        capture_output=True,
        check=False,
    )
    return re.sub(r"(/[^\s/:]+)+/", "", done.stdout + done.stderr) + f"\nexit status {done.returncode}\n"


def clip_folders() -> list[Path]:
    """Every folder with BVH files below shared/mocap and shared/wild."""
    files = [file for part in ("mocap", "wild") for file in (SHARED / part).rglob("*.bvh")]
    return sorted({file.parent for file in files})


def write_commands(folder: Path, part: str) -> None:
    """The files that `hobble motion` or `hobble labels` makes of each folder of clips, and what it says."""
    options = ["--skeleton", "holden31"] if part == "motion" else []
    for clips in clip_folders():
        out = folder / part / clips.relative_to(SHARED)
        out.mkdir(parents=True, exist_ok=True)
        said = run(sys.executable, "-m", "hobble.cli.__main__", part, clips, out, *options)
        (out / "said.txt").write_text(said)
        print(part, clips.relative_to(SHARED), flush=True)


def write_workflow(folder: Path, configuration: str) -> None:
    """Weights and measurements of a configuration, trained in a folder of its own."""
    work = folder / f"run-{configuration}"
    work.mkdir(parents=True, exist_ok=True)
    said = run(
        sys.executable, "-m", "snakemake", "-s", ROOT / "Snakefile", "-d", work, "-c2",
        f"results/{configuration}/report.html",
    )  # fmt: skip
    (folder / f"said-{configuration}.txt").write_text(said)
    results = work / "results" / configuration
    for file in [
        *results.rglob("evaluation/*.json"),
        *results.rglob("network/*"),
        results / "scenarios.json",
    ]:
        if file.is_file():
            target = folder / configuration / file.relative_to(results)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)


def difference(one: Path, other: Path) -> str:
    """How two files differ; empty if they are equal."""
    if not other.exists():
        return "missing"
    if one.read_bytes() == other.read_bytes():
        return ""
    if one.suffix == ".npz":
        a, b = np.load(one), np.load(other)
        if sorted(a) != sorted(b):
            return f"keys {sorted(set(a) ^ set(b))}"
        pairs = [(a[key], b[key], key) for key in a if a[key].dtype.kind in "fiub"]
        if any(x.shape != y.shape for x, y, _ in pairs):
            return "other shapes"
        worst = max((float(np.max(np.abs(x * 1.0 - y), initial=0)), key) for x, y, key in pairs)
        return f"{worst[0]:.3g} in {worst[1]}" if worst[0] else ""
    if one.suffix == ".json":
        changes = list(json_changes(json.loads(one.read_text()), json.loads(other.read_text()), ""))
        return "; ".join(changes[:4]) + (f" and {len(changes) - 4} more" if len(changes) > 4 else "")
    a, b = (NUMBER.sub("#", file.read_text()) for file in (one, other))
    if a != b:
        return "other words"
    x, y = (np.array([float(n) for n in NUMBER.findall(file.read_text())]) for file in (one, other))
    return f"{np.max(np.abs(x - y)):.3g}"


def json_changes(one: object, other: object, at: str):
    """Yield a line for each value that differs, costs left out."""
    if VOLATILE.search(at):
        return
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            yield from json_changes(one.get(key), other.get(key), f"{at}.{key}")
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for number, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from json_changes(a, b, f"{at}[{number}]")
    elif one != other:
        yield f"{at}: {str(one)[:60]} -> {str(other)[:60]}"


def compare(folder: Path, other: Path) -> int:
    """Print every file of `folder` that differs in `other`. Returns the number of them."""
    count = differing = 0
    for part in PARTS:
        for file in sorted((folder / part).rglob("*")):
            if file.is_file() and (other / part).exists():
                count += 1
                text = difference(file, other / file.relative_to(folder))
                if text:
                    differing += 1
                    print(f"{file.relative_to(folder)}: {text}")
    print(f"{count} files compared, {differing} differ")
    return differing


def main() -> int:
    """Run the command line."""
    if len(sys.argv) > 3 and sys.argv[1] == "compare":
        return min(1, compare(Path(sys.argv[2]), Path(sys.argv[3])))
    if len(sys.argv) < 3 or sys.argv[1] != "write":
        print(__doc__)
        return 0 if "--help" in sys.argv else 2
    folder = Path(sys.argv[2]).resolve()
    for part in sys.argv[3:] or PARTS:
        write_commands(folder, part) if part in ("motion", "labels") else write_workflow(folder, part)
    return 0


if __name__ == "__main__":
    sys.exit(main())
