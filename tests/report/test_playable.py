"""The network packed for the page: what is kept, what is left out, how large it is."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.report.character import playable_data


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


def test_a_network_without_links_can_still_be_played(
    examples: ModuleType, holden31: Skeleton, tmp_path: Any
) -> None:
    examples.weights(tmp_path / "weights.npz", holden31, links=False)
    spec = playable_data(load_network(tmp_path / "weights.npz"), examples.RUNTIME)
    assert spec["channels"] == []
