"""Trains the networks of learned motion matching on the tables of `hobble.models.matching.build`.

After Holden, Kanoun, Perepichka, Popa, Learned Motion Matching (2020), section 4. First a compressor and the
decompressor are trained together, as an autoencoder of poses that also sees the features. Its latent vectors
are then those of the frames. The stepper is trained on stretches of consecutive frames, where it computes
each state from its last one. The projector is trained to map disturbed features to the state of the nearest
frame.
"""

import logging
import time
from collections.abc import Callable, Mapping
from itertools import count, pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.matching.build import findable_rows
from hobble.models.model import FinishedNetwork
from hobble.rows.layout import CONTACTS, RowLayout

log = logging.getLogger("hobble.training")

LEARNING_RATE = 1e-3
PAIRS, STRETCHES, WISHES = 128, 64, 256  # batch of each training
# Disturbed features whose nearest rows are found together, and for how many steps they serve.
POOL, STEPS_OF_A_POOL, CHUNK = 16384, 256, 64
STRETCH = 20  # frames of a stretch on which the stepper is trained
LEAST_STD = 1e-4  # of a column; the standardised values of one that varies less are 0
# Factors in the loss of the decompressor: the change of the pose from frame to frame, the size of the latent
# vectors, and their change, which makes them smooth enough for the stepper.
CHANGE, LATENT_SIZE, LATENT_CHANGE = 10.0, 0.001, 0.01
FOOT_WEIGHT = 3.0  # of the errors of heels and toes, whose sliding is seen first
REPORTS = 5  # lines in the log for each training

Options = Any  # `hobble.models.learned.LearnedOptions`, whose module imports this one
Tables = Mapping[str, Array]  # from `hobble.models.matching.build.read_tables`


def train(options: Options, tables: Tables, layout: RowLayout, skeleton: Skeleton) -> FinishedNetwork:
    """Train on all frames of the tables. The same seed gives the same network on the same kind of machine."""
    torch.manual_seed(options.seed)
    mean, std = tables["features"].mean(axis=0), tables["features"].std(axis=0)
    std[std < LEAST_STD] = 0.0
    features = torch.from_numpy((tables["features"] - mean) / np.where(std > 0, std, np.inf))
    feet = [skeleton.role(role) for role in CONTACTS]
    decompressor, latent = _train_decompressor(options, tables, layout, feet, features)
    state = torch.cat([features, latent], dim=1)
    stepper = _train_stepper(options, tables, state)
    projector = _train_projector(options, tables, layout, state, torch.from_numpy(std))
    arrays = {
        "columns": tables["columns"],
        "feature_weights": tables["feature_weights"],
        "feature_mean": mean,
        "feature_std": std,
        "feature_low": tables["features"].min(axis=0),
        "feature_high": tables["features"].max(axis=0),
        **_arrays("Dd", decompressor),
        **_arrays("Ss", stepper),
        **_arrays("Pp", projector),
    }
    meta = {"every": options.every, "halflife": options.halflife, "latent": options.latent}
    size = sum(array.size for array in arrays.values())
    words = f"decompressor, stepper and projector ({size:,} numbers) for {len(features):,} frames of clips"
    return FinishedNetwork("learned", arrays, words, meta)


def layers(*units: int) -> nn.Sequential:
    """Layers of these units, the inputs first, with an ELU between them."""
    parts: list[nn.Module] = []
    for inputs, outputs in pairwise(units):
        parts += [nn.Linear(inputs, outputs), nn.ELU()]
    return nn.Sequential(*parts[:-1])


def _arrays(letters: str, network: nn.Sequential) -> dict[str, Array]:
    """The arrays of a file: weights (out, in) and biases (out,) of each layer."""
    return {
        f"{letter}{number}": tensor.detach().numpy().copy()
        for number, layer in enumerate(_linear(network))
        for letter, tensor in zip(letters, (layer.weight, layer.bias), strict=True)
    }


def _optimise(name: str, options: Options, networks: list[nn.Module], loss: Callable[[], Tensor]) -> None:
    """Take `options.steps` steps of Adam. The learning rate falls to 0 along half a cosine wave."""
    parameters = [p for network in networks for p in network.parameters()]
    optimiser = torch.optim.Adam(parameters, LEARNING_RATE, fused=True)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, options.steps)
    began, total, each = time.perf_counter(), 0.0, max(1, options.steps // REPORTS)
    for step in range(1, options.steps + 1):
        optimiser.zero_grad()
        error = loss()
        error.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
        total += error.item()
        if step % each == 0:
            share, seconds = 100 * step // options.steps, time.perf_counter() - began
            log.info("%s: %d %% done, error %.4g, %.0f s", name, share, total / each, seconds)
            total = 0.0


def _starts(remaining: NDArray[Any], frames: int) -> Tensor:
    """The rows from which at least `frames` frames follow in the run; all with one, if no run is so long."""
    rows = np.flatnonzero(remaining >= frames)
    return torch.from_numpy(rows if len(rows) else np.flatnonzero(remaining >= min(1, remaining.max())))


def _linear(network: nn.Sequential) -> list[nn.Linear]:
    return [part for part in network if isinstance(part, nn.Linear)]


def _draw(rows: Tensor, count: int) -> Tensor:
    return rows[torch.randint(len(rows), (count,))]


def _standard_poses(tables: Tables, layout: RowLayout) -> tuple[Tensor, Array, Array]:
    """Y with sine and cosine of the phase, standardised, and the means and deviations.

    The columns of a block share their deviation, as in the database.
    """
    angle = 2 * np.pi * tables["phase"][:, None]
    poses = np.concatenate([tables["frames"], np.sin(angle), np.cos(angle)], axis=1)
    mean, std = poses.mean(axis=0, dtype=float), poses.std(axis=0, dtype=float)
    for block in layout.blocks("y").values():
        std[block] = std[block].mean()
    std[std < LEAST_STD] = 1.0
    return torch.from_numpy(((poses - mean) / std).astype(np.float32)), mean, std


def _train_decompressor(
    options: Options, tables: Tables, layout: RowLayout, feet: list[int], features: Tensor
) -> tuple[nn.Sequential, Tensor]:
    """The decompressor, from states to Y in raw units and the phase; the latent vectors (R, L) of all frames.

    The latent vectors are standardised. feet: indices of the joints that get FOOT_WEIGHT.
    """
    poses, mean, std = _standard_poses(tables, layout)
    columns, known = poses.shape[1], features.shape[1]
    compressor = layers(columns + known, options.decompressor_units, options.latent)
    decompressor = layers(known + options.latent, options.decompressor_units, columns)
    rows, weights = _starts(tables["remaining"], 1), torch.ones(columns)
    for block in (layout.y_joint_position, layout.y_joint_velocity):
        weights[block].view(-1, 3)[feet] = FOOT_WEIGHT

    def loss() -> Tensor:
        first = _draw(rows, PAIRS)
        pair = torch.cat([first, (first + 1).clamp(max=len(poses) - 1)])
        latent = compressor(torch.cat([poses[pair], features[pair]], dim=1))
        found = decompressor(torch.cat([features[pair], latent], dim=1))
        error, (now, after) = (found - poses[pair]) * weights, latent.chunk(2)
        change = torch.diff(torch.stack(error.chunk(2)), dim=0)
        return (
            error.square().mean()
            + CHANGE * change.square().mean()
            + LATENT_SIZE * latent.square().mean()
            + LATENT_CHANGE * (after - now).square().mean()
        )

    _optimise("decompressor", options, [compressor, decompressor], loss)
    with torch.no_grad():
        latent = compressor(torch.cat([poses, features], dim=1))
        centre, spread = latent.mean(dim=0), latent.std(dim=0, correction=0).clamp(min=LEAST_STD)
        first, last = _linear(decompressor)
        first.bias.add_(first.weight[:, known:] @ centre)
        first.weight[:, known:] *= spread
        scale = torch.from_numpy(std.astype(np.float32))
        last.weight.mul_(scale[:, None])
        last.bias.copy_(last.bias * scale + torch.from_numpy(mean.astype(np.float32)))
        return decompressor, (latent - centre) / spread


def _train_stepper(options: Options, tables: Tables, state: Tensor) -> nn.Sequential:
    """The stepper, from a state to its change until the next frame."""
    length = min(STRETCH, max(1, int(tables["remaining"].max())))
    rows, size = _starts(tables["remaining"], length), state.shape[1]
    follow = torch.from_numpy(np.flatnonzero(tables["remaining"] > 0))
    change = state[(follow + 1).clamp(max=len(state) - 1)] - state[follow] if len(follow) else state
    spread = change.std(dim=0, correction=0).clamp(min=LEAST_STD)
    stepper = layers(size, options.units, options.units, size)

    def loss() -> Tensor:
        first = _draw(rows, STRETCHES)
        present, total = state[first], torch.zeros(())
        for frame in range(1, length + 1):
            truth = state[(first + frame).clamp(max=len(state) - 1)]
            step = stepper(present)
            present = present + step * spread
            error = (present - truth) / spread
            total = total + error.square().mean() / frame**2
        return total / length

    _optimise("stepper", options, [stepper], loss)
    with torch.no_grad():
        *_, last = _linear(stepper)
        last.weight.mul_(spread[:, None])
        last.bias.mul_(spread)
    return stepper


def _train_projector(
    options: Options, tables: Tables, layout: RowLayout, state: Tensor, std: Tensor
) -> nn.Sequential:
    """The projector, from standardised features to the state of the findable frame with the nearest features.

    A frame's features are disturbed by noise of random size. Or the wishes (path, gait, ground and channels)
    move towards those of another frame, while the features of the pose stay.
    """
    features = state[:, : len(std)]
    rows = torch.from_numpy(findable_rows(tables["remaining"]))
    found, found_state = features[rows] * std, state[rows]
    squares, scale = found.square().sum(dim=1), std.square().sum().sqrt()
    of_pose = torch.from_numpy(
        np.isin(tables["columns"], np.r_[layout.x_joint_position, layout.x_joint_velocity])
    )
    projector = layers(len(std), *[options.units] * 3, state.shape[1])

    def wishes() -> tuple[Tensor, Tensor]:
        """POOL disturbed features, and the row in `found` that is nearest to each."""
        base, other = (features[torch.randint(len(features), (POOL,))] for _ in range(2))
        noise = torch.rand(POOL, 1) * torch.randn_like(base) * (std > 0)
        mixed = torch.where(of_pose, base, torch.lerp(base, other, torch.rand(POOL, 1)))
        wish = torch.where(torch.rand(POOL, 1) < 0.5, base + noise, mixed)
        nearest = [(squares - 2 * part @ found.T).argmin(dim=1) for part in (wish * std).split(CHUNK)]
        return wish, torch.cat(nearest)

    pool: list[tuple[Tensor, Tensor]] = []
    steps = count()

    def loss() -> Tensor:
        if next(steps) % STEPS_OF_A_POOL == 0:
            pool[:] = [wishes()]
        chosen = torch.randint(POOL, (WISHES,))
        wish, nearest = (part[chosen] for part in pool[0])
        result = projector(wish)
        apart, least = (
            torch.linalg.vector_norm((each - wish) * std, dim=1) / scale
            for each in (result[:, : len(std)], features[rows[nearest]])
        )
        return (result - found_state[nearest]).square().mean() + (apart - least).square().mean()

    _optimise("projector", options, [projector], loss)
    return projector
