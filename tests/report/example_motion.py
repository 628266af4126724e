"""Made-up motion in the documented formats: a walker made by formulas, its rows, and a small network."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.files import save_npz
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.rows.clip_rows import ClipRows, save_clip_rows
from hobble.rows.layout import RowLayout

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")


def walker(skeleton: Skeleton, frames: int, speed: float, limp: float = 0.0) -> dict[str, np.ndarray]:
    """Positions (F, J, 3), contacts (F, 4) and phase (F,) of a figure that walks along an arc."""
    t = np.arange(frames)
    phase = (t * 0.017) % 1.0
    angle = 2 * np.pi * phase
    rotations = np.tile(quat.IDENTITY, (frames, len(skeleton.joints), 1))

    def turn(role: str, axis: tuple[int, int, int], radians: np.ndarray) -> None:
        j = skeleton.role(role)
        rotations[:, j] = quat.mul(rotations[:, j], quat.from_axis_angle(np.array(axis), radians))

    for side, sign in (("left", 1.0), ("right", -1.0)):
        reach = 0.45 * (1 - 0.5 * limp * (side == "left"))
        turn(f"{side}_hip", (1, 0, 0), -reach * sign * np.sin(angle))
        turn(
            f"{side}_knee",
            (1, 0, 0),
            0.9 * np.clip(sign * np.cos(angle), 0, 1) ** 2 * (1 - 0.8 * limp * (side == "left")),
        )
        turn(f"{side}_shoulder", (0, 0, 1), np.full(frames, -sign * 1.25))
        turn(f"{side}_shoulder", (0, 1, 0), 0.35 * np.sin(angle))
        turn(f"{side}_elbow", (0, 1, 0), np.full(frames, -0.35 * sign))
    heading = 0.004 * np.maximum(0, t - frames // 3)
    rotations[:, 0] = quat.mul(
        quat.yaw(heading), quat.from_axis_angle(np.array([0, 0, 1.0]), 0.1 * limp * np.sin(angle))
    )
    step = speed * np.stack([np.sin(heading), np.zeros(frames), np.cos(heading)], axis=1)
    root = np.cumsum(step, axis=0) + np.array([0, 91.0, 0])
    root[:, 1] += 2 * np.cos(2 * angle)
    world, positions = forward_kinematics(skeleton, rotations, root)
    left = np.sin(angle + 0.4) < 0
    contacts = np.stack([left, left, ~left, ~left], axis=1).astype(float)
    return {"positions": positions, "rotations": world, "contacts": contacts, "phase": phase}


def scenarios(path: Path, skeleton: Skeleton, hurt: bool = True) -> None:
    """runtime/scenarios.npz with three or four scenarios."""
    arrays: dict[str, Any] = {}
    plans = {"walk": (600, 2.2, ""), "jog": (600, 5.0, ""), "stop_and_go": (300, 0.0, "")}
    if hurt:
        plans["left_knee"] = (480, 1.6, "LeftUpLeg-LeftLeg")
    for name, (frames, speed, link) in plans.items():
        made = walker(skeleton, frames, speed, 0.8 if link else 0.0)
        for key, value in made.items():
            arrays[f"{name}/{key}"] = value.astype(np.float32)
        arrays[f"{name}/swept_values"] = (10 * np.arange(frames) / frames * bool(link)).astype(np.float32)
        arrays[f"{name}/swept"] = np.array(("injury", link) if link else ("", ""))
        arrays[f"{name}/gait"] = np.array(["walk"] * frames)
    save_npz(
        path,
        names=np.array(list(plans)),
        joints=np.array(skeleton.joints),
        parents=np.array(skeleton.parents),
        fps=np.array(60.0),
        **arrays,
    )


def weights(path: Path, skeleton: Skeleton, units: int = 16, links: bool = True) -> None:
    """network/weights.npz of a small untrained network that stays near a standing pose and walks a little."""
    rng = np.random.default_rng(0)
    layout = RowLayout(len(skeleton.joints), channels=(("injury", len(skeleton.links)),) if links else ())
    sizes = (layout.x_size, units, units, layout.y_size)
    arrays: dict[str, Any] = {}
    for i, (a, b) in enumerate(pairwise(sizes)):
        arrays[f"W{i}"] = rng.normal(0, a**-0.5, size=(4, b, a)).astype(np.float32)
        arrays[f"b{i}"] = rng.normal(0, 0.1, size=(4, b)).astype(np.float32)
    made = walker(skeleton, 2, 0.0)
    mean, spread = np.zeros(layout.y_size), np.full(layout.y_size, 0.02)
    mean[layout.y_root_velocity], mean[layout.y_phase_change], mean[layout.y_contacts] = (
        (0.1, 2.0),
        0.017,
        0.5,
    )
    mean[layout.y_joint_position] = (made["positions"][0] * [1, 1, 0]).ravel()
    future = np.arange(layout.future)
    mean[layout.y_position] = np.concatenate([0.05 * future, 20.0 * future])
    mean[layout.y_direction] = np.repeat([0.0, 1.0], layout.future)
    spread[layout.y_joint_position], spread[layout.y_joint_velocity] = 3.0, 0.3
    spread[layout.y_contacts], spread[layout.y_phase_change] = 0.4, 0.003
    x_spread = np.full(layout.x_size, 50.0)
    x_spread[layout.x_gait], x_spread[layout.x_direction] = 1.0, 1.0
    for name, _ in layout.channels:
        x_spread[layout.x_channel(name)] = 5.0
    x_mean = np.zeros(layout.x_size)
    x_mean[layout.x_joint_position] = mean[layout.y_joint_position]
    meta = {
        "layout": layout.to_dict(),
        "skeleton": skeleton.to_dict(),
        "links": list(skeleton.link_names) if links else [],
        "gaits": list(GAITS),
    }
    statistics = {"Xmean": x_mean, "Xstd": x_spread, "Ymean": mean, "Ystd": spread}
    arrays |= {name: value.astype(np.float32) for name, value in statistics.items()}
    save_npz(path, **arrays, meta=np.array(json.dumps(meta)))


def rows(path: Path, skeleton: Skeleton, frames: int = 200, links: bool = True) -> str:
    """database/clips/<clip>.npz of a straight walk on flat ground; two cycles share a frame."""
    layout = RowLayout(len(skeleton.joints), channels=(("injury", len(skeleton.links)),))
    made = walker(skeleton, frames, 2.2)
    made["positions"][..., 2] += 7.0
    local = made["positions"] - made["positions"][:, :1] * [1, 0, 1]
    frame = np.concatenate([np.arange(60, 101), np.arange(100, 121), np.arange(150, 160)])
    frame = frame[frame < frames]
    y = np.zeros((len(frame), layout.y_size))
    y[:, layout.y_joint_position] = local[frame].reshape(len(frame), -1)
    y[:, layout.y_joint_rotation] = quat.log(made["rotations"])[frame].reshape(len(frame), -1)
    root = made["positions"][:, 0][:, [0, 2]]
    y[:, layout.y_root_velocity] = np.diff(root, axis=0)[frame]
    count = len(frame)
    save_clip_rows(
        path,
        ClipRows(
            clip=path.stem,
            layout=layout,
            skeleton=skeleton.to_dict(),
            x=np.zeros((count, layout.x_terrain.start)),
            y=y,
            p=made["phase"][frame],
            channels={"injury": np.zeros((count, len(skeleton.links)))},
            frame=frame,
            cycle=np.zeros(count, int),
            fits=np.ones(count, int),
            heights=np.zeros((count, 3 * layout.samples)),
            mean=np.zeros(count),
        ),
    )
    return str(path)


def hills(x: Any, z: Any) -> Any:
    """The ground that is called "rolling" in the page."""
    return 14 * np.sin(x / 170) * np.cos(z / 140) + 8 * np.sin((x + z) / 260)
