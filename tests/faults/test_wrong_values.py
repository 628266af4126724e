"""Artefacts with a wrong value in them, with right checksums, are refused by name, or nothing becomes NaN."""

from __future__ import annotations

import json
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from hobble.channels.clip_values import load_values, save_values
from hobble.core.clip import load_clip, save_clip
from hobble.core.declared import load_report
from hobble.core.errors import HobbleError
from hobble.core.files import CHECKSUMS, read_json, write_json
from hobble.core.skeleton import Skeleton
from hobble.database.options import DatabaseOptions
from hobble.labels.clip_labels import LabelReport, load_labels, save_labels
from hobble.labels.label import label_clip, write_report
from hobble.labels.options import LabelOptions
from hobble.rows.build_rows import build_clip_rows
from hobble.rows.clip_rows import load_clip_rows, load_summary, save_clip_rows, save_summary, summary_of_rows
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment
from hobble.terrain.clip_fits import clip_fits, load_fits, save_fits
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.options import HeightmapOptions, HeightSampling, Terrain
from hobble.terrain.patches import draw_patches, load_patches, save_patches

from .values import change_file

OF_ROWS = {"window": 60, "step": 10, "facing_sigma": 20.0}


def made_of(clip: Path, labels: Path, values: Path, fits: Path) -> Any:
    channels = {"injury": load_values(values)[0]}
    return build_clip_rows(
        "walk", load_clip(clip), vars(load_labels(labels)), channels, load_fits(fits), **OF_ROWS
    )


@pytest.fixture(scope="module")
def folder(holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One artefact of each kind, called walk-<kind>."""
    at = tmp_path_factory.mktemp("artefacts")
    clip = walk_from_plan("walk", holden31, [Segment("walk", 130, seconds=8)], 400, "uneven", 60, 1).clip
    source = {"source_frames": len(clip), "source_fps": clip.fps}
    labels, report = label_clip(clip, [], source, "walk", "rocky", LabelOptions())
    maps = heightmaps([HeightmapOptions(kind="hills")], [], cell=4.0, height_scale=1.0)
    patches = draw_patches(maps, count=20, cell=4.0, size=64, highest=50.0, seed=1)
    sampling = HeightSampling(**DatabaseOptions().model_dump(include=set(HeightSampling.model_fields)))
    save_clip(at / "walk-clip.npz", clip)
    save_labels(at / "walk-labels.npz", labels)
    write_report(at / "walk-report.json", report, labels, clip)
    save_values(at / "walk-values.npz", np.zeros((len(clip), 30), np.float32), holden31.link_names)
    save_patches(at / "walk-patches.npz", patches)
    save_fits(at / "walk-fits.npz", clip_fits(clip, vars(labels), patches, "rocky", Terrain(), sampling))
    rows = made_of(*(at / f"walk-{kind}.npz" for kind in ("clip", "labels", "values", "fits")))
    save_clip_rows(at / "walk-rows.npz", rows)
    save_summary(at / "walk-summary.json", summary_of_rows(rows))
    return at


READERS: dict[str, Callable[[dict[str, Path]], list[Any]]] = {
    "clip.npz": lambda at: [load_clip(at["clip"]).positions, made_of(**at).x],
    "labels.npz": lambda at: [made_of(**at).x, made_of(**at).y],
    "values.npz": lambda at: [made_of(**at).channels["injury"]],
    "fits.npz": lambda at: [made_of(**at).heights, made_of(**at).mean],
    "patches.npz": lambda at: [load_patches(at["patches"]).heights_at([0, 1], np.zeros((3, 2), np.float32))],
    "rows.npz": lambda at: [load_clip_rows(at["rows"]).x, load_clip_rows(at["rows"]).y],
    "report.json": lambda at: [load_report(at["report"], "labels", LabelReport).cycles_dropped],
    "summary.json": lambda at: [load_summary(at["summary"]).rows],
}


@pytest.mark.parametrize("file", READERS)
def test_a_wrong_value_is_refused_or_harmless(folder: Path, tmp_path: Path, file: str) -> None:
    path, refused, unnamed = tmp_path / f"walk-{file}", 0, []
    needed = {kind: folder / f"walk-{kind}.npz" for kind in ("clip", "labels", "values", "fits")}
    at = {**(needed if path.stem[5:] in needed else {}), path.stem[5:]: path}
    for number in range(40):
        shutil.copy(folder / path.name, path)
        change_file(Random(f"{file}-{number}"), path, refit=True)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                found = READERS[file](at)
        except HobbleError as error:
            refused += 1
            unnamed += [str(error)] * ("walk" not in str(error))
        else:
            assert all(np.isfinite(array).all() for array in found), number
    assert refused > 0
    assert unnamed == []


def test_a_json_file_that_was_changed_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_json(path, {"speed": 1.5, "clips": ["a", "b"]})
    assert read_json(path) == {"speed": 1.5, "clips": ["a", "b"]}
    content = json.loads(path.read_text())
    for change in ({"speed": 2.5}, {"clips": []}, {CHECKSUMS: "crc32 00000000"}):
        path.write_text(json.dumps({**content, **change}))
        with pytest.raises(HobbleError, match=r"a\.json: was changed after it was written"):
            read_json(path)
    path.write_text('{"speed": 1e999}')
    with pytest.raises(HobbleError, match="1e999 is not a number"):
        read_json(path)
