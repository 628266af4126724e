"""A new measurement needs two files, a network a folder, a channel a folder and its name in the list."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hobble.channels.channel import load_values
from tests.checkout import Workflow

pytestmark = pytest.mark.workflow
NETWORK = Path(__file__).with_name("toy_network.py")

HIPS = '''"""How high the hips of the captured figure are."""

from hobble.core.section import Positive, Section
from hobble.measures.compare import ComparisonAddition
from hobble.measures.measure import Cost, Measure
from hobble.report.parts import Column, PageSection, SectionPart, Table


class Options(Section):
    """Its keys of the section `evaluation`."""

    every: Positive = 1


MEASURE = Measure(
    name="hips",
    module=__name__,
    inputs=("clips", "skeleton", "accuracy"),
    options=Options,
    cost=Cost(mb_per_1000_frames=10, least_minutes=1),
)


def section(found, material):
    rows = [[row["clip"], row["highest"]] for row in found["clips"]]
    table = Table("hips", [Column("clip"), Column.number("highest, cm")], rows)
    return PageSection("hips", [SectionPart(0, table)], title="How high <they> are.", order=15)


def compared(all_measured, published):
    highest = {m.name: max(row["highest"] for row in m.results_of("hips")["clips"]) for m in all_measured}
    return ComparisonAddition([{"configuration": name, "highest": value} for name, value in highest.items()])


def tables(compared):
    return {"hips": compared["hips"]}
'''
RUN = """from hobble.measures.measure import MeasureInputs, Outcome
from hobble.rows.clip_rows import captured_stretches
from hobble.rows.clip_rows import load_clip_rows


def run(inputs: MeasureInputs, options) -> Outcome:
    joint = list(inputs.skeleton["joints"]).index(inputs.skeleton["roles"]["hips"])
    rows = []
    for clip, path in inputs.clips.items():
        parts = captured_stretches(load_clip_rows(path))
        heights = [h for part in parts for h in part.local[:: options.every, joint, 1]]
        rows.append({"clip": clip, "frames": len(heights), "highest": round(float(max(heights)), 3)})
    known = [entry["clip"] for entry in inputs.results_of("accuracy")["clips"]]
    return Outcome({"every": options.every, "clips": rows, "known": known}, {"clips": rows}, "<hips>")
"""


CHANNEL = '''"""A toy: whether a clip's name ends in 1."""

import numpy as np

from hobble.channels.channel import Channel


class Toy(Channel):
    name, title, highest, rate = "toy", "Toy", 2.0, 6.0

    def columns(self, rig):
        return ("one", "other")

    def is_neutral(self, source):
        return not source.clip.endswith("1")

    def read(self, clip, source, motion):
        row = [0 if self.is_neutral(source) else 2, 0]
        return np.tile(np.array(row, np.float32), (len(clip), 1)), []


CHANNEL = Toy()
'''
WALK = """
import json, sys
from hobble.runtime import ProceduralAnimation
character = ProceduralAnimation.load(sys.argv[1])
poses = [character.next_pose((0, 2), toy={"one": 1}).channels["toy"].tolist() for _ in range(12)]
network = character.network
print(json.dumps([poses, network.layout.to_dict()["channels"], list(network.channels["toy"])]))
"""


@pytest.fixture
def extended(copied: Workflow) -> Workflow:
    """The finished run with a new measurement, a key of the configuration for it, and a new network."""
    package = copied.own_source()
    (package / "measures/hips.py").write_text(HIPS)
    (package / "measures/hips_run.py").write_text(RUN)
    (package / "models/toy").mkdir()
    shutil.copy(NETWORK, package / "models/toy/__init__.py")
    copied.edit("config/test.yaml", "evaluation:", "evaluation:\n  every: 2")
    return copied


def test_nothing_that_exists_is_made_again_but_what_shows_it(extended: Workflow) -> None:
    planned = extended.planned("results/test/report.html")
    assert planned.pop("page_bundle", 1) == 1  # only if it was not made in this checkout
    assert planned == {"measure": 1, "configuration": 1, "pipeline_summary": 1, "report": 1}


@pytest.mark.slow
def test_they_go_from_the_rows_to_the_pages(extended: Workflow) -> None:
    package = extended.folder / "src/hobble"
    (package / "channels/toy").mkdir()
    (package / "channels/toy/__init__.py").write_text(CHANNEL)
    extended.edit("src/hobble/channels/__init__.py", "CHANNEL_NAMES = (", 'CHANNEL_NAMES = ("toy", ')
    text = "extends: test\nchannels: [injury, toy]\nnetwork: {kind: toy, units: 8}\ntraining: {passes: 1}\n"
    (extended.folder / "config/toy.yaml").write_text(text)
    extended.run("-c2", "results/toy/report.html", "results/compare/report.html", "--config", "compare=toy")
    results, data = extended.folder / "results/toy", extended.folder / "results/datasets/tiny"

    # The channel.
    values = [load_values(data / f"channels/toy/walk-straight-{n}.npz")[0] for n in (1, 2)]
    assert [value.any(axis=0).tolist() for value in values] == [[True, False], [False, False]]
    channels = json.loads((data / "database/toy+injury/manifest.json").read_text())["layout"]["channels"]
    assert channels == [["toy", 2], ["injury", 30]]
    command = [sys.executable, "-c", WALK, str(results / "network/weights.npz")]
    walk = subprocess.run(command, **extended.how(), capture_output=True, text=True, check=True)
    poses, of_network, labels = json.loads(walk.stdout)
    assert (of_network, labels) == (channels, ["one", "other"])
    rising = np.minimum(np.arange(1, 13) * 6.0 / 60, 1.0)  # towards its value, at the channel's rate
    np.testing.assert_allclose(poses, np.stack([rising, 0 * rising], axis=1))

    # The network.
    assert 0 < json.loads((results / "evaluation/accuracy.json").read_text())["train"]["mean"] < 1
    page = (results / "report.html").read_text()
    assert "A toy, with 374 inputs and 311 outputs, trained for" in page
    assert '"file":"SE9CQkxF' in page.replace(": ", ":"), "HOBBLE, the beginning of a character file"

    # The measurement.
    found = json.loads((results / "evaluation/hips.json").read_text())
    assert found["every"] == 2
    assert sorted(row["clip"] for row in found["clips"]) == found["known"]
    assert all(70 < row["highest"] < 110 for row in found["clips"])
    assert (results / "evaluation/hips/clips.csv").read_text().startswith("clip,frames,highest")
    assert "How high &lt;they&gt; are." in page
    compared = extended.folder / "results/compare/tables/hips.csv"
    assert compared.read_text().splitlines()[0] == "configuration,highest"
