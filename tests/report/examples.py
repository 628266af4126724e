"""Made-up artefacts in the documented formats: a walker made by formulas, and plausible numbers."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.core import quat
from hobble.core.files import save_npz, write_json, write_text
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.rows.clip_rows import ClipRows, save_clip_rows
from hobble.rows.layout import RowLayout
from hobble.runtime.options import Runtime

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
STAGES = (
    "synthetic",
    "motion",
    "labels",
    "injury",
    "terrain",
    "database",
    "training",
    "runtime",
    "evaluation",
)
CLIPS = ("walk_straight", "walk_turns", "jog", "crouch", "stand", "strafe", "hurt_left_knee", "hurt_back")
LINKS = ("LeftUpLeg-LeftLeg", "RightLeg-RightFoot", "Hips-LowerBack")
RUNTIME = Runtime(steering=1.0)
HELD_OUT = ("walk_turns", "hurt_back")


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


def accuracy(clips: tuple[str, ...], rng: np.random.Generator) -> dict[str, Any]:
    """evaluation/accuracy.json."""
    rows = []
    for clip in clips:
        for name in (clip, f"{clip}_mirror"):
            held_out = clip in HELD_OUT
            mean = float(rng.uniform(0.03, 0.05) * (1.5 if held_out else 1))
            spread = {"p05": 0.3, "p25": 0.6, "p50": 0.9, "p75": 1.2, "p95": 2.1}
            rows.append(
                {
                    "clip": name,
                    "split": "held_out" if held_out else "train",
                    "frames": int(rng.integers(400, 1600)),
                    "mean": mean,
                    "sd": mean * 0.7,
                    "position_error_cm": 55 * mean,
                    **{key: mean * k for key, k in spread.items()},
                }
            )
    out: dict[str, Any] = {"configuration": "example", "joints": 31, "clips": rows}
    for split in ("train", "held_out"):
        chosen = [row for row in rows if row["split"] == split]
        mean = float(np.mean([row["mean"] for row in chosen]))
        out[split] = {
            "frames": 9000,
            "mean": mean,
            "sd": mean * 0.7,
            "position_error_cm": 55 * mean,
            "clips": len(chosen),
        }
    return out


def history(path: Path, passes: int = 20, sections: int = 10) -> None:
    """network/history.csv: errors that fall and settle."""
    rng = np.random.default_rng(3)
    blocks = (
        "root_velocity",
        "turn",
        "phase_change",
        "contacts",
        "joint_position",
        "joint_velocity",
        "joint_rotation",
    )
    lines = [
        "pass,section,samples,seconds,train_mse,held_out_mse," + ",".join(f"held_out_{b}" for b in blocks)
    ]
    for i in range(passes * sections):
        base = 0.22 + 0.9 * np.exp(-i / 12) + 0.25 * np.exp(-i / 70)
        values = [base * rng.uniform(0.97, 1.03), base * 1.06 * rng.uniform(0.99, 1.01)]
        values += [base * k * rng.uniform(0.98, 1.02) for k in (0.9, 1.6, 1.1, 0.8, 0.5, 1.3, 0.6)]
        numbers = ",".join(f"{v:.5f}" for v in values)
        lines.append(
            f"{i // sections + 1},{i % sections + 1},{(i + 1) * 20000},{(i + 1) * 4.1:.1f},{numbers}"
        )
    write_text(path, "\n".join(lines) + "\n")


def strip(seconds: float) -> dict[str, Any]:
    """The label strip of a clip in which a figure stands for a second and then walks."""
    t = np.linspace(0, seconds, 300)
    phase = [None if s < 1 else round((s * 1.02) % 1, 3) for s in t]
    walk = np.clip((t - 1) * 2, 0, 1)
    steps = np.arange(1, seconds - 1, 1 / 1.02)
    spans = {
        "right_heel": [[round(a, 2), round(a + 0.55, 2)] for a in steps],
        "right_toe": [[round(a + 0.08, 2), round(a + 0.62, 2)] for a in steps],
        "left_heel": [[round(a + 0.49, 2), round(a + 1.04, 2)] for a in steps],
        "left_toe": [[round(a + 0.57, 2), round(a + 1.11, 2)] for a in steps],
    }
    return {
        "seconds": [round(float(s), 3) for s in t],
        "contacts": {role: spans[role] for role in ("left_heel", "left_toe", "right_heel", "right_toe")},
        "landings": {"right": [float(a) for a in steps], "left": [float(a + 0.49) for a in steps]},
        "phase": phase,
        "gait": {"stand": [round(float(1 - w), 3) for w in walk], "walk": [round(float(w), 3) for w in walk]},
        "speed": [round(float(1.3 * w + 0.05 * np.sin(6 * s)), 3) for w, s in zip(walk, t, strict=True)],
    }


def clip_reports(folder: Path, clips: tuple[str, ...]) -> dict[str, list[str]]:
    """motion/, labels/ and injury/<clip>.json of every clip and its mirror; returns their paths."""
    rng = np.random.default_rng(5)
    paths: dict[str, list[str]] = {"motion": [], "labels": [], "channels": []}
    for clip in clips:
        for i, name in enumerate((clip, f"{clip}_mirror")):
            safe = f"{len(paths['motion']):03d}"
            frames = int(rng.integers(600, 1500))
            motion = {
                "clip": name,
                "source": f"{clip}.bvh",
                "sha256": f"{rng.integers(1 << 62):016x}" * 4,
                "bytes": frames * 1200,
                "source_frames": 2 * frames,
                "source_fps": 120.0,
                "frames": frames,
                "seconds": frames / 60,
                "unit": "5.6444 cm",
                "up": "Y",
                "repairs": ["frames 2331-2335: the root jumps by 212 cm; the clip ends before."]
                * (clip == "jog" and not i),
            }
            gait = next((g for g in ("jog", "crouch", "stand") if g in clip), "walk")
            labels = {
                "clip": name,
                "phase_source": "file",
                "gait_source": "file",
                "phase_zero": "right",
                "seconds": dict.fromkeys(GAITS, 0.0) | {"stand": 1.0, gait: frames / 60 - 1},
                "cycles": frames // 60,
                "cycles_dropped": 1,
                "warnings": ["2 steps are shorter than 5 frames and were dropped."] * (clip == "strafe"),
                "curves": strip(frames / 60),
            }
            side = "Right" if i else "Left"
            hurt = {
                "hurt_left_knee": {f"{side}UpLeg-{side}Leg": {"seconds": frames / 60, "highest": 7.0}},
                "hurt_back": {"Hips-LowerBack": {"seconds": frames / 90, "highest": 5.0}},
            }.get(clip, {})
            injury = {"clip": name, "channel": "injury", "values": hurt, "warnings": []}
            for key, value in (("motion", motion), ("labels", labels), ("channels", injury)):
                path = folder / key / f"{safe}.json"
                write_json(path, value)
                paths[key].append(str(path))
    return paths


def costs() -> dict[str, Any]:
    """pipeline.json."""
    seconds = (4.2, 9.5, 6.1, 3.0, 38.0, 21.0, 700.0, 12.0, 44.0)
    sizes = (3.1e7, 1.9e7, 4e6, 3e6, 8.2e7, 1.4e8, 1.2e7, 9e6, 4e5)
    stages = [
        {
            "stage": stage,
            "jobs": 1 if s > 30 else 16,
            "seconds": s,
            "longest": s / 3,
            "cpu_seconds": s,
            "max_rss_mb": 300.0,
            "files": 16,
            "bytes": int(b),
            "rules": [],
        }
        for stage, s, b in zip(STAGES, seconds, sizes, strict=True)
    ]
    return {
        "configuration": "example",
        "stages": stages,
        "total_seconds": sum(seconds),
        "total_bytes": int(sum(sizes)),
        "database": {"bytes": 29_957_048},
        "missing": ["results/example/benchmarks/runtime"],
        "machine": {"system": "Linux x86_64", "processor": "a processor", "cores": 2, "memory_gb": 24.0},
        "versions": {"python": "3.11.2"},
    }


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


def responsivity(rng: np.random.Generator, laps: int = 19) -> dict[str, Any]:
    """evaluation/responsivity.json."""
    cost = {"prepare": 0.02, "input": 0.05, "insert": 0.01, "predict": 0.31, "output": 0.06, "update": 0.04}

    def milliseconds() -> dict[str, Any]:
        steps = {step: ms * float(rng.uniform(0.9, 1.1)) for step, ms in cost.items()}
        total = sum(steps.values())
        spread = {"sd": 0.05, "median": total, "p99": 1.4 * total, "whole_call": 1.1 * total}
        return {**steps, "total": total, "spread": spread}

    entries = [
        {
            "lap": n,
            "finished": n != 4,
            "frames": 6800,
            "seconds": 113.3,
            "waypoints_reached": 6 if n != 4 else 5,
            "path_overshoot_cm": float(rng.uniform(80, 160)),
            "path_distance_cm": float(rng.uniform(10, 20)),
            "foot_slide_cm": float(rng.uniform(1, 2)),
            "steps": 210,
            "largest_turn_degrees": float(rng.uniform(8, 20)),
            "milliseconds": milliseconds(),
        }
        for n in range(1, laps + 1)
    ]
    return {
        "configuration": "example",
        "mode": "cubic",
        "track": {"waypoints": 6, "metres": 260.0},
        "laps": entries,
        "laps_finished": laps - 1,
        "waypoints_reached": 6 * laps - 1,
        "waypoints": 6 * laps,
        "path_overshoot_cm": 160.0,
        "foot_slide_cm": 1.4,
        "largest_turn_degrees": 19.0,
        "milliseconds": milliseconds(),
    }


def injury_sweep(rng: np.random.Generator, links: tuple[str, ...] = LINKS) -> dict[str, Any]:
    """evaluation/injury.json: every measure drifts with severity."""
    rows, responses = [], []
    for gait, speed in (("walk", 140.0), ("jog", 400.0)):
        for link in links:
            strength = float(rng.uniform(0.2, 1.0))
            sweep = []
            for severity in range(11):
                s = strength / (1 + np.exp(5 - severity))
                side = 1 if link.startswith("L") else -1
                row = {
                    "severity": float(severity),
                    "speed": speed * (1 - 0.5 * s),
                    "stance_left": 0.62 - 0.15 * s * side,
                    "stance_right": 0.62 + 0.05 * s * side,
                    "step_left": 60 - 20 * s,
                    "step_right": 60 - 12 * s,
                    "knee_left": 60 - 30 * s * (side > 0),
                    "knee_right": 60 - 30 * s * (side < 0),
                    "arm_left": 40.0,
                    "arm_right": 40 - 5 * s,
                    "lean_forward": 3 + 4 * s,
                    "lean_left": -4 * s * side,
                    "hip_height": 91 - 2 * s,
                    "from_healthy": 0.8 + 7 * s,
                    "from_worst": 7.8 * strength - 7 * s,
                    "largest_acceleration": 2 + s,
                    "settle_seconds": 0.8,
                }
                sweep.append(row)
            rows += [{"gait": gait, "link": link, **row} for row in sweep]
            rho = {"from_healthy": 1.0, "speed": -1.0}
            responses.append(
                {
                    "gait": gait,
                    "link": link,
                    "spearman": rho,
                    "from_healthy_cm": sweep[-1]["from_healthy"] - sweep[0]["from_healthy"],
                    "speed_share": sweep[-1]["speed"] / sweep[0]["speed"],
                    "settle_seconds": 0.8,
                    "after_healing_cm": 0.1,
                    "acceleration_share": 1.3,
                }
            )
    return {
        "configuration": "example",
        "applies": True,
        "links": list(links),
        "rows": rows,
        "responses": responses,
        "summary": {},
    }


def terrain(path: Path, skeleton: Skeleton, rng: np.random.Generator, flat: bool, frames: int = 300) -> str:
    """terrain/clips/<clip>.npz: ten grounds that agree where a foot stands, or one flat ground."""
    fits = 1 if flat else 10
    t = np.arange(frames)[:, None] / 60
    wave = 15 * np.sin(0.8 * t) + 4 * np.arange(fits) * np.sin(2 * np.pi * t) ** 2 * (not flat)
    heights = np.repeat((wave * (not flat)).reshape(-1, 1), 36, axis=1).astype(np.float32)
    cycles = frames // 60
    pictures: dict[str, Any] = {}
    if not flat:
        made = walker(skeleton, 180, 2.2)
        x, z = np.linspace(-150, 150, 24), np.linspace(-100, 500, 24)
        ground = 12 * np.sin(x[:, None] / 60) + 10 * np.cos(z[None] / 80)
        feet = [skeleton.role(r) for r in ("left_heel", "left_toe", "right_heel", "right_toe")]
        values = {
            "cycle": 1,
            "x": x,
            "z": z,
            "ground": ground,
            "soles": made["positions"][:, feet],
            "contacts": made["contacts"],
            "pose": made["positions"][[30, 90, 150]],
            "parents": np.array(skeleton.parents),
        }
        pictures = {f"picture0_{key}": np.asarray(value) for key, value in values.items()}
    save_npz(
        path,
        frame=np.arange(60, 60 + frames),
        cycle=np.arange(frames) // 60,
        fits=np.full(frames, fits),
        heights=heights,
        patch=np.zeros((cycles, 10), int),
        error=np.sort(rng.uniform(0, 5, (cycles, 10)), axis=1),
        foot_error=rng.uniform(0, 1, (cycles, 10, 2)),
        pictures=np.array(len(pictures) and 1),
        **pictures,
    )
    return str(path)


def write_all(
    folder: Path,
    skeleton: Skeleton,
    clips: tuple[str, ...] = CLIPS,
    injury: bool = True,
    terrain_names: list[str] | None = None,
) -> dict[str, Any]:
    """Every input of the report under `folder`; returns the arguments of `hobble.report.gather.gather`.

    terrain_names: of the terrain files, where the clips' names cannot be file names.
    """
    rng = np.random.default_rng(1)
    paths = clip_reports(folder, clips)
    splits = {
        name: "held_out" if clip in HELD_OUT else "train"
        for clip in clips
        for name in (clip, f"{clip}_mirror")
    }
    resolved = {
        "name": "example",
        "configuration": {"training": {"passes": 20}, "runtime": RUNTIME.model_dump()},
        "dataset": {"name": "made_up"},
    }
    write_text(folder / "configuration.yaml", yaml.safe_dump(resolved))
    write_json(folder / "accuracy.json", accuracy(clips, rng))
    write_json(folder / "responsivity.json", responsivity(rng))
    write_json(folder / "injury.json", injury_sweep(rng) if injury else {"applies": False, "reason": "none"})
    grounds = [
        terrain(folder / "terrain" / f"{name}.npz", skeleton, rng, flat="hurt" in clip)
        for name, clip in zip(terrain_names or clips, clips, strict=True)
    ]
    write_json(folder / "pipeline.json", costs())
    history(folder / "history.csv")
    weights(folder / "weights.npz", skeleton, links=injury)
    scenarios(folder / "scenarios.npz", skeleton, injury)
    return {
        "name": "example",
        "dataset": "made_up",
        "title": None,
        "splits": splits,
        "configuration": str(folder / "configuration.yaml"),
        "measured": [str(folder / f"{name}.json") for name in ("accuracy", "responsivity", "injury")],
        "pipeline": str(folder / "pipeline.json"),
        "history": str(folder / "history.csv"),
        "weights": str(folder / "weights.npz"),
        **paths,
        "terrain": grounds,
    }
