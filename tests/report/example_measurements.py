"""Made-up measurements in the documented formats, with plausible numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.files import write_text

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
HELD_OUT = ("walk_turns", "hurt_back")
LINKS = ("LeftUpLeg-LeftLeg", "RightLeg-RightFoot", "Hips-LowerBack")


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


def responsivity(rng: np.random.Generator, laps: int = 19) -> dict[str, Any]:
    """evaluation/responsivity.json."""
    cost = {"prepare": 0.02, "input": 0.05, "insert": 0.01, "predict": 0.31, "output": 0.06, "update": 0.04}

    def milliseconds() -> dict[str, Any]:
        steps = {step: ms * float(rng.uniform(0.9, 1.1)) for step, ms in cost.items()}
        total = sum(steps.values())
        spread = {"sd": 0.05, "median": total, "p99": 1.4 * total, "whole_call": 1.1 * total}
        return {**steps, "total": total, "spread": spread, "sd": dict.fromkeys(cost, 0.01)}

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
            "predicted_turn_degrees": float(rng.uniform(8, 30)),
            "turns_held_back": 1,
            "milliseconds": milliseconds(),
        }
        for n in range(1, laps + 1)
    ]
    entry = {
        "mode": "cubic",
        "laps": entries,
        "laps_finished": laps - 1,
        "waypoints_reached": 6 * laps - 1,
        "waypoints": 6 * laps,
        "path_overshoot_cm": 160.0,
        "foot_slide_cm": 1.4,
        "largest_turn_degrees": 19.0,
        "predicted_turn_degrees": 29.0,
        "turns_held_back": laps,
        "milliseconds": milliseconds(),
    }
    track = {"waypoints": 6, "metres": 260.0}
    modes = [{**entry, "mode": "constant"}, entry]
    return {"configuration": "example", "track": track, **entry, "modes": modes}


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
                    "trained": True,
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
        **{
            key: []
            for key in ("falling", "strips", "second_sweep", "second_thresholds", "into_a_jog", "divided")
        },
    }
