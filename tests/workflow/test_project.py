"""Which clips a configuration gets, in which part of the split, and what is compared."""

from pathlib import Path

import pytest

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.workflow.project import Project, check_targets
from tests.workflow.conftest import DATASET


def test_mirrors_go_with_their_originals_and_hurt_clips_to_injured_networks(base: Path) -> None:
    project = Project(base, {})
    healthy = {"a": "train", "a_mirror": "train", "b": "held_out", "b_mirror": "held_out"}
    assert project.configuration("one").splits == healthy
    assert project.configuration("hurt").splits == {**healthy, "c": "train", "c_mirror": "train"}
    assert project.configuration("one").database.endswith("mine/database/plain")
    assert project.configuration("hurt").database.endswith("mine/database/injury")


MOODS = """
hurt: {versions: 1}
channels:
  mood: {patterns: {"b*": {sad: 1}}}
clips: {a: {person: ann}, b: , c: {person: ann}}
"""


def test_a_hurt_version_has_the_mood_of_its_clip(base: Path) -> None:
    (base / "config/datasets/mine.yaml").write_text(DATASET + MOODS)
    (base / "config/mood.yaml").write_text("extends: one\nchannels: [mood]\n")
    (base / "config/both.yaml").write_text("extends: one\nchannels: [mood, injury]\n")
    project = Project(base, {})
    values = project.dataset("mine")
    assert [values.is_neutral(clip, "mood") for clip in ("a_hurt1", "b_hurt12")] == [True, False]
    source = channel("mood").make_source(values.channel_source("b_hurt1", "mood"))
    assert not channel("mood").is_neutral(source)
    plain, moods = ("a", "a_mirror"), ("a", "a_mirror", "b", "b_mirror")
    both = {*moods, *(f"{v}{m}" for v in ("a_hurt1", "b_hurt1", "c") for m in ("", "_mirror"))}
    assert set(project.configuration("one").splits) == set(plain)
    assert set(project.configuration("mood").splits) == set(moods)
    assert set(project.configuration("hurt").splits) == {c for c in both if c[0] != "b"}
    assert set(project.configuration("both").splits) == both
    database = project.configuration("both").database
    assert database.endswith("mine/database/injury+mood"), "in the order of the list of channels"
    people = project.configuration("both").measure_params("recognition")["people"]
    assert {clip for clip, person in people.items() if person == "ann"} == {c for c in both if c[0] in "ac"}


def test_severities_of_0_count_as_healthy_and_an_entry_replaces_the_file(base: Path) -> None:
    for clip, text in (("a", "1-9 LeftLeg-LeftFoot[0];"), ("c", "5-9 LeftLeg-LeftFoot[.5];")):
        (base / f"data/mine/{clip}_injuries.txt").write_text(f"frames:9\n{text}\n")

    def healthy() -> list[bool]:
        sources = Project(base, {}).dataset("mine")
        return [sources.is_neutral(clip, "injury") for clip in "abc"]

    assert healthy() == [True, True, False]
    entry = "{channels: {injury: 'LeftLeg-LeftFoot[%s]'}}"
    text = f"{DATASET}clips: {{a: {entry % 2}, b: {entry % 0}, c: }}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    assert healthy() == [False, True, False]
    assert Project(base, {}).dataset("mine").channel_files("a", "injury") == []


def test_a_comparison_has_its_configurations(complete: Path) -> None:
    project = Project(complete, {"compare": ["one", "hurt"]})
    check_targets(project, ["results/compare/compare.json"])
    made = [each.result_file("injury") in each.result_files() for each in project.compared]
    assert made == [False, True], "only where the network has the channel"
    assert [each.name for each in Project(complete, {"compare": "one,hurt"}).compared] == ["one", "hurt"]
    (complete / "config/read.yaml").write_text("extends: one\nnetwork_of: one\n")
    (read,) = Project(complete, {"compare": ["read"]}).compared
    assert read.network("history.csv") == "results/one/network/history.csv"
    # The list of compared configurations belongs to none of them.
    assert project.configuration("one").resolved() == Project(complete, {}).configuration("one").resolved()


@pytest.mark.parametrize("names", [["one", "one"], [1]], ids=str)
def test_configurations_that_cannot_be_compared_are_refused(complete: Path, names: object) -> None:
    project = Project(complete, {"compare": names})
    with pytest.raises(HobbleError, match="must be a list of names, each once, "):
        check_targets(project, ["results/compare/report.html"])
