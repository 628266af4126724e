"""Wrong data sets, targets and continuations are reported before anything runs."""

import contextlib
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow import project as targets
from hobble.workflow.project import Project, check_targets
from tests.workflow.conftest import DATASET

IMPOSSIBLE = {
    DATASET + "clips: {b: , a_mirror: }\n": "a_mirror: names that end in _mirror, .* are reserved",
    DATASET.replace("[b]", "[a, b, c]"): "no clip without injury is left to train on",
    "skeleton: s\nfolder: empty\n": "empty: no such folder",
}


@pytest.mark.parametrize("text", IMPOSSIBLE)
def test_an_impossible_data_set_is_reported(base: Path, text: str) -> None:
    (base / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=IMPOSSIBLE[text]):
        _ = Project(base, {}).configuration("one").splits


@pytest.fixture
def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Data sets are not checked, because their clips hold nothing."""
    monkeypatch.setattr(targets, "_check_dataset", lambda *_: None)


def test_impossible_targets_are_reported_before_training(base: Path, unchecked: None) -> None:
    (base / "config/eyes.yaml").write_text("extends: hurt\nnetwork_of: one\n")
    questionnaire = "questionnaire/questionnaire.html"
    with pytest.raises(HobbleError, match=r"configuration one has no channel injury.*\[injury\]"):
        check_targets(Project(base, {}), [f"results/one/{questionnaire}"])
    fine = ("hurt/stimuli", f"hurt/{questionnaire}", "one/export/pfnn")
    check_targets(Project(base, {}), [f"results/{target}" for target in fine])


SYMMETRIC = "training: {symmetric: true}\n"


@pytest.mark.parametrize(
    ("text", "dataset", "message"),
    [
        (SYMMETRIC + "network: {kind: mann}", DATASET, "lame: training.symmetric: a network of kind mann"),
        (SYMMETRIC, DATASET.replace("mirror: true\n", ""), "data set mine has no mirrored clips.* `mirror"),
        (SYMMETRIC + "network: {kind: plain}", DATASET, ""),
    ],
)
def test_a_data_set_has_what_the_network_needs(
    base: Path, unchecked: None, text: str, dataset: str, message: str
) -> None:
    (base / "config/datasets/mine.yaml").write_text(dataset)
    (base / "config/lame.yaml").write_text(f"dataset: mine\n{text}\n")
    with pytest.raises(HobbleError, match=message) if message else contextlib.nullcontext():
        check_targets(Project(base, {}), ["results/lame/report.html"])


ENTRIES = {
    "skeleton: s\nfolder: mine\nclips: {b: {channels: {injury: 'LeftLeg-LeftFoot[11]'}}}\n": "channels.*11",
    "skeleton: s\nsynthetic: {frames: 600}\nclips: {b: {recipe: wlak}}\n": "recipe: no such recipe: wlak",
}


def test_wrong_names_in_clip_entries_are_reported_before_anything_runs(complete: Path) -> None:
    for text, message in ENTRIES.items():
        (complete / "config/datasets/mine.yaml").write_text(text)
        with pytest.raises(HobbleError, match=f"data set mine: clips.b.{message}"):
            check_targets(Project(complete, {}), ["results/one/report.html"])


def test_a_skeleton_that_cannot_be_mirrored_is_reported_before_anything_runs(complete: Path) -> None:
    rig = complete / "config/skeletons/s.yaml"
    rig.write_text(rig.read_text().replace("RightFoot", "OtherFoot"))
    (complete / "config/datasets/mine.yaml").write_text(DATASET + "clips: {a: , b: }\n")
    says = "skeleton s cannot be mirrored: LeftFoot is the left heel and OtherF"
    with pytest.raises(HobbleError, match=says):
        check_targets(Project(complete, {}), ["results/one/report.html"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("channels: [injury]", r"its channels must be \[\], not"),
        ("training: {passes: 19}", r"its training\.passes must be 20 or more, not 19"),
        ("network: {kind: matching}", "so its network must be"),
        ("training: {learning_rate: 1.0e-3, batch: 64}", None),
    ],
)
def test_an_impossible_continuation_is_reported_before_anything_runs(
    complete: Path, text: str, message: str | None
) -> None:
    (complete / "config/more.yaml").write_text("extends: one\ntraining: {passes: 40, continues: one}\n")
    (complete / "config/other.yaml").write_text(f"extends: more\n{text}\n")
    refused = pytest.raises(HobbleError, match=f"configuration other continues from one, .*{message}")
    with refused if message else contextlib.nullcontext():
        check_targets(Project(complete, {}), ["results/other/report.html"])
