"""Check the fitted ground of whole data sets: feet in contact are on it, and no foot is in it.

    python benchmarks/ground.py [DATASET ...] [--mocap FOLDER] [--kinds flat rocky jumpy beam] [--workers 2]

Each clip and its mirror is made, labelled and fitted as in the workflow, on the kind of ground that its data
set names, or with --kinds on these kinds. Prints for each data set and kind: the largest mean distance of
feet in contact from their ground, over a clip (goal: 1 cm) and over a single fit of a cycle; how far the
deepest foot is below the ground (goal: 1 cm); and each clip that misses a goal.
"""

import argparse
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yaml

from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.labels.label import label_clip, mirror_labels
from hobble.motion import ClipMotion
from hobble.motion.edit import mirror_clip
from hobble.motion.make import make_clip
from hobble.synthetic.generate_clip import write_clip
from hobble.terrain import HeightSampling
from hobble.terrain.clip_fits import clip_fits
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.patches import Patches, draw_patches
from hobble.workflow.datasets import plain
from hobble.workflow.project import Project

BASE = Path(__file__).resolve().parents[1]
GOAL = 1.0  # cm


class Job(NamedTuple):
    """One clip of a data set on some kinds of ground. Without kinds: the kind in its entry."""

    dataset: str
    clip: str
    kinds: tuple[str, ...]
    mocap: Path


class Found(NamedTuple):
    """The errors of the fits of a clip on one kind of ground, cm."""

    dataset: str
    clip: str
    kind: str
    cycles: int
    mean: float
    worst_fit: float
    below: float


@cache
def patches_of(dataset: str, mocap: Path) -> Patches:
    """The patches of a data set, drawn once a process."""
    project = Project(BASE, {"mocap": str(mocap)})
    options = project.catalogue.dataset(dataset).terrain
    maps = heightmaps(options.heightmaps, project.dataset(dataset).heightmap_files, cell=options.cell)
    drawn = options.model_dump(include={"cell", "size", "highest", "seed"})
    return draw_patches(maps, count=options.patches, **drawn)


def source(project: Project, job: Job, folder: Path) -> tuple[Path, list[Path]]:
    """The BVH file of a clip and its label files. A synthetic clip is first written to `folder`."""
    if project.catalogue.dataset(job.dataset).synthetic is None:
        files = [Path(file) for file in project.dataset(job.dataset).label_files(job.clip)]
        return Path(project.dataset(job.dataset).source(job.clip)), files
    entry = project.dataset(job.dataset).entry(job.clip)
    skeleton = yaml.safe_load(Path(project.dataset(job.dataset).skeleton_file).read_text())
    name = project.catalogue.dataset(job.dataset).skeleton
    files = {part: folder / f"{job.clip}_{part}.txt" for part in ("footsteps", "gait")}
    bvh, frames = folder / f"{job.clip}.bvh", project.dataset(job.dataset).frames(job.clip)
    options = project.catalogue.dataset(job.dataset).synthetic
    write_clip(job.clip, {"name": name, **skeleton}, frames, entry.recipe, options, bvh=bvh, **files)
    return bvh, [files["footsteps"], files["gait"]]


def made(project: Project, job: Job, folder: Path) -> Iterator[tuple[Clip, dict]]:
    """The clip and its mirror, if the data set has mirrors, with their labels."""
    bvh, files = source(project, job, folder)
    entry, dataset = project.dataset(job.dataset).entry(job.clip), project.catalogue.dataset(job.dataset)
    clip, report = make_clip(
        bvh,
        project.dataset(job.dataset).skeleton_file,
        str(BASE / "config/skeletons"),
        clip=job.clip,
        skeleton_name=dataset.skeleton,
        options=ClipMotion(**project.dataset(job.dataset).motion_options(job.clip)),
    )
    options = dataset.labels
    labels, labels_report = label_clip(clip, files, report, entry.gait, entry.ground, options)
    yield clip, vars(labels)
    if dataset.mirror:
        mirror = mirror_clip(clip, f"{job.clip}_mirror")
        yield mirror, vars(mirror_labels(labels, labels_report, mirror)[0])


def found(job: Job) -> list[Found]:
    """The fits of one clip and its mirror."""
    project = Project(BASE, {"mocap": str(job.mocap)})
    options = project.catalogue.dataset(job.dataset).terrain
    sampling = HeightSampling(
        **plain(project.dataset(job.dataset).settings, "database", HeightSampling.model_fields)
    )
    out = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            pairs = list(made(project, job, Path(folder)))
        except HobbleError as error:
            print(f"{job.dataset} {job.clip} left out: {error}", flush=True)
            return []
    for clip, labels in pairs:
        for kind in job.kinds or (project.dataset(job.dataset).entry(job.clip).ground,):
            fits = clip_fits(clip, labels, patches_of(job.dataset, job.mocap), kind, options, sampling)
            if not len(fits.patch):
                continue
            means = fits.foot_error[..., 0]
            numbers = float(means.mean()), float(means.max()), float(fits.foot_below.max())
            out.append(Found(job.dataset, clip.name, kind, len(means), *numbers))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("datasets", nargs="*", default=["synthetic"], metavar="DATASET")
    parser.add_argument("--mocap", type=Path, default=BASE / "data")
    parser.add_argument("--kinds", nargs="*", default=[], choices=["flat", "rocky", "jumpy", "beam"])
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    project = Project(BASE, {"mocap": str(arguments.mocap)})
    jobs = [
        Job(d, clip, tuple(arguments.kinds), arguments.mocap)
        for d in arguments.datasets
        for clip in project.dataset(d).entries
    ]
    with ProcessPoolExecutor(arguments.workers) as pool:
        results = [one for some in pool.map(found, jobs) for one in some]
    print("data set      ground  clips  cycles   worst mean of a clip   of a fit   deepest below")
    for dataset, kind in sorted({(r.dataset, r.kind) for r in results}):
        some = [r for r in results if (r.dataset, r.kind) == (dataset, kind)]
        cycles = sum(r.cycles for r in some)
        worst = [max(getattr(r, name) for r in some) for name in ("mean", "worst_fit", "below")]
        print(f"{dataset:<13} {kind:<7} {len(some):5} {cycles:7}", end=" ")
        print(f"{worst[0]:18.2f} cm {worst[1]:7.2f} cm {worst[2]:12.2f} cm")
    for r in results:
        if r.mean > GOAL or r.worst_fit > GOAL or r.below > GOAL + 1e-3:
            print(f"missed: {r.dataset} {r.clip} {r.kind}: {r.mean:.3f}, {r.worst_fit:.3f}, {r.below:.3f}")


if __name__ == "__main__":
    main()
