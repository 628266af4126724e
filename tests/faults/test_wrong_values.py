"""Artefacts with a wrong value in them, with right checksums, are refused by name, or nothing becomes NaN."""

import json
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from hobble.channels.channel import load_values
from hobble.core.clip import load_clip, load_clip_report
from hobble.core.declared import load_report
from hobble.core.errors import HobbleError
from hobble.core.files import CHECKSUMS, read_json, write_json
from hobble.labels.clip_labels import LabelReport, load_labels
from hobble.models.load import load_network
from hobble.rows.clip_rows import load_clip_rows, load_summary
from hobble.terrain.clip_fits import load_fits
from hobble.terrain.patches import load_patches

from .damage import change_file

BATCHES = "datasets/tiny/batches"
READERS: dict[str, Callable[[Path], Any]] = {
    f"{BATCHES}/motion/uneven-1/motion/uneven-1.npz": lambda path: [load_clip(path).positions],
    f"{BATCHES}/motion/uneven-1/motion/uneven-1.json": load_clip_report,
    f"{BATCHES}/labels/uneven-1/labels/uneven-1.npz": load_labels,
    f"{BATCHES}/labels/uneven-1/labels/uneven-1.json": lambda path: load_report(path, "labels", LabelReport),
    f"{BATCHES}/channels/uneven-1/channels/injury/uneven-1.npz": load_values,
    f"{BATCHES}/terrain/uneven-1/terrain/clips/uneven-1.npz": load_fits,
    f"{BATCHES}/database/uneven-1/database/clips/uneven-1.npz": load_clip_rows,
    f"{BATCHES}/database/uneven-1/database/clips/uneven-1.json": load_summary,
    "datasets/tiny/terrain/patches.npz": load_patches,
    "test/network/weights.npz": load_network,
}


@pytest.mark.workflow
@pytest.mark.parametrize("file", READERS)
def test_a_wrong_value_is_refused_or_harmless(finished, tmp_path: Path, file: str) -> None:
    path, refusals = tmp_path / Path(file).name, []
    for number in range(80):  # most values of a report of labels are only for its figure
        shutil.copy(finished.folder / "results" / file, path)
        change_file(Random(f"{file}-{number}"), path)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                found = READERS[file](path)
        except HobbleError as error:
            refusals.append(str(error))
        else:
            values = found if isinstance(found, list | tuple) else getattr(found, "__dict__", {}).values()
            arrays = [value for value in values if isinstance(value, np.ndarray) and value.dtype.kind == "f"]
            assert all(np.isfinite(array).all() for array in arrays), number
    assert refusals
    assert [said for said in refusals if path.name not in said] == []


def test_a_json_file_that_was_changed_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_json(path, {"speed": 1.5, "clips": ["a", "b"]})
    assert read_json(path) == {"speed": 1.5, "clips": ["a", "b"]}
    content = json.loads(path.read_text())
    for change in ({"speed": 2.5}, {"clips": []}, {CHECKSUMS: "crc32 00000000"}):
        path.write_text(json.dumps({**content, **change}))
        with pytest.raises(HobbleError, match=r"a\.json: was changed after it was written"):
            read_json(path)
