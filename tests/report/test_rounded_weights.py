"""Weights of 8 bits for a page with several characters."""

from __future__ import annotations

import base64
import json
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.models.pfnn import Pfnn
from hobble.report.character import GROUP, round_weights
from hobble.runtime.animation import ProceduralAnimation

FRAMES = 60


def weights_of(layer: dict[str, Any]) -> tuple[Array, Array]:
    """The weights of a packed layer of 8 bits, one by one, and the factor of each."""
    shape = layer["points"], layer["rows"], layer["columns"]
    integers = np.frombuffer(base64.b64decode(layer["weights"]), np.int8).reshape(shape)
    groups = np.frombuffer(base64.b64decode(layer["scale"]), "<f4").reshape(*shape[:2], -1)
    factors = np.repeat(groups, GROUP, axis=-1)[..., : shape[2]]
    return integers * factors, factors


@pytest.fixture(scope="module")
def network_of_8_bits(network: Network, character: dict[str, Any]) -> Pfnn:
    """The network of the examples with the weights that lie in the page."""
    assert isinstance(network, Pfnn)
    kept = [w.copy() for w in network.weights]
    small = [weights_of(layer)[0] for layer in round_weights(character)["network"]["layers"]]
    start = network.layout.y_joint_rotation.start
    turns = start + 3 * np.asarray(character["turning"])[:, None] + np.arange(3)
    kept[0][..., character["inputColumns"]] = small[0]
    for own, theirs in zip(kept[1:-1], small[1:-1], strict=True):
        own[...] = theirs
    kept[-1][:, np.concatenate([np.arange(start), turns.ravel()])] = small[-1]
    return replace(network, weights=type(network.weights)(kept))


def test_a_rounded_weight_errs_by_at_most_half_a_step_of_its_group(
    network: Network, character: dict[str, Any]
) -> None:
    assert isinstance(network, Pfnn)
    layer = round_weights(character)["network"]["layers"][0]
    found, factors = weights_of(layer)
    exact = network.weights[0][:, :, character["inputColumns"]]
    assert np.all(np.abs(found - exact) <= 0.505 * factors + 1e-12)
    assert np.abs(found - exact).max() > 0
    assert len(layer["weights"]) < 0.51 * len(character["network"]["layers"][0]["weights"])


def test_the_page_moves_as_python_does_with_the_same_weights(
    tab: Any, network_of_8_bits: Pfnn, character: dict[str, Any], examples: ModuleType
) -> None:
    animation = ProceduralAnimation(network_of_8_bits, **dict(examples.RUNTIME))
    expected = [animation.next_pose((0.4, 2.4), None, "walk").positions for _ in range(FRAMES)]
    found = tab.run(f"""(() => {{
      const c = Hobble.character({json.dumps(round_weights(character))}), out = [];
      for (let f = 0; f < {FRAMES}; f++) {{
        c.frame([.4, 2.4], null, "walk", () => 0);
        out.push(Array.from(c.posePosition));
      }}
      return out;
    }})()""")
    np.testing.assert_allclose(np.reshape(found, (FRAMES, -1, 3)), expected, atol=1e-2)
