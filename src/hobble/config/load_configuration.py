"""Reads configurations, data sets and skeletons from YAML files and validates them.

Values from the command line override those of a configuration. Errors name the file and the key.
"""

import copy
import functools
import re
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from hobble.config.models import Configuration, Dataset, SkeletonFile, configuration_of
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import read_yaml as read_plain_yaml
from hobble.models import DEFAULT_KIND, NETWORK_KINDS

Model = TypeVar("Model", bound=BaseModel)
# Names that cannot lead out of their folder and are not too long for a file name.
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
MOST_PROBLEMS = 20  # a message lists at most this many problems of a configuration, data set or skeleton
QUOTES_HINT = 'Put the name in quotes, as in "02_01"; otherwise YAML reads it as a number or a date.'
NAME_HINT = "Names may have letters, digits, dots, dashes and underscores, 100 at most."


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of `base` with the values of `over`. Mappings are merged recursively; other values are replaced.

    If `over` chooses another kind of network, its section `network` replaces the whole section `network` of
    `base`, because each kind has its own keys.
    """
    merged = copy.deepcopy(dict(base))
    for key, value in over.items():
        mergeable = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        if mergeable and key == "network":
            kind = merged[key].get("kind", DEFAULT_KIND)
            mergeable = value.get("kind", kind) == kind
        merged[key] = merge(merged[key], value) if mergeable else copy.deepcopy(value)
    return merged


def read_yaml(path: Path) -> dict[str, Any]:
    """Read a YAML mapping; an empty file gives {}. Raises InputError for a missing or bad file."""
    if not path.is_file():
        existing = ", ".join(sorted(p.stem for p in path.parent.glob("*.yaml"))) or "none"
        raise InputError(path, "no such file", fix=f"There are: {existing}.")
    data = read_plain_yaml(path)
    if data is None:
        return {}
    if not isinstance(data, dict):
        raise InputError(path, "must be a mapping of keys to values")
    return data


def read_layers(folder: Path, name: str, within: tuple[str, ...] = ()) -> tuple[dict[str, Any], list[Path]]:
    """The values of `<folder>/<name>.yaml`, merged over those of the files that it extends.

    A file extends another file with `extends: NAME`. The other file may extend a third one, and so on.
    within: names of the configurations that led to this one through `training: NAME`; they are needed to find
    circular references. Returns the values, and the files that were read, `<name>.yaml` first.
    """
    files: list[Path] = []
    chain: list[dict[str, Any]] = []
    next_name: str | None = name
    while next_name is not None:
        if not isinstance(next_name, str) or not NAME.fullmatch(next_name):
            where = files[-1] if files else folder
            raise InputError(where, f"{next_name!r:.80} is not a valid name", fix=NAME_HINT)
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
    """Replace `training: NAME` in `values` by the section `training` of the configuration NAME.

    within: names of the configurations that led here, as in `read_layers`. The last one contains `values`. It
    is empty if NAME comes from the command line. Then `scales` of channels that `values` lack are left out,
    so that a recipe fits any configuration.
    """
    name = values.get("training")
    if not isinstance(name, str):
        return values
    if name in within:
        raise InputError(folder / f"{name}.yaml", f"`training: {name}` refers to itself")
    recipe = read_layers(folder, name, within)[0].get("training", {})
    if not within and isinstance(recipe.get("scales"), dict):
        scales = {k: scale for k, scale in recipe["scales"].items() if k in values.get("channels", ())}
        recipe = {**recipe, "scales": scales}
    return {**values, "training": recipe}


def validate(model: type[Model], values: Mapping[str, Any], where: str) -> Model:
    """Validate `values`. Raises a HobbleError that lists the problems, each as `where: key: what is allowed`.

    where: the files from which the values come.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        found = error.errors()
        lines = [f"{where}: {_problem(item, model)}" for item in found[:MOST_PROBLEMS]]
        if len(found) > MOST_PROBLEMS:
            lines.append(f"{where}: and {len(found) - MOST_PROBLEMS} more problems.")
        raise HobbleError("\n".join(lines)) from None


def _problem(item: Any, model: type[BaseModel]) -> str:
    """The message for one error of pydantic: the key and what is allowed. item: a dict from `errors()`."""
    key = ".".join(str(part) for part in item["loc"]) or "(whole file)"
    if item["type"] == "extra_forbidden":
        allowed = ", ".join(_keys_at(model, item["loc"][:-1])) or "none"
        return f"{key}: there is no such key. Allowed here: {allowed}."
    message = item["msg"].removeprefix("Value error, ")
    # A message about a whole section does not end with `not <value>`, because the section would be too long.
    if item["type"] == "value_error" and isinstance(item["input"], Mapping):
        return f"{key}: {message}." if item["loc"] else f"{message}."
    text = f"{key}: {message[0].lower()}{message[1:]}, not {item['input']!r:.80}."
    # YAML reads on, 02_01, 1.5 and 2020-01-01 without quotes as other types.
    is_unquoted = item["type"] == "string_type" and isinstance(item["input"], bool | int | float | date)
    return f"{text} {QUOTES_HINT}" if is_unquoted else text


def _keys_at(model: Any, location: tuple[Any, ...]) -> list[str]:
    """The keys that a model allows in one of its sections.

    location: the keys and indices that lead to the section, from the top of the file.
    """
    for part in location:
        field = getattr(model, "model_fields", {}).get(part)
        if field is not None:
            model = field.annotation
        # The section's model may be inside a type, as in dict[str, ClipEntry | None].
        arguments = [model, *getattr(model, "__args__", ())]
        arguments += [inner for a in arguments for inner in getattr(a, "__args__", ())]
        model = next((a for a in arguments if isinstance(a, type) and issubclass(a, BaseModel)), model)
    return list(getattr(model, "model_fields", {}))


class Catalogue:
    """The configurations, data sets and skeletons under config/, each read and validated when first needed.

    folder: the path of config/. overrides: values from the command line, merged over every configuration.
    """

    def __init__(self, folder: Path, overrides: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self.overrides = dict(overrides or {})

    def names(self) -> list[str]:
        """Names of all configurations."""
        return sorted(path.stem for path in self.folder.glob("*.yaml"))

    @functools.cache  # noqa: B019 - a catalogue lives as long as the process
    def configuration(self, name: str) -> Configuration:
        """The configuration `name`, merged over those that it extends."""
        return self._read(name, self.folder, Configuration, self.overrides)

    @staticmethod
    def _model_for(model: type[Model], values: Mapping[str, Any], where: str) -> type[Model]:
        """The model that validates `values`. For a configuration it depends on the kind of network.

        where: as in `validate`.
        """
        network = values.get("network")
        if model is not Configuration or not isinstance(network, Mapping):
            return model
        kind = network.get("kind", DEFAULT_KIND)
        if kind not in NETWORK_KINDS:
            kinds = ", ".join(NETWORK_KINDS)
            raise HobbleError(f"{where}: network.kind: there is no kind {kind!r:.40}, only {kinds}.")
        return configuration_of(kind)  # type: ignore[return-value]

    @functools.cache  # noqa: B019
    def dataset(self, name: str) -> Dataset:
        """The data set `name`, merged over those that it extends."""
        return self._read(name, self.folder / "datasets", Dataset, {})

    @functools.cache  # noqa: B019
    def skeleton(self, name: str) -> SkeletonFile:
        """The skeleton `name`."""
        return self._read(name, self.folder / "skeletons", SkeletonFile, {})

    def _read(self, name: str, folder: Path, model: type[Model], over: Mapping[str, Any]) -> Model:
        """The file `<folder>/<name>.yaml`, merged and validated. over: values merged over its own."""
        values, files = read_layers(folder, name)
        where = " < ".join(str(path) for path in files)
        if over:
            values, where = with_training(folder, merge(values, over)), f"{where} < --config"
        return validate(self._model_for(model, values, where), values, where)
