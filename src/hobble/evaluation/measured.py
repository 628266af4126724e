"""What one configuration measured of itself, as a comparison reads it."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from hobble.core.errors import InputError
from hobble.core.files import read_json

COUNTS = ("true", "table_6_1", "table_6_1_as_printed")
FLOAT = 4  # bytes of a stored weight
PHASES = {"constant": 50, "linear": 10}  # whose weights the original stores


@dataclass(frozen=True)
class Measured:
    """What one configuration left behind: its resolved configuration, its measurements and its history."""

    name: str
    resolved: Mapping[str, Any] = field(repr=False)
    accuracy: Mapping[str, Any] = field(repr=False)
    rollouts: Mapping[str, Any] = field(repr=False)
    responsivity: Mapping[str, Any] = field(repr=False)
    injury: Mapping[str, Any] = field(repr=False)
    recognition: Mapping[str, Any] = field(repr=False)
    pipeline: Mapping[str, Any] = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)


def read_measured(name: str, files: Mapping[str, str | Path]) -> Measured:
    """Read one configuration's files, named as the fields of `Measured` (`configuration` for `resolved`).

    Raises InputError naming the file that cannot be read.
    """
    read = {key: read_json(path) for key, path in files.items() if key not in ("configuration", "history")}
    resolved = yaml.safe_load(Path(files["configuration"]).read_text(encoding="utf-8"))
    return Measured(name, resolved, **read, history=_history(files["history"]))


def describe(measured: Measured) -> dict[str, Any]:
    """What sets a configuration apart: its data, network, training, and the counts of Table 6.1."""
    model = measured.resolved["configuration"]
    counts = measured.responsivity["parameters"]
    phases = {mode: count * counts["true"] * FLOAT for mode, count in PHASES.items()}
    return {
        "configuration": measured.name,
        "dataset": dataset(measured),
        "network_of": model.get("network_of"),
        "injury": bool(model.get("injury")),
        "hidden_layers": model["network"]["hidden_layers"],
        "units": model["network"]["units"],
        "passes": model["training"]["passes"],
        "joints": measured.accuracy["joints"],
        "computations": {key: counts[key] for key in COUNTS},
        "weights_bytes": {
            **phases,
            "cubic": model["network"]["control_points"] * counts["true"] * FLOAT,
        },
    }


def by_mode(measured: Measured) -> list[dict[str, Any]]:
    """The responsivity of each phase mode that was run."""
    found = measured.responsivity
    return [{**entry, "configuration": measured.name} for entry in found.get("modes", [found])]


def dataset(measured: Measured) -> str:
    """The data set it learns from."""
    return measured.resolved["configuration"]["dataset"]


def of_stage(measured: Measured, stage: str, key: str) -> float | None:
    """What one stage took or left behind, of pipeline.json."""
    return next((s[key] for s in measured.pipeline["stages"] if s["stage"] == stage), None)


def _history(path: str | Path) -> dict[str, list[float | None]]:
    columns: dict[str, list[float | None]] = {}
    try:
        with open(path, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                for key, text in row.items():
                    columns.setdefault(key, []).append(float(text) if text else None)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(path, f"not a training history ({error})", fix="Train again.") from error
    return columns
