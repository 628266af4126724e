"""What the rules ask: which clips there are, where files lie, which part of the configuration counts."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from hobble.config.load import Catalogue
from hobble.config.models import ClipEntry, Configuration, Dataset, hurts
from hobble.config.sections import COMPARED
from hobble.core.clip_files import NAMES, can_be_called, find_clips, the_file
from hobble.core.errors import HobbleError, InputError
from hobble.core.untrusted import MOST_TEXT, read_bytes
from hobble.workflow.fingerprint import fingerprint
from hobble.workflow.sources import joint_names, nearest_rig, read_checksums
from hobble.workflow.targets import COMPARE, check

DATASETS = "results/datasets"
MIRROR = "_mirror"
LABEL_FILES = (".phase", ".gait", "_footsteps.txt", "_gait.txt")
STAGES = ("synthetic", "motion", "labels", "injury", "terrain", "database")
RESERVED = (COMPARE, "datasets")  # folders of results/ that belong to no configuration
# What a comparison reads of each configuration, under results/<configuration>/.
MEASURED = {
    "configuration": "configuration.yaml",
    "accuracy": "evaluation/accuracy.json",
    "rollouts": "evaluation/rollouts.json",
    "responsivity": "evaluation/responsivity.json",
    "injury": "evaluation/injury.json",
    "recognition": "evaluation/recognition.json",
    "pipeline": "pipeline.json",
}


class Project:
    """The configuration folder of one checkout, with the overrides of one command line.

    base: the folder of the Snakefile. config: Snakemake's config; `mocap` is the folder with the
    user's clips, `compare` the configurations to set side by side, every other key goes on top of each
    configuration. Raises HobbleError where a configuration has the name of a folder of results/.
    """

    def __init__(self, base: Path, config: Mapping[str, Any]) -> None:
        self.base = base
        self.mocap = Path(config.get("mocap", base / "data"))
        self._compare = config.get(COMPARE, list(COMPARED))
        overrides = {key: value for key, value in config.items() if key not in ("mocap", COMPARE)}
        self.catalogue = Catalogue(base / "config", overrides)
        for name in set(RESERVED) & set(self.catalogue.names()):
            raise HobbleError(f"no configuration can be called {name}: results/{name} is another folder")

    # Configurations and what they name

    def configuration(self, name: str) -> Configuration:
        """The resolved configuration `name`."""
        return self.catalogue.configuration(name)

    def dataset(self, name: str) -> Dataset:
        """The resolved data set `name`."""
        return self.catalogue.dataset(name)

    def options(self, dataset: str, section: str) -> dict[str, Any]:
        """Plain values of one section of a data set."""
        return getattr(self.dataset(dataset), section).model_dump(mode="json")

    def section(self, configuration: str, name: str) -> dict[str, Any]:
        """Plain values of one section of a configuration."""
        return getattr(self.configuration(configuration), name).model_dump(mode="json")

    def evaluation(self, configuration: str, *keys: str) -> dict[str, Any]:
        """Those keys of the section `evaluation` on which one measurement depends."""
        section = self.section(configuration, "evaluation")
        return {key: section[key] for key in keys}

    def resolved(self, configuration: str) -> dict[str, Any]:
        """Everything that determines a configuration's results, as plain data."""
        model = self.configuration(configuration)
        return {
            "name": configuration,
            "configuration": model.model_dump(mode="json"),
            "dataset": {"name": model.dataset, **self.dataset(model.dataset).model_dump(mode="json")},
        }

    def check(self, targets: Iterable[str]) -> None:
        """Validate every configuration, data set and skeleton that the targets on the command line need.

        Raises HobbleError, so that a mistake is told before the DAG is built.
        """
        check(self, targets)

    def digest(self, configuration: str) -> str:
        """A short name for all that `resolved` says, so that a dry run does not print it."""
        text = json.dumps(self.resolved(configuration), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    # Clips

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def clips(self, dataset: str) -> dict[str, ClipEntry]:
        """The clips of a data set by name, without mirrors. Raises HobbleError where there are none."""
        listed = self.dataset(dataset).clips or dict.fromkeys(self._scanned(dataset))
        if odd := [name for name in listed if name.endswith(MIRROR)]:
            raise HobbleError(
                f"data set {dataset}: {', '.join(odd)}: only a mirror is called so, which `mirror: true` "
                "makes from its original. Take it out, or rename its file."
            )
        return {name: entry or ClipEntry() for name, entry in listed.items()}

    def _scanned(self, dataset: str) -> list[str]:
        """The clips in the user's folder, but for mirrors that are made anew from originals beside them."""
        folder, files = self.folder(dataset), self._files(dataset)
        for name in sorted(files):
            _check_name(folder, name)
            the_file(name, files[name])
        if not files:
            raise InputError(folder, "no .bvh files here", fix="Put clips there.")
        made = {name + MIRROR for name in files} if self.dataset(dataset).mirror else set()
        return sorted(set(files) - made)

    def folder(self, dataset: str) -> Path:
        """Where the data set's own source files lie.

        Raises InputError where a user's folder is missing, unless its clips can be downloaded.
        """
        model = self.dataset(dataset)
        if model.synthetic is not None:
            return Path(DATASETS, model.source or dataset, "synthetic")
        path = self.mocap / (model.folder or "")
        if model.download is not None and not path.exists():
            return path
        if not path.is_dir():
            raise InputError(
                path,
                f"no such folder, but data set {dataset} reads its clips there",
                fix="Put the clips there, or name the folder that holds it with --config mocap=FOLDER.",
            )
        if not os.access(path, os.R_OK | os.X_OK):
            raise InputError(path, "no permission to read this folder", fix="Check who owns it.")
        return path

    def entry(self, dataset: str, clip: str) -> ClipEntry:
        """What the data set says of a clip or of the original of a mirror."""
        clips = self.clips(dataset)
        name = clip.removesuffix(MIRROR)
        if name not in clips:
            raise HobbleError(f"data set {dataset} has no clip {name!r}; it has: {', '.join(clips)}")
        return clips[name]

    def source(self, dataset: str, clip: str) -> str:
        """Path of the clip's BVH file."""
        self.entry(dataset, clip)
        if self.dataset(dataset).synthetic is not None:
            return str(self.folder(dataset) / f"{clip}.bvh")
        if clip in (files := self._files(dataset)):
            return str(the_file(clip, files[clip]))
        if clip in (known := self._checksums(dataset)):
            return self.downloaded(self.dataset(dataset).source or dataset, clip)
        path = self.folder(dataset) / f"{clip}.bvh"
        nor = f", and {self._manifest(dataset)} has none to download" if known else ""
        raise InputError(path, f"no such file, but data set {dataset} lists this clip{nor}")

    def downloaded(self, dataset: str, clip: str) -> str:
        """Where a clip of a data set is kept that is downloaded."""
        return str(self.base / "data" / "downloaded" / dataset / f"{clip}.bvh")

    def download(self, dataset: str, clip: str) -> dict[str, str]:
        """What fetches a clip: its `url`, the `sha256` that it must have, the `folder` that lacks it."""
        if (options := self.dataset(dataset).download) is None or clip not in self._checksums(dataset):
            raise HobbleError(f"data set {dataset}: clip {clip} cannot be downloaded")
        return {
            "url": options.url.format(clip=quote(clip), subject=quote(clip.partition("_")[0])),
            "sha256": self._checksums(dataset)[clip],
            "folder": str(self.mocap / (self.dataset(dataset).folder or "")),
        }

    def _manifest(self, dataset: str) -> Path:
        options = self.dataset(dataset).download
        return self.base / "config" / "datasets" / (options.checksums if options else "")

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def _checksums(self, dataset: str) -> dict[str, str]:
        return read_checksums(self._manifest(dataset)) if self.dataset(dataset).download else {}

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def _files(self, dataset: str) -> dict[str, list[Path]]:
        """The BVH files in the user's folder by clip."""
        folder = self.folder(dataset)
        return find_clips(folder) if folder.is_dir() else {}

    def _stem(self, dataset: str, clip: str) -> Path:
        """What the names of the files beside a clip begin with."""
        if self.dataset(dataset).synthetic is None and clip in (files := self._files(dataset)):
            return files[clip][0].with_suffix("")
        return self.folder(dataset) / clip

    def label_files(self, dataset: str, clip: str) -> list[str]:
        """Hand-made label files beside the clip."""
        stem = self._stem(dataset, clip)
        if self.dataset(dataset).synthetic is not None:
            return [f"{stem}_footsteps.txt", f"{stem}_gait.txt"]
        files = [f"{stem}{suffix}" for suffix in LABEL_FILES]
        return [f for f in files if Path(f).is_file()] if self.dataset(dataset).labels.files else []

    def status_files(self, dataset: str, clip: str) -> list[str]:
        """The status file beside the clip, if there is one and the data set gives no status of its own."""
        path = f"{self._stem(dataset, clip)}_injuries.txt"
        if self.dataset(dataset).synthetic is not None:
            return [path]
        return [path] if Path(path).is_file() and not self.entry(dataset, clip).status else []

    def is_injured(self, dataset: str, clip: str) -> bool:
        """Whether anything hurts in the clip, by the configuration or by its status file."""
        if self.entry(dataset, clip).is_injured:
            return True
        if self.dataset(dataset).synthetic is not None:
            return False
        return any(
            hurts(read_bytes(file, MOST_TEXT).decode("latin-1")) for file in self.status_files(dataset, clip)
        )

    def selected(self, dataset: str, selection: str) -> dict[str, str]:
        """Clip -> "train" or "held_out", of the `healthy` or of `all` clips; mirrors go with originals."""
        model = self.dataset(dataset)
        held_out = set(model.held_out)
        missing = held_out - set(self.clips(dataset))
        if missing:
            raise HobbleError(f"data set {dataset}: held_out names no clip: {', '.join(sorted(missing))}")
        splits = {}
        for clip in self.clips(dataset):
            if selection == "healthy" and self.is_injured(dataset, clip):
                continue
            for name in (clip, clip + MIRROR) if model.mirror else (clip,):
                splits[name] = "held_out" if clip in held_out else "train"
        if "train" not in splits.values():
            kind = "healthy clip" if selection == "healthy" else "clip"
            raise HobbleError(f"data set {dataset}: no {kind} is left to train on")
        return splits

    def frames(self, dataset: str, clip: str) -> int:
        """Synthetic clips: the frames at 60 Hz that fall to this one."""
        synthetic = self.dataset(dataset).synthetic
        assert synthetic is not None
        total = sum(entry.share for entry in self.clips(dataset).values())
        return round(synthetic.frames * self.entry(dataset, clip).share / total)

    def motion_options(self, dataset: str, clip: str) -> dict[str, Any]:
        """The motion section, with what the clip's entry overrules, and the ground that the clip is on."""
        keys = {"source_fps", "loops", "heading", "ground"}
        entry = self.entry(dataset, clip).model_dump(include=keys, exclude_none=True)
        return {**self.options(dataset, "motion"), **entry}

    # What a configuration is made from

    def selection(self, configuration: str) -> str:
        """Which clips it trains on: `healthy`, or `all` with severities as inputs."""
        return "all" if self.configuration(configuration).injury else "healthy"

    def splits(self, configuration: str) -> dict[str, str]:
        """Clip -> split."""
        dataset = self.configuration(configuration).dataset
        return self.selected(dataset, self.selection(configuration))

    def of_dataset(self, configuration: str, pattern: str) -> list[str]:
        """`pattern` (with {clip} in it, or not) under the configuration's data set, for each of its clips."""
        root = f"{DATASETS}/{self.configuration(configuration).dataset}"
        if "{clip}" not in pattern:
            return [f"{root}/{pattern}"]
        return [f"{root}/{pattern.format(clip=clip)}" for clip in self.splits(configuration)]

    def network(self, configuration: str, file: str) -> str:
        """A file of the configuration's network, or of the network it reads."""
        owner = self.configuration(configuration).network_of or configuration
        return f"results/{owner}/network/{file}"

    def database(self, configuration: str) -> str:
        """The database that the configuration learns from."""
        dataset = self.configuration(configuration).dataset
        return f"{DATASETS}/{dataset}/database/{self.selection(configuration)}"

    def start(self, configuration: str) -> list[str]:
        """The checkpoint that training goes on from, if it continues another configuration's."""
        other = self.configuration(configuration).training.continues
        return [f"results/{other}/network/checkpoint.npz"] if other else []

    # What is compared

    def compared(self) -> list[str]:
        """The configurations to set side by side, as `--config compare='[holden,injured]'` names them.

        Raises HobbleError for anything but names, each once.
        """
        names = self._compare.split(",") if isinstance(self._compare, str) else self._compare
        if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
            raise HobbleError(f"compare: a list of configurations, as in '[holden,injured]', not {names!r}")
        if not names or len(set(names)) < len(names):
            raise HobbleError(
                f"compare: each configuration once, one or more, not {', '.join(names) or 'none'}"
            )
        return list(names)

    def measured(self) -> dict[str, list[str]]:
        """Kind of file -> that of each configuration compared."""
        names = self.compared()
        out = {kind: [f"results/{name}/{file}" for name in names] for kind, file in MEASURED.items()}
        return out | {"history": [self.network(name, "history.csv") for name in names]}

    def heightmap_files(self, dataset: str) -> list[str]:
        """Heightmaps that are files, in the order of the configuration."""
        maps = self.dataset(dataset).terrain.heightmaps
        return [str(self.mocap / m.path) for m in maps if m.path]

    def templates(self) -> list[str]:
        """The page's templates; a change in one re-makes only the reports."""
        folder = self.base / "src" / "hobble" / "report"
        files = [str(p) for p in folder.iterdir() if p.suffix in {".j2", ".css", ".yaml"}]
        return sorted([*files, self.published()])

    def web(self, suffix: str) -> list[str]:
        """The page's scripts (".js"), or what says which packages they need (".json")."""
        package = self.base / "src" / "hobble"
        files = [*(package / "report" / "web").iterdir(), *package.glob("models/*/*.js")]
        return sorted(str(p) for p in files if p.suffix == suffix)

    def published(self) -> str:
        """The file of published figures that stand beside ours."""
        return str(self.base / "src" / "hobble" / "evaluation" / "published.yaml")

    def skeleton_file(self, dataset: str) -> str:
        """Path of the data set's skeleton."""
        return str(self.base / "config" / "skeletons" / f"{self.dataset(dataset).skeleton}.yaml")

    def rig_files(self, dataset: str, clip: str) -> list[str]:
        """The skeleton file of the rig that the clip is on, where that is another than the data set's."""
        model, folder = self.dataset(dataset), self.base / "config" / "skeletons"
        if model.synthetic is not None:
            name: str | None = self.dataset(model.source or dataset).skeleton
        else:
            known = {path.stem: self.catalogue.skeleton(path.stem).joints for path in folder.glob("*.yaml")}
            name = nearest_rig(joint_names(Path(self.source(dataset, clip))), known, model.skeleton)
        return [str(folder / f"{name}.yaml")] if name not in (None, model.skeleton) else []

    def stages(self, configuration: str) -> dict[str, dict[str, list[str]]]:
        """For the account of costs: the benchmark files and the artefacts of each stage."""
        model = self.configuration(configuration)
        root = Path(DATASETS, model.dataset)
        source = Path(DATASETS, self.dataset(model.dataset).source or model.dataset)
        owner = Path("results", model.network_of or configuration)
        own = Path("results", configuration)
        out = {}
        for stage in STAGES:
            home = source if stage == "synthetic" else root
            out[stage] = {"benchmarks": [str(home / "benchmarks" / stage)], "files": [str(home / stage)]}
        out["database"]["files"] = [str(root / "database/clips"), self.database(configuration)]
        for stage, home, folder in (
            ("training", owner, "network"),
            ("runtime", own, "runtime"),
            ("evaluation", own, "evaluation"),
        ):
            out[stage] = {"benchmarks": [str(home / "benchmarks" / stage)], "files": [str(home / folder)]}
        return out

    def code(self, script: str) -> str:
        """Fingerprint of a rule's script and of all it imports from the package."""
        return fingerprint(self.base / "workflow" / "scripts" / f"{script}.py", self.base / "src")


def _check_name(folder: Path, clip: str) -> None:
    if not can_be_called(clip):
        raise InputError(folder, f"a clip is called {clip!a:.80}", fix=f"Rename it: {NAMES}.")
