"""The whole workflow on tiny synthetic data: it finishes, is reproducible, and re-runs the right jobs."""

import json
import struct
import zipfile

import numpy as np
import pytest

from hobble.engine import LIBRARIES
from hobble.measures.measure import all_measures
from hobble.report.parts import format_number
from tests.faults.same import main as compare_runs

pytestmark = pytest.mark.workflow

TARGET = "results/test/report.html"


def test_the_report_and_all_other_results_are_made(finished) -> None:
    results = finished.folder / "results" / "test"
    accuracy = json.loads((results / "evaluation/accuracy.json").read_text())
    assert accuracy["configuration"] == "test"
    for split in ("train", "held_out"):
        assert 0 < accuracy[split]["mean"] < 1
        assert accuracy[split]["position_error_cm"] > 0
    assert {row["split"] for row in accuracy["clips"]} == {"train", "held_out"}
    pipeline = json.loads((results / "pipeline.json").read_text())
    stages = {stage["stage"]: stage for stage in pipeline["stages"]}
    assert set(stages) >= {"synthetic", "motion", "labels", "channels", "terrain", "database", "training"}
    assert all(stage["seconds"] > 0 and stage["bytes"] > 0 for stage in stages.values())
    assert pipeline["database"]["bytes"] < 0.27 * pipeline["database"]["original_bytes"]
    assert json.loads((results / "evaluation/injury.json").read_text())["applies"]
    page = (finished.folder / TARGET).read_text()
    assert f"{format_number(accuracy['held_out']['position_error_cm'])} cm per joint on average" in page


def test_a_second_call_has_nothing_to_do(finished) -> None:
    assert "Nothing to be done" in finished.run("-n", TARGET)


@pytest.mark.slow
def test_two_runs_give_the_same_bytes(finished, workflow) -> None:
    workflow.run("-c2", TARGET)
    assert compare_runs(finished.folder, workflow.folder) == 0


def test_more_passes_retrain_and_leave_the_database(finished) -> None:
    planned = finished.planned(TARGET, "--config", "training={passes: 3}")
    assert planned["training"] == planned["report"] == 1
    assert planned["measure"] == len(all_measures())
    assert not {"database_merge", "database_clips", "motion_clips", "terrain_fits"} & set(planned)


LABELS_ON = {"labels_clips", "terrain_fits", "database_clips", "database_merge", "training"}


@pytest.mark.parametrize("labels", [False, True])
def test_an_edit_runs_what_depends_on_it(copied, labels: bool) -> None:
    """Content counts, not file times: all files of the code are touched, as in a fresh clone."""
    source = copied.own_source()
    for path in copied.folder.rglob("*"):
        inside = path.relative_to(copied.folder).parts[0]
        if path.is_file() and inside in ("Snakefile", "config", "profiles", "src", "workflow"):
            path.touch()
    pages = {"report/page.html.j2": "{# a comment #}", "report/web/charts.js": "// a comment"}
    edits = {"labels/footfall.py": "_EDITED = 1"} if labels else {**pages, "core/quat.py": "# a comment"}
    for file, line in edits.items():
        (source / file).write_text(f"{(source / file).read_text()}\n{line}\n")
    copied.edit("config/datasets/tiny.yaml", "held_out:", "motion: {up: auto}\nheld_out:")  # the default
    planned = copied.planned(TARGET)
    if not labels:
        assert set(planned) == {"page_bundle", "report"}
        return
    assert set(planned) >= LABELS_ON
    assert not {"synthetic_clips", "motion_clips", "terrain_patches"} & set(planned)
    # A clip is hurt by its labels, and only the channels of hurt clips follow it.
    assert planned["channel_clips"] == planned["hurt_clips"]


@pytest.mark.slow
def test_a_configuration_that_continues_another_starts_at_its_end(copied) -> None:
    more = "extends: test\ntraining:\n  passes: 3\n  continues: test\n"
    (copied.folder / "config/more.yaml").write_text(more)
    weights = "results/more/network/weights.npz"
    assert copied.planned(weights) == {"training": 1}
    copied.run("-c2", weights)
    rows = (copied.folder / "results/more/network/history.csv").read_text().splitlines()
    begun = (copied.folder / "results/test/network/history.csv").read_text().splitlines()
    assert rows[: len(begun)] == begun
    assert len(rows) == 1 + 3 * 10


EXPORTS = ("hobble_blender.zip", "character.glb", "web", "engine", "pfnn", "linear.onnx")


@pytest.mark.slow
def test_every_export_is_made(copied) -> None:
    copied.run("-c2", *(f"results/test/export/{name}" for name in EXPORTS))
    export = copied.folder / "results/test/export"
    magic, version, length, size = struct.unpack("<4sIII", (export / "character.glb").read_bytes()[:16])
    assert (magic, version, length) == (b"glTF", 2, (export / "character.glb").stat().st_size)
    scene = json.loads((export / "character.glb").read_bytes()[20 : 20 + size])
    assert {each["name"] for each in scene["animations"]} > {"walk_loop", "jog_loop_root_motion"}
    addon = zipfile.ZipFile(export / "hobble_blender.zip").namelist()
    assert {f"hobble_blender/libraries/{name}" for name in LIBRARIES} < set(addon)
    assert {"hobble_blender/character.hob", "hobble_blender/character.glb"} < set(addon)
    spec = json.loads((export / "web/character.json").read_text())["spec"]
    weights = np.load(copied.folder / "results/test/network/weights.npz")
    assert spec["names"] == list(json.loads(str(weights["meta"]))["skeleton"]["joints"])
    assert (export / "engine/character.hob").read_bytes()[:6] == b"HOBBLE"
    assert len(list((export / "engine/traces").iterdir())) == 10
    assert len(list((export / "pfnn").glob("W0_*.bin"))) == 50
    assert (export / "linear.onnx").stat().st_size > 1e4
