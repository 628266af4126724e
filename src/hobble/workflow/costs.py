"""Lists the folders that tell how much time, memory and disk each stage of the workflow takes.

A benchmark file is where Snakemake writes the time and the memory of a job. An artefact is a file that a
stage makes.
"""

from __future__ import annotations

from pathlib import Path

from hobble.workflow.clip_batches import Batches
from hobble.workflow.clips import DATASETS
from hobble.workflow.configurations import Configurations
from hobble.workflow.kept_files import FOLDER

# Stage of a data set -> its rules that have a job for each batch of clips.
BATCH_RULES = {
    "synthetic": ("synthetic_clips",),
    "motion": ("motion_clips", "hurt_clips"),
    "labels": ("labels_clips",),
    "channels": ("channel_clips",),
    "terrain": ("terrain_fits",),
    "database": ("database_clips",),
}
DATASET_STAGES = tuple(BATCH_RULES)

# Where to find the costs of a stage: the keys "benchmarks", "files", "batches" and "made", see `stages`.
Places = dict[str, list[str]]


def stages(configurations: Configurations, batches: Batches, name: str) -> dict[str, Places]:
    """Name of each stage -> where to find its costs, for the configuration `name`.

    benchmarks: folders of benchmark files. files: folders of artefacts. Stages of a data set have two more
    keys. batches: names, without suffix, of the benchmark files of the present batches. (The folders may also
    hold old benchmark files, from before a clip was added.) made: folders in which `KeptFiles` keeps finished
    files and the seconds that they took.
    """
    dataset = configurations.dataset(name)
    source = configurations.catalogue.dataset(dataset).source or dataset
    out = {
        stage: _places_in_dataset(batches, source if stage == "synthetic" else dataset, stage)
        for stage in DATASET_STAGES
    }
    out["database"]["files"] = [f"{DATASETS}/{dataset}/database/clips", configurations.database(name)]
    results = Path("results", name)
    out["training"] = _places(Path("results", configurations.network_owner(name)), "training", "network")
    out["runtime"] = _places(results, "runtime", "runtime")
    out["evaluation"] = _places(results, "evaluation", "evaluation")
    return out


def _places_in_dataset(batches: Batches, dataset: str, stage: str) -> Places:
    root = Path(DATASETS, dataset)
    return {
        **_places(root, stage, stage),
        "batches": [batch.label for batch in batches.of_clips_and_hurt_versions(dataset)],
        "made": [str(root / FOLDER / rule) for rule in BATCH_RULES[stage]],
    }


def _places(home: Path, stage: str, folder: str) -> Places:
    """home: the folder of the configuration or data set. folder: the name of the stage's folder in it."""
    return {"benchmarks": [str(home / "benchmarks" / stage)], "files": [str(home / folder)]}
