"""Folders of each stage's benchmark files and artefacts, for the summary of time, memory and disk."""

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

Places = dict[str, list[str]]  # "benchmarks", "files", "batches" or "made" -> paths or names, see `stages`


def stages(configurations: Configurations, batches: Batches, name: str) -> dict[str, Places]:
    """Stage -> where to find its costs, for the configuration `name`.

    benchmarks: folders of benchmark files. files: folders of artefacts. batches: names of the benchmark files
    of the present batches; the folders may also have old files, from before a clip was added. made: folders
    in which finished clips are kept.
    """
    dataset = configurations.dataset(name)
    source = configurations.catalogue.dataset(dataset).source or dataset
    out = {
        stage: _of_dataset(batches, source if stage == "synthetic" else dataset, stage)
        for stage in DATASET_STAGES
    }
    out["database"]["files"] = [f"{DATASETS}/{dataset}/database/clips", configurations.database(name)]
    results = Path("results", name)
    out["training"] = _places(Path("results", configurations.owner(name)), "training", "network")
    out["runtime"] = _places(results, "runtime", "runtime")
    out["evaluation"] = _places(results, "evaluation", "evaluation")
    return out


def _of_dataset(batches: Batches, dataset: str, stage: str) -> Places:
    root = Path(DATASETS, dataset)
    return {
        **_places(root, stage, stage),
        "batches": [batch.label for batch in batches.all_of(dataset)],
        "made": [str(root / FOLDER / rule) for rule in BATCH_RULES[stage]],
    }


def _places(home: Path, stage: str, folder: str) -> Places:
    return {"benchmarks": [str(home / "benchmarks" / stage)], "files": [str(home / folder)]}
