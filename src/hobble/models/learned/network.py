"""Learned motion matching with the interface of a network.

A frame's state is its features, standardised, and its latent vector. In each frame the stepper advances the
character's state. Every few frames the projector finds the state of a captured frame near to the wish. If its
features are nearer to the wish than those of the advanced state, the character goes on from there. The offset
between the two poses then fades, as in `hobble.models.matching.network`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hobble.core.declared import ArrayOf, read_declared
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models.forward import forward
from hobble.models.load import LARGEST_MEAN, read_arrays, read_layers
from hobble.models.matching.network import MOST_WEIGHT, OFFSETS_PER_JOINT, Playing, Transitions
from hobble.models.network import LEARNED, Predictor, inverse_or_0, standardise_inputs
from hobble.models.onnx_file import Graph, Node, OnnxNetwork, add_layers
from hobble.models.predict import Stack

PHASE_OUTPUTS = 2  # of the decompressor, after the columns of Y: sine and cosine of the frame's phase
# Indices in the memory of a character, an array of numbers that is 0 before its first frame.
SHOWN, SINCE, STATE = 0, 1, 2  # 1 once a frame was shown; frames since the last search; first of the state

Layers = tuple[tuple[Array, ...], tuple[Array, ...]]  # weights (1, out, in) and biases (1, out) of each layer


@dataclass(frozen=True)
class LearnedPlaying(Playing):
    """The entries of `meta`: those of `matching`, and how many numbers a latent vector has."""

    latent: Annotated[int, Field(strict=True, ge=1, le=1024)]


@dataclass(frozen=True)
class Learned(OnnxNetwork):
    """Learned motion matching. n is the number of features, L that of the numbers of a latent vector.

    columns: (n,) the columns of X that are features. weights: (n,) their factors. mean, std, low, high: (n,)
    of the weighted features of all frames. latent: L. decompressor: state (n + L) to Y in raw units, then
    sine and cosine of the phase. stepper: state to its change until the next frame. projector: standardised
    features of a wish to the state of a captured frame. every, halflife: as in `Matching`.
    """

    kind: ClassVar[str] = "learned"
    description: ClassVar[str] = "learned motion matching"
    uses_phase: ClassVar[bool] = False
    plays_recorded_poses: ClassVar[bool] = True

    columns: NDArray[np.int64] = field(repr=False)
    weights: Array = field(repr=False)
    mean: Array = field(repr=False)
    std: Array = field(repr=False)
    low: Array = field(repr=False)
    high: Array = field(repr=False)
    latent: int
    decompressor: Layers = field(repr=False)
    stepper: Layers = field(repr=False)
    projector: Layers = field(repr=False)
    every: int
    halflife: float

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Learned:
        """As in `Network`. D0, d0, ... are the layers of the decompressor, S and s, P and p of the others."""
        inputs, outputs = len(shared_fields["x_mean"]), len(shared_fields["y_mean"])
        declared = {
            "columns": ArrayOf(("features",), "iu", 0, inputs - 1),
            "feature_weights": ArrayOf(("features",), "fiu", 0, MOST_WEIGHT),
            "feature_std": ArrayOf(("features",), "fiu", 0, LARGEST_MEAN),
            **{
                f"feature_{name}": ArrayOf(("features",), "fiu", -LARGEST_MEAN, LARGEST_MEAN)
                for name in ("mean", "low", "high")
            },
        }
        found, lengths = read_arrays(path, arrays, declared)
        if shared_fields["skeleton"] is None:
            raise InputError(path, "needs a skeleton, but its meta has none")
        playing = read_declared(path, "meta", LearnedPlaying, shared_fields["meta"])
        features = lengths["features"]
        state = features + playing.latent
        return cls(
            **{name.removeprefix("feature_"): array for name, array in found.items()},
            latent=playing.latent,
            decompressor=read_layers(path, arrays, "Dd", state, outputs + PHASE_OUTPUTS),
            stepper=read_layers(path, arrays, "Ss", state, state),
            projector=read_layers(path, arrays, "Pp", features, state),
            every=playing.every,
            halflife=playing.halflife,
            **shared_fields,
        )

    @property
    def memory_size(self) -> int:
        """As in `Network`: SHOWN, SINCE, the state, and the offsets."""
        return STATE + len(self.columns) + self.latent + OFFSETS_PER_JOINT * self.layout.joints

    @property
    def sizes(self) -> tuple[int, ...]:
        """As in `Network`: the layers of the decompressor."""
        weights = self.decompressor[0]
        return (weights[0].shape[2], *(w.shape[1] for w in weights))

    @property
    def parameter_count(self) -> int:
        """The number of weights and biases of all three networks."""
        networks = self.decompressor, self.stepper, self.projector
        return sum(array.size for layers in networks for arrays in layers for array in arrays)

    def wish(self, z: Array) -> Array:
        """(C, n) the features that standardised inputs z (C, X) wish for, standardised.

        They are kept within the range of the captured features, because the projector knows no others.
        """
        raw = z[:, self.columns] * self.x_std[self.columns] + self.x_mean[self.columns]
        within = np.clip(raw * self.weights, self.low, self.high)
        return np.ascontiguousarray((within - self.mean) * inverse_or_0(self.std), np.float32)

    def predict(self, x: Array, phase: Array) -> Array:
        """Y (C, Y) of the state that the projector finds for each row of x (C, X); the phase is ignored."""
        one = np.ones((len(x), 1), np.float32)
        state = forward(*self.projector, one, self.wish(standardise_inputs(self, x)))
        return forward(*self.decompressor, one, state)[:, : self.layout.y_size]

    def prepared(self, mode: str, storage: str) -> LearnedPredictor:
        """As in `Network`."""
        return LearnedPredictor(self, storage)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`. The decompressor takes the place of other kinds' layers."""
        predictor = LearnedPredictor(self, storage)
        sizes = {
            "form": LEARNED, "layers": len(self.decompressor[0]), "sets": 1, "features": len(self.columns),
            "every": self.every, "latent": self.latent, "stepper_layers": len(self.stepper[0]),
            "projector_layers": len(self.projector[0]),
        }  # fmt: skip
        values = {
            "weights": self.weights, "mean": self.mean, "std": self.std, "inverse": inverse_or_0(self.std),
            "low": self.low, "high": self.high,
        }  # fmt: skip
        stacks = predictor.decompressor.sections(), predictor.stepper.sections("step_")
        sections = {f"feature_{name}": array.astype(np.float32) for name, array in values.items()}
        sections["feature_columns"] = self.columns.astype(np.int32)
        return sizes, stacks[0] | stacks[1] | predictor.projector.sections("search_") | sections

    def onnx_outputs(self, g: Graph, z: Node, mode: str) -> Node:
        """As in `OnnxNetwork`: for each row the pose that the projector finds, without stepper and memory."""
        at = self.columns
        raw = g("Gather", z, at, axis=1) * (self.x_std[at] * self.weights) + self.x_mean[at] * self.weights
        within = g("Min", g("Max", raw, self.low), self.high)
        wish = (within - self.mean) * inverse_or_0(self.std)
        y = add_layers(g, *self.decompressor, add_layers(g, *self.projector, wish))
        y = g("Slice", y, [0], [self.layout.y_size], [1])
        return (y - self.y_mean) * inverse_or_0(self.y_std)


class LearnedPredictor(Predictor):
    """Learned motion matching prepared to run; a `hobble.models.network.Predictor`."""

    network: Learned

    def __init__(self, network: Learned, storage: str) -> None:
        super().__init__(network)
        self.decompressor, self.stepper, self.projector = (
            Stack(*layers, storage) for layers in (network.decompressor, network.stepper, network.projector)
        )
        self._transitions = Transitions(network.layout, network.halflife)
        self._states = slice(STATE, STATE + len(network.columns) + network.latent)

    def evaluate(self, z: Array, phase: Array, out: Array, memory: Array | None = None) -> None:
        """As in `Predictor`. memory: (C, M) float64 with M = `Network.memory_size`. With None or zeros, each
        character shows the pose that the projector finds for its inputs."""
        network, features = self.network, len(self.network.columns)
        if memory is None:
            memory = np.zeros((len(z), network.memory_size))
        states = memory[:, self._states]
        new = ~((memory[:, SHOWN] == 1) & np.isfinite(memory).all(axis=1))
        memory[new] = 0.0
        state = np.ascontiguousarray(states, np.float32)
        state += _run(self.stepper, state, state.shape[1])
        due = np.flatnonzero(new | ~(memory[:, SINCE] + 1 < network.every))
        memory[:, SINCE] += 1
        jumps = np.zeros(len(z), bool)
        if len(due):
            memory[due, SINCE] = 0
            wish = network.wish(z[due])
            found = _run(self.projector, wish, state.shape[1])
            here, there = (
                np.square((wish - s[:, :features]) * network.std).sum(axis=1) for s in (state[due], found)
            )
            jumps[due] = new[due] | (there < here)
        following = state.copy()
        if len(due):
            state[due] = np.where(jumps[due, None], found, state[due])
        shown = _run(self.decompressor, state, out.shape[1] + PHASE_OUTPUTS)
        jumps &= ~new
        offsets = self._transitions.of(memory[:, self._states.stop :])
        if jumps.any():
            would_come = _run(self.decompressor, following[jumps], shown.shape[1])
            changed = offsets[jumps]
            self._transitions.add(changed, would_come, shown[jumps])
            offsets[jumps] = changed
        out[:] = pose = shown[:, :-PHASE_OUTPUTS]
        self._transitions.advance(offsets, out)
        self._transitions.pull_phase(np.arctan2(shown[:, -2], shown[:, -1]) / (2 * np.pi), phase, out)
        out[new] = pose[new]
        states[:] = state
        memory[:, SHOWN] = 1


def _run(stack: Stack, inputs: Array, outputs: int) -> Array:
    out = np.empty((len(inputs), outputs), np.float32)
    stack.run(np.ones((len(inputs), 1), np.float32), inputs, out)
    return out
