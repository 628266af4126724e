"""Small networks of every kind whose figure walks badly, but uses every part of the runtime."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.speed_limits import Limits
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.models.local import Local, LocalOptions
from hobble.models.mann import Mann, MannOptions
from hobble.models.matching.network import Matching
from hobble.models.network import Network, TrainingFacts
from hobble.models.pfnn import Pfnn
from hobble.models.plain import Plain
from hobble.rows.layout import GAITS, RowLayout
from tests.models.matching.example import built

HIDDEN = (24, 20)


def shared_fields(skeleton: Skeleton, local_phases: int = 0) -> dict[str, Any]:
    """The fields of all kinds: two channels with limits, and outputs in which feet land and lift."""
    links = skeleton.link_names
    channels = ("injury", len(links)), ("mood", 3), ("guarding", 1)
    layout = RowLayout(len(skeleton.joints), channels=channels, local_phases=local_phases)
    rng = np.random.default_rng(5)
    y, spread = np.zeros(layout.y_size, np.float32), np.zeros(layout.y_size, np.float32)
    rest = np.tile([1.0, 0, 0, 0], (1, layout.joints, 1))
    y[layout.y_joint_position] = forward_kinematics(skeleton, rest, np.array([[0.0, 93.0, 0.0]]))[1].ravel()
    y[layout.y_root_velocity], y[layout.y_phase_change], y[layout.y_contacts] = (0, 1.5), 0.017, 0.7
    y[layout.y_position][layout.future :] = 1.5 * layout.step * np.arange(layout.future)
    y[layout.y_direction][layout.future :] = 1
    for block, size in {
        "root_velocity": 0.6, "turn": 0.01, "phase_change": 0.004, "contacts": 0.6, "position": 3.0,
        "direction": 0.1, "joint_position": 3.0, "joint_velocity": 0.8, "joint_rotation": 0.3,
        **({"local_phase": 0.5, "local_change": 0.02} if local_phases else {}),
    }.items():  # fmt: skip
        spread[layout.blocks("y")[block]] = size
    x_mean = rng.normal(0, 3, layout.x_size).astype(np.float32)
    x_mean[layout.x_channel("injury")] = x_mean[layout.x_channel("mood")] = 0.5
    x_std = np.full(layout.x_size, 8, np.float32)
    x_std[layout.x_joint_position.stop - 3 : layout.x_joint_position.stop] = 1e11  # an input without effect
    low, high = y - 3 * spread, y + 3 * spread
    facts = TrainingFacts(
        *(x_mean - 60, x_mean + 120, low, high, x_mean, y), start_phase=0.3, fastest=14.0
    )  # fmt: skip
    speeds = np.sort(rng.uniform(1, 9, (2, len(GAITS), len(links), 3)))[..., ::-1].copy()
    limits = {
        name: Limits(
            np.array([0, 0.4, 1]) * highest, speed[:, :columns], speed[:, :columns, 0].max(axis=1) / 1.3
        )
        for (name, columns), highest, speed in zip(layout.channels, (10.0, 1.0), speeds, strict=False)
    }
    return {
        "x_mean": x_mean, "x_std": x_std, "y_mean": y, "y_std": spread, "layout": layout,
        "skeleton": skeleton, "limits": limits,
        "channels": {"injury": links, "mood": ("happy", "sad", "angry"), "guarding": ("guarding",)},
        "training_facts": facts, "meta": {"exponents": {"injury": 0.42}},
    }  # fmt: skip


def layers(rng: np.random.Generator, sets: int, sizes: tuple[int, ...]) -> tuple[Any, Any]:
    """Random weights (K, out, in) and biases (K, out)."""
    pairs = list(zip(sizes[1:], sizes, strict=False))
    weights = tuple(rng.normal(0, n**-0.5, (sets, m, n)).astype(np.float32) for m, n in pairs)
    return weights, tuple(rng.normal(0, 0.3, (sets, m)).astype(np.float32) for m, _ in pairs)


def network_of(kind: str, skeleton: Skeleton, folder: Path) -> Network:
    """A network of a kind. folder: where files can be written."""
    given, rng = shared_fields(skeleton, 4 if kind == "local" else 0), np.random.default_rng(8)
    layout = given["layout"]
    sizes = (layout.x_size, *HIDDEN, layout.y_size)
    if kind == "matching":
        _, _, tables = built(skeleton, folder)
        named = {field.name: getattr(tables, field.name) for field in fields(Matching)}
        return Matching(**named | {"skeleton": skeleton})
    if kind == "learned":
        sizes_of = {"steps": 60, "units": 48, "decompressor_units": 64, "latent": 6}
        made = built(skeleton, folder, kind, **sizes_of)[2]
        # The made-up motion has nothing to do with the wishes, so a rounding error would grow from search to
        # search. A projector with a tenth of the weights lets it fade.
        weights, biases = made.projector
        return replace(made, skeleton=skeleton, projector=(tuple(0.1 * w for w in weights), biases))
    if kind == "plain":
        weights, biases = layers(rng, 1, (sizes[0] + 2, *sizes[1:]))
        return Plain(weights=weights, biases=biases, **given)
    weights, biases = layers(rng, 4, sizes)
    if kind == "pfnn":
        return Pfnn(weights=weights, biases=biases, **given)
    options, made_of = (LocalOptions(), Local) if kind == "local" else (MannOptions(), Mann)
    columns = np.array(options.gate_columns(layout, skeleton))
    gate_weights, gate_biases = layers(rng, 1, (len(columns), 16, 4))
    gate = {"gate_weights": gate_weights, "gate_biases": gate_biases, "columns": columns}
    return made_of(weights=weights, biases=biases, **gate, **given)
