"""Tells the rules which inputs a measurement has, and on which keys of the configuration it depends.

A long measurement is split into pieces, each of which is a job of its own.
"""

from __future__ import annotations

from typing import Any

from hobble.measures.measure import all_measures, measure_named
from hobble.runtime.options import Runtime
from hobble.workflow.clips import Clips, original
from hobble.workflow.configurations import Configurations
from hobble.workflow.package import Package

OF_CLIPS = ("clips", "summaries")  # inputs with a file for each clip
NAMES = tuple(each.name for each in all_measures())  # the names of all measurements


def piece_file(configuration: str, name: str, piece: str) -> str:
    """Path of the JSON file with the result of one piece of the measurement `name`."""
    return f"results/{configuration}/evaluation/pieces/{name}/{piece}.json"


def result_file(configuration: str, name: str) -> str:
    """Path of the JSON file with the result of the measurement `name`."""
    return f"results/{configuration}/evaluation/{name}.json"


class Measurements:
    """The measurements of a project's configurations.

    Arguments of the methods: configuration: name of a configuration. name: name of a measurement.
    """

    def __init__(self, configurations: Configurations, clips: Clips, package: Package) -> None:
        self.configurations, self.clips, self.package = configurations, clips, package

    def result_files(self, configuration: str) -> list[str]:
        """Paths of the JSON files of all measurements that are made for the configuration."""
        channels = ("", *self.configurations.channels(configuration))
        return [result_file(configuration, one.name) for one in all_measures() if one.channel in channels]

    def shown_modules(self) -> list[str]:
        """Full names of the modules that show and compare measurements."""
        return [one.module for one in all_measures()]

    def inputs(self, configuration: str, name: str) -> dict[str, str | list[str]]:
        """Name of each input of the measurement -> its file; `batches` -> the folders with rows of clips."""
        wanted = measure_named(name).inputs
        files: dict[str, str | list[str]] = {
            item: self._input(configuration, item) for item in wanted if item not in OF_CLIPS
        }
        if set(OF_CLIPS) & set(wanted):
            files["batches"] = self.configurations.batch_folders(configuration, "database")
        return files

    def pieces(self, configuration: str, name: str) -> list[str]:
        """Paths of the JSON files of the measurement's pieces; [] if there are fewer than two pieces."""
        chosen = measure_named(name)
        if chosen.pieces is None:
            return []
        options = chosen.options.model_validate(self.options(configuration, name))
        runtime = Runtime.model_validate(self.runtime(configuration, name))
        pieces = chosen.pieces(options, runtime, self.configurations.network_options(configuration).modes)
        return [piece_file(configuration, name, piece) for piece in pieces] if len(pieces) > 1 else []

    def _input(self, configuration: str, item: str) -> str:
        """The file of one input.

        item: the input's name. If it is the name of another measurement, the input is this one's result.
        """
        configurations = self.configurations
        if item == "weights":
            return configurations.network(configuration, "weights.npz")
        if item == "skeleton":
            return self.clips.skeleton_file(configurations.dataset(configuration))
        if item == "published":
            return self.package.published_file()
        return result_file(configuration, measure_named(item).name)

    def splits(self, configuration: str, name: str) -> dict[str, str]:
        """Clip -> "train" or "held_out"; {} if the measurement does not read clips."""
        return self.configurations.splits(configuration) if "clips" in measure_named(name).inputs else {}

    def summaries(self, configuration: str, name: str) -> list[str]:
        """The clips whose summaries of rows the measurement reads."""
        return (
            list(self.configurations.splits(configuration))
            if "summaries" in measure_named(name).inputs
            else []
        )

    def people(self, configuration: str, name: str) -> dict[str, str]:
        """Clip -> the person who walks in it; {} if the measurement does not need this.

        If the data set does not name the person in a clip, the clip's name stands for one more person. The
        mirror and the hurt versions of a clip have the clip's person.
        """
        if not measure_named(name).people:
            return {}
        dataset = self.configurations.dataset(configuration)
        splits = self.configurations.splits(configuration)
        return {clip: self.clips.entry(dataset, clip).person or original(clip) for clip in splits}

    def options(self, configuration: str, name: str) -> dict[str, Any]:
        """Key -> value of the section `evaluation`, for the keys that the measurement uses."""
        keys = measure_named(name).options.model_fields
        return self.configurations.section(configuration, "evaluation", *keys) if keys else {}

    def runtime(self, configuration: str, name: str) -> dict[str, Any]:
        """Key -> value of the section `runtime`, for the keys that the measurement uses."""
        keys = measure_named(name).runtime
        return self.configurations.section(configuration, "runtime", *keys) if keys else {}

    def module_of(self, name: str) -> str:
        """Full name of the Python module that holds the measurement."""
        return measure_named(name).module

    def code(self, name: str, *modules: str, script: str = "measure") -> str:
        """Hash of the code of the measurement `name`.

        modules: full names of modules that the code imports dynamically. script: name of the rule's script,
        without .py.
        """
        return self.package.code(script, measure_named(name).run_module, *modules)
