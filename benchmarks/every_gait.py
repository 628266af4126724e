"""How a network's character limps in every gait: running, turning, crouched, sideways, backward, on stairs.

    python benchmarks/every_gait.py WEIGHTS.npz [--only run slow gaits stairs variation]

The right thigh, shank or foot hurts. `run`: asked for 4.2 m/s, speed and the two steps by severity. `slow`:
speed if asked for .2 to .6 m/s. `gaits`: stance and range of the hurt knee at 10, and what share they are of
the straight walk's effect. `stairs`: how often a toe or heel is more than 1 cm inside a step, and whether the
good leg leads up and the bad one down. `variation`: with variation 1, standard deviations of stride time (s)
and knee ranges (degrees), and how far apart the ranges of left and right knee and arm are, mean of eight
seeds.
"""

import argparse
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.smooth import true_runs
from hobble.gait.cycles import CURVES, measure_cycles
from hobble.gait.profile import profile_of_walk
from hobble.measures.walks import SHORTEST_STANCE, SIDES, bend, feet_in_stance
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.feet import sole_heights
from hobble.runtime.leg import leg_joints

PARTS = {"thigh": "RightUpLeg-RightLeg", "shank": "RightLeg-RightFoot", "foot": "RightFoot-RightToeBase"}
WARM_UP = 300  # frames
KNEE, ARM = CURVES.index("knee_flexion_R"), CURVES.index("arm_forward_R")
STANDING = 0.35  # an ankle that is slower than this share of the body stands, as in `hobble.gait.cycles`
Bodies = list[tuple[str, float]]  # part and severity of each figure
TEN: Bodies = [("thigh", 0.0), *((part, 10.0) for part in PARTS)]
Ground = Callable[[Array, Array], Array]  # x, z -> height
Target = Callable[[int], dict[str, Any]]  # frame -> arguments of `next_pose`


class Walks:
    """C figures that follow a target: positions (F, C, J, 3), contacts (F, C, 4), phase (F, C)."""

    def __init__(
        self, network: Network, bodies: Bodies, target: Target, frames: int = 1200, **options: Any
    ) -> None:
        injury = np.zeros((len(bodies), len(network.channels["injury"])))
        for row, (part, severity) in zip(injury, bodies, strict=True):
            row[network.channels["injury"].index(PARTS[part])] = severity
        animation = ProceduralAnimation(network, characters=len(bodies), **options)
        poses = [animation.next_pose(injury=injury, **target(i)) for i in range(WARM_UP + frames)][WARM_UP:]
        self.skeleton = network.skeleton
        self.positions, self.contacts, self.phase = (
            np.array([getattr(pose, name) for pose in poses]) for name in ("positions", "contacts", "phase")
        )

    def at(self, role: str) -> Array:
        """(F, C, 3) positions of the joint with this role."""
        return self.positions[:, :, self.skeleton.role(role)]

    def stance_and_knee(self, figure: int) -> tuple[float, float]:
        """How much longer the left foot stands than the right, cycles; range of the right knee, degrees."""
        speed = {
            role: np.linalg.norm(np.diff(self.at(role)[:, figure, ::2], axis=0), axis=1)
            for role in ("hips", "left_heel", "right_heel")
        }
        knee = bend(*(self.at(f"right_{joint}")[:, figure] for joint in ("hip", "knee", "heel")))
        longer, ranges = [], []
        starts = np.flatnonzero(np.diff(self.phase[:, figure]) < -0.5) + 1
        for span in itertools.starmap(slice, itertools.pairwise(starts.tolist())):
            slow = STANDING * speed["hips"][span].mean()
            left, right = (np.mean(speed[f"{side}_heel"][span] < slow) for side in ("left", "right"))
            longer.append(left - right)
            ranges.append(np.ptp(knee[span]))
        return float(np.median(longer)), float(np.median(ranges))


def ahead(speed: float, gait: str = "walk", **more: Any) -> Target:
    return lambda i: {"target_velocity": (0.0, speed), "gait": gait, **more}


def turning(way: float) -> Target:
    angles = np.radians(way * np.arange(10_000))  # a degree a frame is 60 a second
    return lambda i: {"target_velocity": (2 * np.sin(angles[i]), 2 * np.cos(angles[i])), "gait": "walk"}


def aside(x: float, z: float) -> Target:
    return lambda i: {"target_velocity": (x, z), "facing": (0, 1), "gait": "walk"}


def flights(deep: float, high: float) -> Ground:
    """Flights of four steps up and down in turn, so deep and high (cm), with 2.4 m between them."""
    turn = 4 * deep + 240.0

    def heights(x: Array, z: Array) -> Array:
        at = np.maximum(z - 300.0, 0.0) % (2 * turn)
        up, down = np.clip(np.ceil(at / deep), 0, 4), np.clip(np.ceil((at - turn) / deep), 0, 4)
        return np.asarray(high * (up - down))

    return heights


GAITS: dict[str, Target] = {
    "straight": ahead(2.0),
    "turning left": turning(1.0),
    "turning right": turning(-1.0),
    "crouched": ahead(1.4, "crouch"),
    "to the left": aside(1.2, 0.0),
    "to the right": aside(-1.2, 0.0),
    "backward": aside(0.0, -1.2),
    "up a slope": ahead(2.0, terrain=lambda x, z: 0.15 * z),
    "down a slope": ahead(2.0, terrain=lambda x, z: -0.15 * z),
    "on stairs": ahead(1.6, terrain=flights(85, 15)),
}
STAIRS = ((85, 15), (45, 17), (29, 17))  # depth and height of the steps, cm


def in_every_gait(network: Network) -> None:
    print(f"{'at 10':15}" + "".join(f"{part + ': stance, knee (shares)':>34}" for part in PARTS))
    straight: list[Array] = []
    for name, target in GAITS.items():
        walks, line = Walks(network, TEN, target), f"{name:15}"
        healthy = walks.stance_and_knee(0)
        for i in range(len(PARTS)):
            stance, knee = walks.stance_and_knee(1 + i)
            effect = np.array([stance - healthy[0], 1 - knee / healthy[1]])
            if name == "straight":
                straight.append(effect)
            shares = effect / straight[i]
            line += f"{effect[0]:14.2f} {1 - effect[1]:5.2f}  ({shares[0]:5.2f} {shares[1]:5.2f})"
        print(line)


def running(network: Network) -> None:
    severities = [0.0, *np.arange(3.0, 11.0)]
    bodies = [(part, severity) for part in PARTS for severity in severities]
    walks = Walks(network, bodies, ahead(7.0, "jog"), 900)
    for k, part in enumerate(PARTS):
        speeds, steps = [], []
        for i in range(k * len(severities), (k + 1) * len(severities)):
            hips = walks.at("hips")[:, i, ::2]
            speeds.append(float(np.linalg.norm(hips[-1] - hips[0])) / len(hips) * 0.6)
            profile = profile_of_walk(measure_cycles(network.skeleton, walks.positions[:, i]))
            steps.append(profile["step_R"] / profile["step_L"])
        print(f"run, {part}: m/s at 0, 3 to 10 {' '.join(f'{speed:.2f}' for speed in speeds)};", end=" ")
        print(f"largest jump {-np.diff(speeds)[1:].min():.2f}, rise {np.diff(speeds)[1:].max():.2f}")
        print(f"    step onto the hurt foot / the sound one {' '.join(f'{step:.2f}' for step in steps)}")


def slowly(network: Network) -> None:
    for asked in (0.2, 0.3, 0.4, 0.5, 0.6):
        hips = Walks(network, TEN, ahead(asked / 0.6)).at("hips")[..., 2]
        reached = " ".join(f"{speed:.2f}" for speed in (hips[-1] - hips[0]) / len(hips) * 0.6)
        print(f"asked for {asked} m/s: healthy, then at 10 {', '.join(PARTS)}: {reached}")


def on_stairs(network: Network) -> None:
    print("stairs: toe or heel over 1 cm inside, share of frames; deepest; good leg first up, bad one down")
    bodies = [("thigh", 0.0), *((part, severity) for part in PARTS for severity in (5.0, 7.0, 10.0))]
    for deep, high in STAIRS:
        print(f"{high} by {deep} cm")
        for body, depth, counts in zip(bodies, *climb(network, bodies, flights(deep, high)), strict=True):
            (wrong_up, up), (wrong_down, down) = counts.tolist()
            print(f"  {body[0]:6} {body[1]:3.0f}: {np.mean(depth > 1):.4f} {depth.max():5.1f} cm;", end=" ")
            print(f"up {up} of {up + wrong_up}, down {down} of {down + wrong_down}")


def climb(network: Network, bodies: Bodies, ground: Ground) -> tuple[Array, np.ndarray]:
    """Of each of C bodies: cm by which a toe or heel is inside the ground in each frame (C, N), and how many
    steps (C, 2, 2) up and down it takes otherwise than people do, and as they do.
    """
    soles = dict(zip(("heel", "toe"), sole_heights(network, leg_joints(network.skeleton)), strict=True))
    inside: list[Array] = []
    led = np.zeros((len(bodies), 2, 2), int)
    for start in (0.0, -30.0, -60.0):
        walks = Walks(network, bodies, ahead(1.6, terrain=ground), 1800, position=(0.0, start))
        joints = [(walks.at(f"{side}_{joint}"), sole) for side in SIDES for joint, sole in soles.items()]
        inside.append(np.max([ground(*at[..., ::2].T).T + sole - at[..., 1] for at, sole in joints], axis=0))
        for i in range(len(bodies)):
            for rise, leads_left in first_on_a_step(walks, i, ground):
                led[i, int(rise < 0), int(leads_left == (rise > 0))] += 1
    return np.concatenate(inside).T, led


def first_on_a_step(walks: Walks, figure: int, ground: Ground) -> Iterator[tuple[float, bool]]:
    """(rise, whether the left foot is first) of each step of the stairs on which a figure stands."""
    standing, stances = feet_in_stance(walks.contacts[:, figure]), []
    for side, role in enumerate(("left_toe", "right_toe")):
        for start, end in true_runs(standing[:, side]):
            if end - start >= SHORTEST_STANCE:
                x, _, z = walks.at(role)[(start + end) // 2, figure]
                stances.append((start, z, float(ground(x, z)), side))
    furthest, level = -np.inf, None
    for _, z, height, side in sorted(stances):
        if level is not None and z > furthest and height != level:
            yield height - level, side == 0
        if z > furthest:
            furthest, level = z, height


def variation(network: Network) -> None:
    for severity in (0.0, 5.0, 10.0):
        walks = Walks(network, [("thigh", severity)] * 8, ahead(2.0), 1800, variation=1.0)
        rows = []
        for i in range(8):
            walk = measure_cycles(network.skeleton, walks.positions[:, i])
            knees = [np.array([np.ptp(c.curves[KNEE]) for c in side]) for side in (walk.left, walk.right)]
            # The curves of a left cycle are mirrored, so those of the right arm are of the left one.
            arms = [np.mean([np.ptp(c.curves[ARM]) for c in side]) for side in (walk.left, walk.right)]
            times = [c.scalars["stride_seconds"] for c in walk.right]
            apart = abs(knees[0].mean() - knees[1].mean()), abs(arms[0] - arms[1])
            rows.append((np.std(times), *map(np.std, knees), *apart))
        spreads = " ".join(f"{value:.3f}" for value in np.mean(rows, axis=0))
        print(f"variation, thigh {severity:g}: stride, left knee, right knee, sides: knee, arm: {spreads}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("network", type=Path, metavar="WEIGHTS.npz")
    parser.add_argument("--only", nargs="+", choices=MEASURES, default=list(MEASURES))
    options = parser.parse_args()
    network = load_network(options.network)
    for name in options.only:
        MEASURES[name](network)


MEASURES = {
    "run": running,
    "slow": slowly,
    "gaits": in_every_gait,
    "stairs": on_stairs,
    "variation": variation,
}

if __name__ == "__main__":
    main()
