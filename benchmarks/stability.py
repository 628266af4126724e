"""Stability of a network's character over ten simulated minutes.

    python benchmarks/stability.py results/holden/network [--minutes 10] [--seed 1] [--skeleton FILE]

Prints the worst values of each kind of motion, and exits with status 1 if the hips leave 60 to 110 cm, a
joint turns more than 60 degrees in a frame, feet slide 2 cm a step or more on average, or a number is not
finite.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.smooth import true_runs
from hobble.measures.motion_quality import skating
from hobble.measures.walks import SHORTEST_STANCE, STANCE, feet_in_stance, largest_turn
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.models.pfnn import OPTIONS
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.feet import sole_heights
from hobble.runtime.leg import leg_joints

FPS = 60
# kind of target -> (speed in cm a frame, whether to face a random direction, gait)
KINDS: dict[str, tuple[float, bool, str]] = {
    "walk": (2.5, False, "walk"),
    "jog": (7.0, False, "jog"),
    "crouch": (2.0, False, "crouch"),
    "strafe": (2.2, True, "walk"),
    "stop": (0.0, False, "walk"),
    "turn": (0.0, True, "walk"),
}
# The motion is stable if all values are within these limits. `stability` explains the names.
LIMITS = {
    "hips_lowest_cm": 60.0,
    "hips_highest_cm": 110.0,
    "largest_turn_degrees": 60.0,
    "foot_slide_cm": 2.0,
}


def foot_slide(toes: Array, contacts: Array) -> Array:
    """(N,) how far the toe slides over the ground in each of N stances, cm.

    The stances of the left foot come first. A stance is a run of at least SHORTEST_STANCE frames in which the
    toe has contact. toes: (F, 2, 3) positions of the left and right toe, cm. contacts: (F, 4).
    """
    out = []
    for side in range(2):
        moved = np.linalg.norm(np.diff(toes[:, side, ::2], axis=0), axis=1)
        for start, end in true_runs(contacts[:, 2 * side + 1] >= STANCE):
            if end - start >= SHORTEST_STANCE:
                out.append(moved[start : end - 1].sum())
    return np.array(out)


@dataclass(frozen=True)
class SteadyTarget:
    """A target that stays the same for `frames` frames. kind: a key of KINDS.

    velocity: (2,) cm a frame. facing: (2,) direction, or None for no target of the facing.
    """

    kind: str
    velocity: Array
    facing: Array | None
    gait: str
    frames: int


class WorstMotion(TypedDict):
    """The worst or mean values of some frames. `stability` explains the keys. None: nothing to measure."""

    frames: int
    finite: bool
    hips_lowest_cm: float
    hips_highest_cm: float
    largest_turn_degrees: float
    foot_slide_cm: float | None
    steps: int
    foot_down_share: float
    skating_cm: float | None
    stable: bool


class Stability(WorstMotion):
    """The values of all frames together. kinds: kind of target -> values of the frames with this kind."""

    minutes: float
    kinds: dict[str, WorstMotion]


def random_targets(minutes: float, seed: int = 1) -> Iterator[SteadyTarget]:
    """Targets of random kinds in random directions, each for 2 to 8 seconds, `minutes` in total."""
    rng = np.random.default_rng(seed)
    left = int(minutes * 60 * FPS)
    while left > 0:
        kind = str(rng.choice(list(KINDS)))
        frames = min(left, int(rng.integers(2 * FPS, 8 * FPS)))
        going, looking = rng.uniform(-np.pi, np.pi, 2)
        speed, faces, gait = KINDS[kind]
        facing = np.array([np.sin(looking), np.cos(looking)]) if faces else None
        yield SteadyTarget(kind, speed * np.array([np.sin(going), np.cos(going)]), facing, gait, frames)
        left -= frames


def stability(
    network: Network, minutes: float = 10.0, seed: int = 1, runtime: Runtime | None = None
) -> Stability:
    """Let a character follow random targets for `minutes`. Returns the values of all frames and of each kind.

    `frames`: number of frames. `finite`: whether all numbers are finite. `hips_lowest_cm`, `hips_highest_cm`:
    smallest and largest height of the hips above the ground. `largest_turn_degrees`: largest turn of a joint
    in one frame, in the world. `foot_slide_cm`: mean slide of a toe in a stance. `steps`: number of stances.
    `foot_down_share`: share of the frames in which at least one foot stands. `skating_cm`: how far a toe
    skates in a frame (`motion_quality.skating`), mean over feet and frames. `stable`: whether all values are
    within LIMITS.
    """
    animation = ProceduralAnimation(network, **dict(runtime or Runtime()))
    assert network.skeleton is not None
    role = network.skeleton.role
    toes = [role("left_toe"), role("right_toe")]
    toe_height = float(sole_heights(network, leg_joints(network.skeleton))[1])
    # For each kind: the measurements during each of its targets, as name -> array.
    measurements: dict[str, list[dict[str, Array]]] = {kind: [] for kind in KINDS}
    last = None  # rotations (1, J, 4) in the last frame of the target before
    for target in random_targets(minutes, seed):
        poses = [
            animation.next_pose(target.velocity, target.facing, target.gait) for _ in range(target.frames)
        ]
        rotations = np.array([p.rotations for p in poses])
        contacts = np.array([p.contacts for p in poses])
        toe_positions = np.array([p.positions[toes] for p in poses])
        above_ground = toe_positions - np.array([[0.0, p.root[1], 0.0] for p in poses])[:, None]
        measurements[target.kind].append(
            {
                "finite": np.array([np.isfinite(p.positions).all() for p in poses]),
                "hips": np.array([p.positions[role("hips"), 1] - p.root[1] for p in poses]),
                "turn": np.array(
                    [largest_turn(rotations if last is None else np.concatenate([last, rotations]))]
                ),
                "slide": foot_slide(toe_positions, contacts),
                "down": np.asarray(feet_in_stance(contacts).any(axis=1)),
                "skating": skating(above_ground, toe_height).ravel(),
            }
        )
        last = rotations[-1:]
    worst = _worst([of_target for of_kind in measurements.values() for of_target in of_kind])
    return {
        "minutes": minutes,
        **worst,
        "kinds": {kind: _worst(of_kind) for kind, of_kind in measurements.items() if of_kind},
    }


def _worst(measurements: list[dict[str, Array]]) -> WorstMotion:
    """The worst or mean values over some targets. measurements: for each target, name -> measured values."""
    joined = {key: np.concatenate([of_target[key] for of_target in measurements]) for key in measurements[0]}
    out: WorstMotion = {
        "frames": len(joined["hips"]),
        "finite": bool(joined["finite"].all() and np.isfinite(joined["turn"]).all()),
        "hips_lowest_cm": round(float(joined["hips"].min()), 2),
        "hips_highest_cm": round(float(joined["hips"].max()), 2),
        "largest_turn_degrees": round(float(joined["turn"].max()), 2),
        "foot_slide_cm": round(float(joined["slide"].mean()), 3) if len(joined["slide"]) else None,
        "steps": len(joined["slide"]),
        "foot_down_share": round(float(joined["down"].mean()), 3),
        "skating_cm": round(float(joined["skating"].mean()), 3) if len(joined["skating"]) else None,
        "stable": False,
    }
    out["stable"] = (
        out["finite"]
        and out["hips_lowest_cm"] >= LIMITS["hips_lowest_cm"]
        and out["hips_highest_cm"] <= LIMITS["hips_highest_cm"]
        and out["largest_turn_degrees"] <= LIMITS["largest_turn_degrees"]
        and (out["foot_slide_cm"] or 0.0) < LIMITS["foot_slide_cm"]
    )
    return out


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", help="weights.npz, a folder that holds it, or a folder of .bin files")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--mode", choices=OPTIONS.modes, default="cubic")
    parser.add_argument("--steering", type=float, default=2.0, help="0 is the original runtime")
    parser.add_argument(
        "--skeleton", default="config/skeletons/holden31.yaml", help="where the network has none"
    )
    options = parser.parse_args()
    try:
        network = load_network(options.network)
        if network.skeleton is None:
            network = load_network(options.network, options.skeleton)
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 2
    runtime = Runtime(mode=options.mode, steering=options.steering)
    found = stability(network, options.minutes, options.seed, runtime)
    print(f"{'':<8}{'frames':>8}{'hips, cm':>16}{'turn, deg':>11}{'slide, cm':>11}{'steps':>7}", end="")
    print(f"{'foot down':>11}{'skating, cm':>13}")
    for name, row in {**found["kinds"], "all": found}.items():
        hips = f"{row['hips_lowest_cm']:.1f} to {row['hips_highest_cm']:.1f}"
        slide = "-" if row["foot_slide_cm"] is None else f"{row['foot_slide_cm']:.2f}"
        print(
            f"{name:<8}{row['frames']:>8}{hips:>16}{row['largest_turn_degrees']:>11.1f}{slide:>11}"
            f"{row['steps']:>7}{row['foot_down_share']:>11.3f}{row['skating_cm']:>13.3f}"
        )
    print(f"{'stable' if found['stable'] else 'NOT STABLE'}: {LIMITS}")
    return 0 if found["stable"] else 1


if __name__ == "__main__":
    sys.exit(main())
