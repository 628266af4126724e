"""Writes config/README.md with every key, and JSON schemas for editors: python -m hobble.config.describe"""

import json
import re
from collections.abc import Iterator, Mapping
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any

from pydantic import create_model

from hobble.config.models import Configuration, Dataset, SkeletonFile
from hobble.core.files import write_text
from hobble.models import NETWORK_KINDS, options_of_kind

CONFIG = Path(__file__).resolve().parents[3] / "config"
INTRODUCTION = """# Configurations, data sets and skeletons: every key

This page is made by `python -m hobble.config.describe` from the models that check the files. Each file says
what differs from these defaults; `extends: NAME` takes over another file first.
`results/<configuration>/configuration.yaml` has all keys of a run.

An editor with the YAML language server checks a file as you type if its first line is
`# yaml-language-server: $schema=schema/configuration.json` (in `datasets/` and `skeletons/`:
`../schema/dataset.json`, `../schema/skeleton.json`).
"""
TITLES = {
    "configuration": "Configurations: `config/<name>.yaml`",
    "dataset": "Data sets: `config/datasets/<name>.yaml`",
    "skeleton": "Skeletons: `config/skeletons/<name>.yaml` (`skeletons/README.md` explains them)",
}
Schema = Mapping[str, Any]


def schemas() -> dict[str, dict[str, Any]]:
    """The JSON schemas of the three kinds of files."""
    kinds = reduce(or_, (options_of_kind(kind) for kind in NETWORK_KINDS))
    every_kind = create_model("Configuration", __base__=Configuration, network=(kinds, {}))
    out = {
        "configuration": every_kind.model_json_schema(),
        "dataset": Dataset.model_json_schema(),
        "skeleton": SkeletonFile.model_json_schema(),
    }
    section = out["configuration"]["properties"]["training"]
    # `training: NAME` takes the section of another configuration.
    out["configuration"]["properties"]["training"] = {"anyOf": [section, {"type": "string"}]}
    out["dataset"].pop("required")  # `extends` may give what is required
    return out


def readme() -> str:
    """The text of config/README.md."""
    lines = [INTRODUCTION]
    for kind, schema in schemas().items():
        lines += [f"## {TITLES[kind]}", "", *_keys(schema, schema["$defs"], "", ()), ""]
    return "\n".join(lines).rstrip() + "\n"


def _keys(section: Schema, named: Schema, above: str, seen: tuple[str, ...]) -> Iterator[str]:
    """A line for each key of a section and of the sections in it. named: the models by name."""
    for key, value in section.get("properties", {}).items():
        names = list(dict.fromkeys(re.findall(r'"#/\$defs/(\w+)"', json.dumps(value))))
        has_default = value.get("default") not in (None, {}, [])
        default = f", default `{json.dumps(value['default'])}`" if has_default else ""
        text = " ".join(value.get("description", "").split())
        if not names:
            yield f"- `{above}{key}` ({_type(value)}{default})" + (f": {text}" if text else "")
        for name in names:
            of = f" ({name})" if len(names) > 1 else ""
            yield f"- `{above}{key}`{of}:" + (f" {text}" if text else "")
            if name not in seen:
                yield from _keys(named[name], named, f"{above}{key}.", (*seen, name))


def _type(value: Schema) -> str:
    """The type of a value in words, with its bounds."""
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(_type(part) for part in value["anyOf"]))
    if "enum" in value or "const" in value:
        return ", ".join(f"`{word}`" for word in value.get("enum", [value.get("const")]))
    bounds = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    words = [f"{sign} {value[key]:g}" for key, sign in bounds.items() if key in value]
    return " ".join([str(value.get("type", "any value")).replace("null", "empty"), *words])


def main() -> None:
    """Write the files."""
    write_text(CONFIG / "README.md", readme())
    for kind, schema in schemas().items():
        text = json.dumps(schema, indent=1, sort_keys=True) + "\n"
        write_text(CONFIG / "schema" / f"{kind}.json", text)


if __name__ == "__main__":
    main()
