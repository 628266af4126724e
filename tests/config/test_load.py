"""Layers, validation, and errors that name the file, the key and the allowed values."""

from collections import Counter
from pathlib import Path

import pytest

from hobble.config.load_configuration import Catalogue, read_yaml, validate
from hobble.config.models import Configuration, Dataset, SkeletonFile
from hobble.core.errors import HobbleError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "base.yaml").write_text("training: {passes: 3, batch: 8}\n")
    (tmp_path / "child.yaml").write_text("extends: base\ntraining: {batch: 16}\n")
    return tmp_path


def test_extends_keeps_the_keys_that_the_child_does_not_set(folder: Path) -> None:
    model = Catalogue(folder).configuration("child")
    assert (model.training.passes, model.training.batch) == (3, 16)


def test_a_training_section_can_be_given_by_name(folder: Path) -> None:
    """`training: NAME` stands for the whole section, in files and on the command line."""
    (folder / "quick.yaml").write_text("extends: base\ntraining: {batch: 256}\n")
    (folder / "like.yaml").write_text("channels: [injury]\ntraining: quick\n")
    (folder / "more.yaml").write_text("extends: like\ntraining: {seed: 5}\n")
    quick = Catalogue(folder).configuration("quick").training
    assert Catalogue(folder).configuration("like").training == quick
    assert Catalogue(folder).configuration("more").training == quick.model_copy(update={"seed": 5})
    named = Catalogue(folder, {"training": "quick"})
    assert [named.configuration(name).training for name in ("base", "child", "quick")] == [quick] * 3
    assert named.configuration("like").channels == ("injury",)
    (folder / "hurt.yaml").write_text("extends: like\ntraining: {scales: {injury: 0.5}}\n")
    named = Catalogue(folder, {"training": "hurt"})  # only a network with the channel can divide its inputs
    scales = [named.configuration(name).training.scales for name in ("base", "like")]
    assert scales == [{}, {"injury": 0.5}]


def test_a_missing_training_and_loops_are_reported(folder: Path) -> None:
    with pytest.raises(HobbleError, match=r"slow\.yaml: no such file\. There are: base, child"):
        Catalogue(folder, {"training": "slow"}).configuration("base")
    (folder / "like.yaml").write_text("training: like\n")
    with pytest.raises(HobbleError, match="`training: like` refers to itself"):
        Catalogue(folder).configuration("like")
    (folder / "base.yaml").write_text("extends: child\n")
    with pytest.raises(HobbleError, match=r"child\.yaml: extends itself through child -> base"):
        Catalogue(folder).configuration("child")


@pytest.mark.parametrize("text", ["held_out: [02_02]", "held_out: [on]", "clips: {02_01: {gait: walk}}"])
def test_a_name_that_yaml_reads_as_a_number_has_to_be_quoted(tmp_path: Path, text: str) -> None:
    (tmp_path / "datasets").mkdir()
    (tmp_path / "datasets/mine.yaml").write_text(f"skeleton: s\nfolder: mine\n{text}\n")
    with pytest.raises(HobbleError, match=r"not (130|True|129)\. Put the name in quotes"):
        Catalogue(tmp_path).dataset("mine")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"traning": {}}, r"x\.yaml: traning: there is no such key\. Allowed here: .*training"),
        ({"training": {"lr": 1}}, r"training\.lr: there is no such key\. Allowed here: passes, sections"),
        ({"training": {"learning_rate": -1}}, r"training\.learning_rate: .*greater than 0, not -1"),
        ({"runtime": {"mode": "quartic"}}, r"runtime\.mode: .*'constant', 'linear' or 'cubic'"),
    ],
)
def test_a_wrong_value_names_file_key_and_what_is_allowed(values: dict, message: str) -> None:
    with pytest.raises(HobbleError, match=message):
        validate(Configuration, values, "x.yaml")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"skeleton": "s"}, "needs `folder`"),
        ({"skeleton": "s", "synthetic": {}}, "a list of its `clips`"),
        ({"skeleton": "s", "folder": "f", "clips": {"a": None}, "held_out": ["b"]}, "not in `clips`: b"),
        ({"skeleton": "s", "folder": "f", "database": {"window": 55}}, "multiple of step"),
        (
            {"skeleton": "s", "folder": "f", "terrain": {"patches": 5}},
            "`patches` .5. must not be fewer than `fits`",
        ),
        ({"skeleton": "s", "folder": "f", "terrain": {"cell": float("nan")}}, r"terrain\.cell: .*finite"),
    ],
)
def test_an_impossible_data_set_is_refused(values: dict, message: str) -> None:
    with pytest.raises(HobbleError, match=message):
        validate(Dataset, values, "d.yaml")


def test_a_key_given_twice_and_broken_yaml_are_refused_with_their_lines(tmp_path: Path) -> None:
    file = tmp_path / "x.yaml"
    file.write_text("clips:\n  a: {gait: walk}\n  b: {gait: walk}\n  a: {gait: jog}\n")
    with pytest.raises(HobbleError, match=r"x\.yaml, line 4: the key a is given twice, first in line 2\."):
        read_yaml(file)
    file.write_text("a: 1\nb: [\n")
    with pytest.raises(HobbleError, match=r"x\.yaml, line 3: not valid YAML"):
        read_yaml(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": {"A": {"parent": "B", "offset": [0, 0, 0]}}}, "its parent 'B' must be listed before"),
        ({"links": [["Hips", "Tail"]]}, "links: there is no joint 'Tail'"),
        ({"roles": {"hips": "Hip"}}, "roles: there is no joint 'Hip'"),
    ],
)
def test_an_inconsistent_skeleton_is_refused(change: dict, message: str) -> None:
    good = {"joints": {"Hips": {"parent": None, "offset": [0, 0, 0]}}, "roles": {"hips": "Hips"}}
    with pytest.raises(HobbleError, match=message):
        validate(SkeletonFile, {**good, **change}, "s.yaml")


def test_every_shipped_file_is_valid(root: Path) -> None:
    catalogue = Catalogue(root / "config")
    for name in catalogue.names():
        dataset = catalogue.dataset(catalogue.configuration(name).dataset)
        catalogue.skeleton(dataset.skeleton)
    for path in (root / "config/datasets").glob("*.yaml"):
        catalogue.dataset(path.stem)
    for path in (root / "config/skeletons").glob("*.yaml"):
        catalogue.skeleton(path.stem)


def test_shipped_configurations_are_the_published_ones(root: Path) -> None:
    catalogue = Catalogue(root / "config")
    holden = catalogue.configuration("holden")
    t = holden.training
    assert (t.passes, t.sections, t.batch, t.learning_rate, t.dropout, t.l1) == (20, 10, 32, 1e-4, 0.3, 0.01)
    assert (holden.network.hidden_layers, holden.network.units, holden.network.control_points) == (2, 512, 4)
    assert catalogue.configuration("holden-xl").network.hidden_layers == 3
    xt = catalogue.configuration("holden-xt")
    assert (xt.training.passes, xt.training.continues) == (40, "holden")
    assert xt.training.model_copy(update={"passes": 20, "continues": None}) == t
    hurried = Catalogue(root / "config", {"training": "fast"}).configuration("holden-xt").training
    assert hurried == catalogue.configuration("fast").training != t
    assert catalogue.dataset("synthetic").terrain.fits == 10
    assert catalogue.dataset("synthetic").synthetic.frames == 14_640


def test_the_shipped_release_lists_forty_clips_and_their_ground(root: Path) -> None:
    """The 40 clips of the original database and their mirrors."""
    release = Catalogue(root / "config").dataset("pfnn")
    grounds = Counter(entry.ground if entry else "flat" for entry in release.clips.values())
    assert grounds == {"flat": 19, "rocky": 15, "jumpy": 5, "beam": 1}
    assert release.mirror
    assert release.held_out == ()
    assert len(release.terrain.heightmaps) == 13
