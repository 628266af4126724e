"""How fast patches are drawn and cycles fitted, against plain numpy in the same run; what the search finds.

    python benchmarks/terrain.py                                a synthetic walk over slopes
    python benchmarks/terrain.py FOLDER                         the BVH files of a folder, and mirrors
    python benchmarks/terrain.py FOLDER --cycles 8800 --flat 0.48 --workers 2

The last line repeats the clips until they have as many cycles as the released data set of the original. It
measures the drawing of the patches and all fits, as done by jobs on two cores.
"""

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.processors import processor_name
from hobble.database import DatabaseOptions
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import Labels as ClipLabels
from hobble.labels.label import label_clip, mirror_labels
from hobble.motion import ClipMotion
from hobble.motion.edit import mirror_clip
from hobble.motion.make import make_clip
from hobble.motion.skeleton_file import load_skeleton
from hobble.synthetic.generate_clip import Synthetic, write_clip
from hobble.terrain import HeightSampling, Terrain
from hobble.terrain import patches as search
from hobble.terrain.clip_fits import clip_fits
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.patches import Patches, draw_patches

SKELETONS = Path(__file__).resolve().parents[1] / "config/skeletons"
OPTIONS = Terrain()
SAMPLING = HeightSampling(**DatabaseOptions().model_dump(include=set(HeightSampling.model_fields)))
Labelled = tuple[Clip, ClipLabels]


def made(bvh: Path, ground: str) -> list[Labelled]:
    """The clip of a BVH file and its mirror, with labels; nothing if they have no cycle."""
    motion = ClipMotion()
    skeleton = SKELETONS / "holden31.yaml"
    try:
        clip, report = make_clip(
            bvh, skeleton, str(SKELETONS), clip=bvh.stem, skeleton_name="holden31", options=motion
        )
    except HobbleError:
        return []
    labels, labels_report = label_clip(clip, [], report, "walk", ground, LabelOptions())
    mirror = mirror_clip(clip, f"{clip.name}_mirror")
    both = [(clip, labels), (mirror, mirror_labels(labels, labels_report, mirror)[0])]
    return [(c, found) for c, found in both if len(found.cycles)]


def synthetic() -> list[Labelled]:
    """A minute of a walk over slopes."""
    skeleton = load_skeleton(SKELETONS / "holden31.yaml").skeleton.to_dict()
    with tempfile.TemporaryDirectory() as name:
        bvh = Path(name, "slopes.bvh")
        files = {n: Path(name, f"slopes_{n}.txt") for n in ("footsteps", "gait", "status")}
        options = Synthetic()
        write_clip("slopes", skeleton, 3600, "slopes", None, options, bvh=bvh, **files)
        return made(bvh, "rocky")


def seconds(work: Callable[[], object], times: int = 2) -> float:
    """The best of a few runs, processor time."""
    best = np.inf
    for _ in range(times):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def draw(count: int) -> Patches:
    maps = heightmaps(OPTIONS.heightmaps, [], cell=OPTIONS.cell)
    return draw_patches(maps, count=count, **OPTIONS.model_dump(include={"cell", "size", "highest", "seed"}))


def plain_heights(patches: Patches, p: int, points: np.ndarray) -> np.ndarray:
    """One patch at points (N, 2), in float64, by scipy."""
    m = patches.which[p]
    rows, columns = patches.shapes[m]
    cells = patches.heights[patches.maps[1][m] :][: rows * columns].reshape(rows, columns).astype(float)
    at = patches.affine[p].astype(float) @ np.column_stack([points, np.ones(len(points))]).T
    return map_coordinates(cells, at, order=1) - patches.mean[p]


def plain_error(patches: Patches, p: int, footing: search.FootPoints) -> float:
    """The error of one patch on rocky ground, in plain numpy."""
    under = plain_heights(patches, p, footing.down[:, :2])
    over = plain_heights(patches, p, footing.up[:, :2]) - under.mean() - footing.up[:, 2]
    spread = under - under.mean() - footing.down[:, 2]
    return float(0.1 * np.mean(spread**2) + np.mean(np.maximum(over, 0) ** 2))


def footings(clips: list[Labelled], patches: Patches, most: int) -> list[search.FootPoints]:
    """The arguments of the search for the first cycles of the clips."""
    few = replace(patches, which=patches.which[:20], affine=patches.affine[:20], mean=patches.mean[:20])
    caught: list[search.FootPoints] = []
    real = search.best_patches

    def catch(patches: Patches, footing: search.FootPoints, count: int) -> tuple[np.ndarray, np.ndarray]:
        caught.append(footing)
        return real(patches, footing, count)

    search.best_patches = catch
    for clip, labels in clips:
        fit((clip, labels, few, "rocky"))
        if len(caught) >= most:
            break
    search.best_patches = real
    return caught[:most]


def fit(job: tuple[Clip, ClipLabels, Patches, str]) -> tuple[int, float, float]:
    """Cycles of a clip, the worst mean distance of its feet from the ground, and the worst depth below it."""
    clip, labels, patches, ground = job
    arrays = {"contacts": labels.contacts, "cycles": labels.cycles}
    fits = clip_fits(clip, arrays, patches, ground, OPTIONS, SAMPLING)
    return len(fits.patch), float(fits.foot_error[..., 0].max()), float(fits.foot_below.max())


def parts(clips: list[Labelled]) -> None:
    """Time each part, and compare it with plain numpy."""
    count = OPTIONS.patches
    draw(50)
    drawing = seconds(lambda: draw(count), 1)
    patches = draw(count)
    half = patches.size // 2
    grid = np.stack(np.meshgrid(*[np.arange(-half, half)] * 2, indexing="ij"), -1).reshape(-1, 2)
    plain = seconds(lambda: [plain_heights(patches, p, grid).mean() for p in range(0, count, 500)]) * 500
    print(f"{count} patches drawn in {drawing:.1f} s: {count / drawing:,.0f} a second, rejected ones apart")
    print(f"    their means alone, by scipy, would take {plain:.0f} s: {plain / drawing:.0f} times as long")

    cycles = footings(clips, patches, 40)
    for footing in cycles[:1]:
        search.best_patches(patches, footing, 10)
    found = seconds(lambda: [search.best_patches(patches, f, 10) for f in cycles]) / len(cycles)
    some = range(0, count, 200)
    plain = seconds(lambda: [plain_error(patches, p, cycles[0]) for p in some]) * 200
    print(f"search of {count} patches: {1e3 * found:.1f} ms a cycle")
    print(f"    plain numpy: {plain / found:.0f} times as long")
    same = [agreement(patches, f) for f in cycles]
    print(f"    the same ten as plain numpy in float64: {np.mean(same):.1%} of {len(same)} cycles")

    jobs = [(clip, labels, patches, "rocky") for clip, labels in clips][:20]
    fit(jobs[0])
    taken = seconds(lambda: [fit(job) for job in jobs])
    number = sum(len(labels.cycles) for _, labels, *_ in jobs)
    results = [fit(job) for job in jobs]
    print(f"fits: {number / taken:.0f} cycles a second and core, of {number} in {len(jobs)} clips")
    print(
        f"    feet in contact at most {max(r[1] for r in results):.2f} cm from the ground on average,",
        end=" ",
    )
    print(f"no foot more than {max(r[2] for r in results):.2f} cm below it")


def agreement(patches: Patches, footing: search.FootPoints) -> bool:
    """Whether the search finds the ten patches with the lowest errors, or others with equal errors.

    Plain numpy computes the errors of the best forty.
    """
    errors = [plain_error(patches, p, footing) for p in search.best_patches(patches, footing, 40)[0]]
    found = [plain_error(patches, p, footing) for p in search.best_patches(patches, footing, 10)[0]]
    return np.allclose(np.sort(found), np.sort(errors)[:10], rtol=0, atol=1e-5)


def released(clips: list[Labelled], wanted: int, flat: float, workers: int) -> None:
    """Draw the patches and fit this many cycles, a share of them flat, in several processes."""
    start = time.perf_counter()
    patches = draw(OPTIONS.patches)
    jobs, sizes = [], {"flat": 0, "rocky": 0}
    for clip, labels in cycle(clips):
        ground = "flat" if sizes["flat"] < flat * wanted else "rocky"
        jobs.append((clip, labels, patches, ground))
        sizes[ground] += len(labels.cycles)
        if sum(sizes.values()) >= wanted:
            break
    with ProcessPoolExecutor(workers) as pool:
        results = list(pool.map(fit, jobs))
    taken = time.perf_counter() - start
    used = sum(os.times()[:4])  # of this process and of the workers, which have ended
    made_of = f"{sizes['flat']} flat, {sizes['rocky']} rocky, {len(jobs)} clips"
    print(
        f"{sum(r[0] for r in results)} cycles ({made_of}) in {workers} processes: {taken:.0f} s by the clock;"
    )
    print(
        f"    {used:.0f} s of processor time, clips made and labelled included: {used / workers:.0f} s a core"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="BVH files")
    parser.add_argument("--cycles", type=int, help="make and time so many cycles instead")
    parser.add_argument("--flat", type=float, default=0.48, help="share of them on flat ground")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    print(processor_name())
    clips = synthetic()
    if arguments.folder:
        clips = [c for path in sorted(arguments.folder.glob("*.bvh")) for c in made(path, "rocky")]
    print(f"{len(clips)} clips with {sum(len(labels.cycles) for _, labels in clips)} cycles")
    if arguments.cycles:
        released(clips, arguments.cycles, arguments.flat, arguments.workers)
    else:
        parts(clips)


if __name__ == "__main__":
    main()
