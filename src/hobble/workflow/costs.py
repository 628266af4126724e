"""Folders of each stage's benchmark files and artefacts, for the summary of time, memory and disk."""

from __future__ import annotations

from pathlib import Path

from hobble.workflow.clips import DATASETS
from hobble.workflow.configurations import Configurations

DATASET_STAGES = ("synthetic", "motion", "labels", "channels", "terrain", "database")

Places = dict[str, list[str]]


def stages(configurations: Configurations, name: str) -> dict[str, Places]:
    """Stage -> folders of its "benchmarks" and its "files", for configuration `name`."""
    dataset = configurations.dataset(name)
    root, own = Path(DATASETS, dataset), Path("results", name)
    source = Path(DATASETS, configurations.catalogue.dataset(dataset).source or dataset)
    out = {stage: _places(root, stage, stage) for stage in DATASET_STAGES}
    out["synthetic"] = _places(source, "synthetic", "synthetic")
    out["database"]["files"] = [str(root / "database/clips"), configurations.database(name)]
    out["training"] = _places(Path("results", configurations.owner(name)), "training", "network")
    out["runtime"] = _places(own, "runtime", "runtime")
    out["evaluation"] = _places(own, "evaluation", "evaluation")
    return out


def _places(home: Path, stage: str, folder: str) -> Places:
    return {"benchmarks": [str(home / "benchmarks" / stage)], "files": [str(home / folder)]}
