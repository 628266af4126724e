"""Made-up inputs of a report in the documented formats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.core.files import write_json, write_text
from hobble.core.skeleton import Skeleton
from hobble.measures.measure import all_measures
from hobble.runtime.options import Runtime
from tests.report.example_clips import clip_reports, terrain
from tests.report.example_measurements import HELD_OUT, accuracy, costs, history, injury_sweep, responsivity
from tests.report.example_motion import rows, scenarios, walker, weights

__all__ = ["CLIPS", "RUNTIME", "rows", "scenarios", "walker", "weights", "write_all"]

CLIPS = ("walk_straight", "walk_turns", "jog", "crouch", "stand", "strafe", "hurt_left_knee", "hurt_back")
RUNTIME = Runtime(steering=1.0)


def write_all(
    folder: Path,
    skeleton: Skeleton,
    clips: tuple[str, ...] = CLIPS,
    injury: bool = True,
    terrain_names: list[str] | None = None,
) -> dict[str, Any]:
    """Every input of the report under `folder`; returns the arguments of `hobble.report.gather.gather`.

    terrain_names: of the terrain files, where the clips' names cannot be file names.
    """
    rng = np.random.default_rng(1)
    paths = clip_reports(folder, clips)
    splits = {
        name: "held_out" if clip in HELD_OUT else "train"
        for clip in clips
        for name in (clip, f"{clip}_mirror")
    }
    resolved = {
        "name": "example",
        "configuration": {"training": {"passes": 20}, "runtime": RUNTIME.model_dump()},
        "dataset": {"name": "made_up"},
    }
    write_text(folder / "configuration.yaml", yaml.safe_dump(resolved))
    write_json(folder / "accuracy.json", accuracy(clips, rng))
    write_json(folder / "responsivity.json", responsivity(rng))
    write_json(folder / "injury.json", injury_sweep(rng) if injury else {"applies": False, "reason": "none"})
    grounds = [
        terrain(folder / "terrain" / f"{name}.npz", skeleton, rng, flat="hurt" in clip)
        for name, clip in zip(terrain_names or clips, clips, strict=True)
    ]
    write_json(folder / "pipeline.json", costs())
    history(folder / "history.csv")
    weights(folder / "weights.npz", skeleton, links=injury)
    scenarios(folder / "scenarios.npz", skeleton, injury)
    return {
        "name": "example",
        "dataset": "made_up",
        "title": None,
        "splits": splits,
        "configuration": str(folder / "configuration.yaml"),
        "measurements": [str(folder / f"{name}.json") for name in ("accuracy", "responsivity", "injury")],
        "pipeline": str(folder / "pipeline.json"),
        "history": str(folder / "history.csv"),
        "weights": str(folder / "weights.npz"),
        **paths,
        "terrain": grounds,
        "measures": all_measures(),
    }
