"""Reads YAML files and command-line overrides into validated models. Errors name the file and the key."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from hobble.config.models import Configuration, Dataset, SkeletonFile, configuration_of
from hobble.core import untrusted
from hobble.core.errors import HobbleError, InputError
from hobble.models import DEFAULT, MODELS

Model = TypeVar("Model", bound=BaseModel)
# Names that cannot lead out of their folder and are not too long for a file name.
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
MOST_PROBLEMS = 20  # a message lists at most this many problems of a configuration, data set or skeleton
# What YAML makes of on, 02_01, 1e5 and 2020-01-01 without quotes.
NOT_STRINGS = (bool, int, float, date)
QUOTES_HINT = 'Put the name in quotes, as in "02_01"; otherwise YAML reads it as a number or a date.'
NAME_HINT = "Names may have letters, digits, dots, dashes and underscores, 100 at most."


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Put `over` on top of `base`: mappings are merged recursively, everything else is replaced.

    If `over` chooses another kind of network, its section `network` replaces the whole section of `base`,
    because each kind has its own keys.
    """
    out = copy.deepcopy(dict(base))
    for key, value in over.items():
        mergeable = isinstance(value, Mapping) and isinstance(out.get(key), Mapping)
        if mergeable and key == "network" and _kind(value, out[key]) != _kind(out[key]):
            mergeable = False
        out[key] = merge(out[key], value) if mergeable else copy.deepcopy(value)
    return out


def _kind(network: Mapping[str, Any], below: Mapping[str, Any] | None = None) -> Any:
    """The kind in a section `network`. If it has none: the kind in the section `below`, or else DEFAULT."""
    return network.get("kind", _kind(below) if below is not None else DEFAULT)


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping. Raises InputError; if a line does not parse, with its number."""
    if not path.is_file():
        there = ", ".join(sorted(p.stem for p in path.parent.glob("*.yaml"))) or "none"
        raise InputError(path, "no such file", fix=f"There are: {there}.")
    data = untrusted.read_yaml(path)
    if data is None:
        return {}
    if not isinstance(data, dict):
        raise InputError(path, "must hold keys and values")
    return data


def read_layers(folder: Path, name: str, within: tuple[str, ...] = ()) -> tuple[dict[str, Any], list[Path]]:
    """The values of `<folder>/<name>.yaml` merged over those of the file that it `extends`.

    Also returns the files that were read. within: names of the configurations whose `training: NAME` led to
    this one, to find a loop of such references.
    """
    files: list[Path] = []
    chain: list[dict[str, Any]] = []
    next_name: str | None = name
    while next_name is not None:
        if not isinstance(next_name, str) or not NAME.fullmatch(next_name):
            where = files[-1] if files else folder
            raise InputError(where, f"{next_name!r:.80} is not a name", fix=NAME_HINT)
        path = folder / f"{next_name}.yaml"
        if path in files:
            raise InputError(path, f"extends itself through {' -> '.join(p.stem for p in files)}")
        files.append(path)
        chain.append(read_yaml(path))
        next_name = chain[-1].get("extends")
    merged: dict[str, Any] = {}
    for values in reversed(chain):
        merged = with_training(folder, merge(merged, values), (*within, name))
    return merged, files


def with_training(folder: Path, values: dict[str, Any], within: tuple[str, ...] = ()) -> dict[str, Any]:
    """Replace `training: NAME` in `values` by the training section of configuration NAME.

    within: names of the configurations that led to this section; see `read_layers`.
    """
    name = values.get("training")
    if not isinstance(name, str):
        return values
    if within and not NAME.fullmatch(name):
        raise InputError(
            folder / f"{within[-1]}.yaml", f"training: {name!r:.80} is not a name", fix=NAME_HINT
        )
    if name in within:
        raise InputError(folder / f"{name}.yaml", f"`training: {name}` refers to itself")
    return {**values, "training": read_layers(folder, name, within)[0].get("training", {})}


def validate(model: type[Model], values: Mapping[str, Any], where: str) -> Model:
    """Validate `values`. Raises one HobbleError that lists the problems as `where: key: what is allowed`."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        found = error.errors()
        lines = [f"{where}: {_problem(item, model)}" for item in found[:MOST_PROBLEMS]]
        if len(found) > MOST_PROBLEMS:
            lines.append(f"{where}: and {len(found) - MOST_PROBLEMS} more problems.")
        raise HobbleError("\n".join(lines)) from None


def _problem(item: Any, model: type[BaseModel]) -> str:
    """The message for one of pydantic's errors: the key and what is allowed."""
    key = ".".join(str(part) for part in item["loc"]) or "(whole file)"
    if item["type"] == "extra_forbidden":
        allowed = ", ".join(_keys_at(model, item["loc"][:-1])) or "none"
        return f"{key}: there is no such key. Allowed here: {allowed}."
    message = item["msg"].removeprefix("Value error, ")
    of_a_section = isinstance(item["input"], Mapping)
    if item["type"] == "value_error" and of_a_section:  # a section's own message needs no `not ...`
        return f"{key}: {message}." if item["loc"] else f"{message}."
    text = f"{key}: {message[0].lower()}{message[1:]}, not {item['input']!r:.80}."
    if item["type"] == "string_type" and isinstance(item["input"], NOT_STRINGS):
        text += f" {QUOTES_HINT}"
    return text


def _keys_at(model: Any, location: tuple[Any, ...]) -> list[str]:
    """The keys that a model allows in the section at a location, which is a path of keys and indices."""
    for part in location:
        field = getattr(model, "model_fields", {}).get(part)
        if field is not None:
            model = field.annotation
        arguments = [model, *getattr(model, "__args__", ())]
        arguments += [inner for a in arguments for inner in getattr(a, "__args__", ())]
        model = next((a for a in arguments if isinstance(a, type) and issubclass(a, BaseModel)), model)
    return list(getattr(model, "model_fields", {}))


class Catalogue:
    """The configurations, data sets and skeletons under config/, each read and validated when first needed.

    overrides: values from the command line, merged over every configuration.
    """

    def __init__(self, folder: Path, overrides: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self.overrides = dict(overrides or {})
        self._cache: dict[tuple[str, str], Any] = {}

    def names(self) -> list[str]:
        """Names of all configurations."""
        return sorted(path.stem for path in self.folder.glob("*.yaml"))

    def configuration(self, name: str) -> Configuration:
        """The configuration `name`, with everything it extends."""
        return self._get("configuration", name, self.folder, Configuration, self.overrides)

    @staticmethod
    def _model_for(model: type[Model], values: Mapping[str, Any], where: str) -> type[Model]:
        """The model to validate with. For a configuration it depends on the kind of network."""
        network = values.get("network")
        if model is not Configuration or not isinstance(network, Mapping):
            return model
        kind = _kind(network)
        if kind not in MODELS:
            kinds = ", ".join(MODELS)
            raise HobbleError(f"{where}: network.kind: there is no kind {kind!r:.40}, only {kinds}.")
        return configuration_of(kind)  # type: ignore[return-value]

    def dataset(self, name: str) -> Dataset:
        """The data set `name`, with everything it extends."""
        return self._get("dataset", name, self.folder / "datasets", Dataset, {})

    def skeleton(self, name: str) -> SkeletonFile:
        """The skeleton `name`."""
        return self._get("skeleton", name, self.folder / "skeletons", SkeletonFile, {})

    def _get(self, kind: str, name: str, folder: Path, model: type[Model], over: Mapping[str, Any]) -> Model:
        if (kind, name) not in self._cache:
            values, files = read_layers(folder, name)
            where = " < ".join(str(path) for path in files)
            if over:
                values, where = with_training(folder, merge(values, over)), f"{where} < --config"
            self._cache[kind, name] = validate(self._model_for(model, values, where), values, where)
        return self._cache[kind, name]
