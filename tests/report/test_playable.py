"""The network packed for the page: what is kept, what is left out, how large it is."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import yaml

from hobble.channels.injury.shown import PARTS_WITH_SLIDER, link_index_by_part
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.report.character import playable_data
from hobble.report.parts import embedded


def test_parts_are_the_links_of_their_roles(holden31: Skeleton) -> None:
    names = {
        label: holden31.link_names[i]
        for label, i in link_index_by_part(holden31, holden31.link_names).items()
    }
    assert names["left thigh"] == "LeftUpLeg-LeftLeg"
    assert names["right foot"] == "RightFoot-RightToeBase"
    assert names["lower back"] == "Hips-LowerBack"
    assert set(names) == {label for label, *_ in PARTS_WITH_SLIDER}
    assert link_index_by_part(holden31, ()) == {}
    links = holden31.link_names
    back = link_index_by_part(holden31, links, {"LowerBack-Spine", "Spine1-Neck"})["lower back"]
    assert links[back] == "LowerBack-Spine", "the one that was hurt in training"


def test_weights_are_kept_to_a_part_in_sixty_thousand(network: Network, character: dict[str, Any]) -> None:
    layer, kept = character["network"]["layers"][0], network.weights[0][:, :, character["inputColumns"]]
    integers = np.frombuffer(base64.b64decode(layer["weights"]), "<i2").reshape(kept.shape)
    scale = np.frombuffer(base64.b64decode(layer["scale"]), "<f4").reshape(kept.shape[:2])
    error = np.abs(integers * scale[..., None] - kept)
    assert np.all(error <= 0.501 * scale[..., None])
    turning = character["turning"]
    assert character["network"]["layers"][-1]["rows"] == network.layout.y_joint_rotation.start + 3 * len(
        turning
    )


def test_inputs_without_effect_are_left_out(examples: ModuleType, holden31: Skeleton, tmp_path: Path) -> None:
    examples.weights(tmp_path / "weights.npz", holden31)
    network = load_network(tmp_path / "weights.npz")
    x_std = network.x_std.copy()
    unread = network.layout.x_joint_position.start + 3 * holden31.index("LThumb")
    x_std[unread] *= 1e10
    read = playable_data(replace(network, x_std=x_std), examples.RUNTIME)["inputColumns"]
    assert sorted(set(range(network.layout.x_size)) - set(read)) == [unread]


def test_the_largest_network_leaves_room_in_the_page(
    examples: ModuleType, root: Path, tmp_path: Path, page: str
) -> None:
    """With 191 joints, two layers of 512, plotly.js and everything else the page stays under 20 MB."""
    data = yaml.safe_load((root / "config/skeletons/ava191.yaml").read_text())
    skeleton = Skeleton.from_dict({"name": "ava191", **{k: v for k, v in data.items() if k != "maps"}})
    examples.weights(tmp_path / "weights.npz", skeleton, units=512)
    network = load_network(tmp_path / "weights.npz")
    x_std = network.x_std.copy()
    for block in (
        network.layout.x_joint_position,
        network.layout.x_joint_velocity,
    ):  # as training weighs them
        x_std[block].reshape(-1, 3)[[skeleton.index(name) for name in skeleton.unseen]] *= 1e10
    spec = playable_data(replace(network, x_std=x_std), examples.RUNTIME)
    assert len(embedded(spec)) < 13e6
    assert len(page) < 6e6


def test_a_network_without_links_can_still_be_played(
    examples: ModuleType, holden31: Skeleton, tmp_path: Any
) -> None:
    examples.weights(tmp_path / "weights.npz", holden31, links=False)
    spec = playable_data(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert spec["channels"] == []
