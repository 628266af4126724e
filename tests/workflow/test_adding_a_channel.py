"""A new channel needs one folder and its name in the list. Then a network can have it as an input."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

TOY = '''"""A toy: whether a clip's name ends in 1."""

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


def test_a_channel_needs_one_folder_and_one_name_in_the_list(workflow) -> None:
    package = workflow.own_source()
    (package / "channels/toy").mkdir()
    (package / "channels/toy/__init__.py").write_text(TOY)
    workflow.edit("src/hobble/channels/__init__.py", "CHANNEL_NAMES = (", 'CHANNEL_NAMES = ("toy", ')
    (workflow.folder / "config/toy.yaml").write_text(
        "extends: test\nchannels: [injury, toy]\nnetwork: {units: 8}\ntraining: {passes: 1}\n"
    )
    weights = "results/toy/network/weights.npz"
    workflow.run("-c2", weights)
    folder = workflow.folder / "results/datasets/tiny/channels/toy"
    assert json.loads((folder / "walk-straight-1.json").read_text())["values"].keys() == {"one"}
    assert json.loads((folder / "walk-straight-2.json").read_text())["values"] == {}
    manifest = json.loads(
        (workflow.folder / "results/datasets/tiny/database/toy+injury/manifest.json").read_text()
    )
    assert manifest["layout"]["channels"] == [["toy", 2], ["injury", 30]]
    walk = subprocess.run(
        [sys.executable, "-c", WALK, str(workflow.folder / weights)],
        env=workflow.environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    values, channels, labels = json.loads(walk.stdout)
    assert (channels, labels) == ([["toy", 2], ["injury", 30]], ["one", "other"])
    rising = np.minimum(np.arange(1, 13) * 6.0 / 60, 1.0)  # towards its value, at the channel's rate
    np.testing.assert_allclose(values, np.stack([rising, 0 * rising], axis=1))
