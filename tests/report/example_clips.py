"""Made-up reports and terrain fits of clips in the documented formats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import save_npz, write_json
from hobble.core.skeleton import Skeleton
from tests.report.example_motion import GAITS, walker


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
