"""Of every kind: the network in training, from its file, compiled, in the page and as ONNX give the same
prediction.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
import torch

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.models import NETWORK_KINDS, network_options, options_of_kind
from hobble.models.blend import BlendedOptions, TrainableBlend
from hobble.models.load import STATISTICS, network_from_arrays
from hobble.models.mann import GATE_INPUTS, MannOptions
from hobble.models.model import BuiltOptions
from hobble.models.network import STORAGES, Network, standardise_inputs
from hobble.rows.layout import GAITS, RowLayout

from .matching.example import built

OPTIONS: dict[str, dict[str, Any]] = {
    "local": {"units": 18, "experts": 3},
    "mann": {"units": 18, "experts": 3},
    "plain": {"units": 18},
    "pfnn": {"units": 18},
}
KINDS = sorted(OPTIONS)
BUILT = {"learned": {"steps": 2, "units": 18, "decompressor_units": 24, "latent": 4}}
Made = tuple[Any, dict[str, Any], Network]


def test_every_kind_is_tested_here() -> None:
    assert set(KINDS) == {k for k in NETWORK_KINDS if issubclass(options_of_kind(k), BlendedOptions)}
    built = {kind for kind in NETWORK_KINDS if issubclass(options_of_kind(kind), BuiltOptions)}
    assert built == {"matching", *BUILT}, "the tests of matching are in a folder of its own"


@pytest.fixture(params=[*KINDS, *BUILT], scope="module")
def made(request: pytest.FixtureRequest, holden31: Skeleton, tmp_path_factory: Any) -> Any:
    """An untrained network (or a built one), the arrays of its file, and the network read from them."""
    kind = request.param
    if kind in BUILT:
        return built(holden31, tmp_path_factory.mktemp(kind), kind, **BUILT[kind])
    options = network_options({"kind": kind, **OPTIONS[kind]})
    local = 4 if options.uses_local_phases else 0
    layout = RowLayout(len(holden31.joints), channels=(("injury", 30),), local_phases=local)
    assert isinstance(options, BlendedOptions)
    trainable, again, other = (options.untrained_network(layout, holden31, seed) for seed in (1, 1, 2))
    assert trainable.flat.numel() == options.parameter_count(layout.x_size, layout.y_size)
    assert torch.equal(trainable.flat, again.flat)
    assert not torch.equal(trainable.flat, other.flat)
    # Larger than a fresh one, so that units go below 0 and shares differ.
    trainable.flat.normal_(0, 0.15, generator=torch.Generator().manual_seed(2))
    rng = np.random.default_rng(1)
    arrays: dict[str, Any] = dict(trainable.arrays())
    for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
        arrays[f"{name}mean"] = rng.normal(0, 10, size).astype(np.float32)
        arrays[f"{name}std"] = rng.uniform(0.5, 2, size).astype(np.float32)
    own = {"layout": layout.to_dict(), "skeleton": holden31.to_dict()}
    meta = {"kind": kind, "channels": {"injury": holden31.link_names}, **own}
    arrays["meta"] = np.array(json.dumps(meta))
    return trainable, arrays, network_from_arrays("weights.npz", arrays)


def random_inputs(network: Network, rows: int = 7) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    x = network.x_mean + network.x_std * rng.normal(size=(rows, len(network.x_mean)))
    return x.astype(np.float32), np.r_[0.0, 0.5, 1.0, rng.random(rows - 3)]


def near(network: Network, y: np.ndarray, expected: np.ndarray, within: float) -> None:
    """Whether two outputs are nearly equal, compared in standard deviations."""
    np.testing.assert_allclose((y - expected) / network.y_std, 0, atol=within)


def test_the_read_network_equals_the_trained_one(made: Made) -> None:
    trainable, _, network = made
    if not isinstance(trainable, TrainableBlend):
        pytest.skip("it is built")
    x, phase = random_inputs(network)
    y = trainable(
        torch.from_numpy(standardise_inputs(network, x)), torch.from_numpy(phase.astype(np.float32))
    )
    near(network, y.numpy() * network.y_std + network.y_mean, network.predict(x, phase), 2e-5)
    assert network.sizes[0] == len(network.x_mean)
    assert network.sizes[-1] == len(network.y_mean)


def test_the_compiled_predictor_equals_the_plain_prediction(made: Made) -> None:
    network = made[2]
    x, phase = random_inputs(network)
    expected = network.predict(x, phase)
    near(network, network.predictor(storage="float32").predict(x, phase), expected, 2e-5)
    out = np.zeros_like(expected)
    assert network.predictor(storage="int16").predict(x, phase, out) is out
    near(network, out, expected, 5e-3)
    assert np.abs(out - expected).max() > 0, "integers are not the same"
    same = np.array_equal(expected, network.predict(x, phase + 0.3))
    assert same == (not network.uses_phase)
    with pytest.raises(ValueError, match="storage"):
        network.predictor(storage="float8")


@pytest.mark.parametrize("storage", STORAGES)
def test_a_crowd_is_bitwise_equal_to_single_characters(made: Made, storage: str) -> None:
    """For some characters the share of an expert is 0, so that the rows of a product are not all
    consecutive.
    """
    network = made[2]
    x, phase = random_inputs(network, 29)
    x[::3] = network.x_mean + 30 * (x[::3] - network.x_mean)
    predictor = network.predictor(storage=storage)
    alone = [predictor.predict(x[i : i + 1], phase[i : i + 1])[0] for i in range(len(x))]
    for count in (2, 3, 4, 5, 6, 7, 13, 29):
        np.testing.assert_array_equal(predictor.predict(x[:count], phase[:count]), alone[:count])
        np.testing.assert_array_equal(predictor.predict(x[-count:], phase[-count:]), alone[-count:])


def test_onnxruntime_predicts_the_same_as_python(made: Made, tmp_path: Path) -> None:
    network = made[2]
    assert "by at most" in network.export("onnx", tmp_path / "network.onnx", network.resolve_mode(None))
    x, phase = random_inputs(network)
    session = onnxruntime.InferenceSession(tmp_path / "network.onnx", providers=["CPUExecutionProvider"])
    (y,) = session.run(["y"], {"x": x, "phase": phase.astype(np.float32)})
    near(network, y, network.predict(x, phase), 1e-4)


CHANGES: dict[str, Callable[[np.ndarray], np.ndarray | None]] = {
    "is gone": lambda a: None,
    "has one row less": lambda a: a[1:],
    "holds no number": lambda a: np.full(a.shape, np.nan),
    "is text": lambda a: np.full(a.shape, "a"),
}


@pytest.mark.parametrize("how", CHANGES)
def test_a_malformed_array_is_refused(made: Made, how: str) -> None:
    arrays = made[1]
    for name in arrays.keys() - {"meta", *STATISTICS}:
        other = {key: value for key, value in arrays.items() if key != name}
        if (array := CHANGES[how](arrays[name])) is not None:
            other[name] = array
        with pytest.raises(InputError, match=r"weights\.npz"):
            network_from_arrays("weights.npz", other)


def test_the_gate_reads_feet_gait_and_target_velocity(holden31: Skeleton) -> None:
    """The columns are found by writing a number where each of them should be."""
    layout = RowLayout(len(holden31.joints), channels=(("injury", 30),))
    x = np.zeros(layout.x_size)
    velocity = x[layout.x_joint_velocity].reshape(-1, 3)
    for i, joint in enumerate(("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")):
        velocity[holden31.index(joint)] = 1 + 3 * i + np.arange(3)
    gait = x[layout.x_gait].reshape(len(GAITS), layout.samples)
    gait[:, 6], gait[:, 11] = 20 + np.arange(6), 30 + np.arange(6)
    x[layout.x_position].reshape(2, -1)[:, 11] = 40, 41
    columns = MannOptions().gate_columns(layout, holden31)
    assert len(columns) == GATE_INPUTS
    assert x[list(columns)].tolist() == [*range(1, 13), *range(20, 26), *range(30, 36), 40, 41]
