"""Rewrites a clip of the 31 joints on another rig, with every choice drawn at random from a seed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton, local_rotations

from .rig_names import SIDES, STYLES, SYLLABLES
from .zero_pose import RESTS, zero_pose

Array = np.ndarray
RATES = (120.0, 60.0, 30.0, 24.0, 50.0, 100.0)
UNITS = {"cm": 1.0, "m": 100.0, "mm": 0.1, "inch": 2.54, "CMU": 5.6444}


@dataclass(frozen=True)
class Scramble:
    """How a clip is rewritten. It holds everything that was chosen at random, so that a failure can be
    repeated.
    """

    seed: int
    style: str
    rest: str
    unit: str
    rate: float
    order: str
    z_up: bool
    left_handed: bool
    six: bool
    above: str
    twists: bool
    fingers: bool
    prop: bool
    toes: bool
    neck: bool
    lengths: float

    @classmethod
    def drawn(cls, seed: int) -> Scramble:
        """One of all scrambles at random, so that names and rest poses alternate."""
        rng = np.random.default_rng(seed)
        style = tuple(STYLES)[seed % len(STYLES)]
        return cls(
            seed,
            style,
            RESTS[(seed // len(STYLES) + seed) % len(RESTS)],
            str(rng.choice(list(UNITS))),
            float(rng.choice(RATES)),
            "".join(rng.permutation(list("XYZ"))),
            bool(rng.random() < 0.4),
            bool(rng.random() < 0.25),
            bool(rng.random() < 0.35),
            str(rng.choice(["", "", "still", "moving", "second hips"])),
            bool(rng.random() < 0.35),
            bool(rng.random() < 0.4),
            bool(rng.random() < 0.25),
            bool(rng.random() < 0.8),
            bool(rng.random() < 0.8),
            float(rng.choice([0.0, 0.0, 0.12])),
        )


@dataclass
class Rig:
    """The joints that are written: position and rotation of each in the world, in every frame."""

    names: list[str]
    parents: list[int]
    places: list[Array]
    turns: list[Array]

    def add(self, name: str, parent: int, place: Array, turn: Array) -> int:
        """One more joint, after all others."""
        self.names.append(name)
        self.parents.append(parent)
        self.places.append(place)
        self.turns.append(turn)
        return len(self.names) - 1


def stretched(clip: Clip, how: Scramble) -> Clip:
    """The clip with other bone lengths, the same on both sides, and with a straight neck if the neck joint
    will be removed.
    """
    rng = np.random.default_rng(how.seed + 1)
    skeleton = clip.skeleton
    offsets, rotations = skeleton.offsets.copy(), clip.rotations.copy()
    for j, name in enumerate(skeleton.joints):
        pair = name.replace("Right", "Left").replace("RHip", "LHip").replace("RThumb", "LThumb")
        if pair == name:
            factor = 1 + rng.uniform(-1, 1) * how.lengths
            for k in {j, skeleton.mirror_joints[j]}:
                offsets[k] *= factor
    if not how.neck or "Neck" not in STYLES[how.style]:
        gone = ("Neck",) if how.neck else ("Neck", "Neck1")
        for name in gone:
            rotations[:, skeleton.index(name)] = quat.IDENTITY
    for name in ("LHipJoint", "RHipJoint", "LowerBack", "LeftFingerBase", "RightFingerBase"):
        offsets[skeleton.index(name)] = 0.0
    return replace(clip, skeleton=replace(skeleton, offsets=offsets), rotations=rotations)


def written(clip: Clip, how: Scramble) -> tuple[Clip, dict[str, str]]:
    """The clip in the form of the other program, ready for `write_bvh`, and joint of the 31 -> its name
    there.
    """
    rng = np.random.default_rng(how.seed + 2)
    names = _style(clip, how, rng)
    rig = _joints_with_names(clip, names)
    _extras(rig, names, clip, how, rng)
    if how.above:
        _lifted(rig, names, how)
    first = np.argmin([0 if p < 0 else 1 for p in rig.parents])
    assert first == 0
    return as_clip(rig, clip, how, rng), names


def _style(clip: Clip, how: Scramble, rng: np.random.Generator) -> dict[str, str]:
    names = dict(STYLES[how.style])
    if how.style == "words":
        taken: set[str] = set()
        for joint in clip.skeleton.joints:
            while (word := "".join(rng.choice(SYLLABLES, 3))) in taken:
                pass
            taken.add(word)
            names[joint] = word
        for gone in (
            "LHipJoint",
            "RHipJoint",
            "Neck",
            "LeftFingerBase",
            "RightFingerBase",
            "LThumb",
            "RThumb",
        ):
            names.pop(gone)
    if not how.toes:
        names = {a: b for a, b in names.items() if "ToeBase" not in a}
    if not how.neck:
        names = {a: b for a, b in names.items() if a not in ("Neck", "Neck1")}
    return names


def _joints_with_names(clip: Clip, names: dict[str, str]) -> Rig:
    rig = Rig([], [], [], [])
    at: dict[str, int] = {}
    skeleton = clip.skeleton
    for j, name in enumerate(skeleton.joints):
        if name not in names:
            continue
        p = skeleton.parents[j]
        while p >= 0 and skeleton.joints[p] not in names:
            p = skeleton.parents[p]
        parent = at[skeleton.joints[p]] if p >= 0 else -1
        at[name] = rig.add(names[name], parent, clip.positions[:, j], clip.global_rotations[:, j])
    return rig


def _extras(rig: Rig, names: dict[str, str], clip: Clip, how: Scramble, rng: np.random.Generator) -> None:
    """Adds twist joints along bones, fingers, and a thing in one hand."""
    place = {joint: rig.names.index(name) for joint, name in names.items()}
    for side, _ in SIDES:
        hand, arm, fore, knee = (place[side + part] for part in ("Hand", "Arm", "ForeArm", "Leg"))
        if how.twists:
            thigh = place[side + "UpLeg"]
            middle = 0.5 * (rig.places[thigh] + rig.places[knee])
            along = rig.add(f"{rig.names[thigh]}.tw", thigh, middle, rig.turns[thigh])
            rig.parents[knee] = along
            half = 0.5 * (rig.places[fore] + rig.places[hand])
            rig.add(f"{rig.names[fore]}Roll", fore, half, rig.turns[hand])
            rig.add(f"{rig.names[arm]}Roll", arm, rig.places[arm], rig.turns[arm])
        if how.fingers:
            sign = 1.0 if side == "Left" else -1.0
            for k in range(3):
                last, reach = hand, 8.0
                for n in range(3):
                    off = quat.rotate(rig.turns[hand], np.array([sign * reach, 0.0, 2.0 * (k - 1)]))
                    name = (
                        f"{rig.names[hand]}_f{k}{n}"
                        if how.style != "words"
                        else f"{rig.names[hand]}{'aei'[k]}{'ptk'[n]}"
                    )
                    last = rig.add(name, last, rig.places[hand] + off, rig.turns[hand])
                    reach += 3.0
    if how.prop:
        hand = place["RightHand"]
        grip = rig.add("Prop" if how.style != "words" else "zzz", hand, rig.places[hand], rig.turns[hand])
        end = rig.places[hand] + quat.rotate(rig.turns[hand], np.array([0.0, 10.0, 95.0]))
        rig.add("PropEnd" if how.style != "words" else "zzzz", grip, end, rig.turns[hand])


def _lifted(rig: Rig, names: dict[str, str], how: Scramble) -> None:
    """Adds a joint above the hips, which stands or moves along on the floor, or separate hips for legs and
    spine.
    """
    hips = rig.places[0]
    frames = len(hips)
    still = np.broadcast_to(quat.IDENTITY, (frames, 4))
    if how.above == "second hips":
        low = rig.add("Pelvis2" if how.style != "words" else "olo", 0, hips, rig.turns[0])
        for joint in ("LHipJoint", "RHipJoint", "LeftUpLeg", "RightUpLeg"):
            if joint in names and rig.parents[j := rig.names.index(names[joint])] == 0:
                rig.parents[j] = low
        return
    ground = np.zeros_like(hips) if how.above == "still" else hips * [1, 0, 1]
    turn = still if how.above == "still" else quat.yaw(np.linspace(0, 1, frames))
    rig.names.insert(0, "Reference" if how.style != "words" else "aaa")
    rig.parents[:] = [-1, *(p + 1 for p in rig.parents)]
    rig.places.insert(0, ground)
    rig.turns.insert(0, turn)


def as_clip(rig: Rig, clip: Clip, how: Scramble, rng: np.random.Generator) -> Clip:
    """The motion of a rig as a clip at the rate, and in the unit and axes, that `how` says."""
    order = _sorted(rig)
    new = {old: i for i, old in enumerate(order)}
    names = tuple(rig.names[j] for j in order)
    parents = tuple(new.get(rig.parents[j], -1) for j in order)
    places = np.stack([rig.places[j] for j in order], axis=1)
    turns = np.stack([rig.turns[j] for j in order], axis=1)
    turns = quat.mul(turns, zero_pose(places, turns, parents, names, how.rest, rng))
    if how.z_up:
        up = quat.from_axis_angle(np.array([1.0, 0, 0]), np.pi / 2)
        places, turns = quat.rotate(up, places), quat.mul(up, turns)
    if how.left_handed:
        places, turns = places * [-1, 1, 1], turns * [1, 1, -1, -1]
    every = np.arange(0, len(places) - 1e-9, clip.fps / how.rate)
    places, turns = _sampled(places, turns, every)
    places = places / UNITS[how.unit]
    arms = quat.rotate(
        quat.inv(turns[:, [max(p, 0) for p in parents]]), places - places[:, [max(p, 0) for p in parents]]
    )
    offsets = np.median(arms, axis=0)
    skeleton = Skeleton("other", names, parents, offsets)
    moving = np.abs(arms - offsets).max() > 1e-5 or how.six
    moved = arms.copy()
    return Clip(
        "other",
        skeleton,
        how.rate,
        quat.continuous(local_rotations(skeleton, turns)),
        places[:, 0],
        moved if moving else None,
    )


def _sampled(places: Array, turns: Array, every: Array) -> tuple[Array, Array]:
    first = np.minimum(np.floor(every).astype(int), len(places) - 1)
    second = np.minimum(first + 1, len(places) - 1)
    share = (every - first)[:, None, None]
    return places[first] * (1 - share) + places[second] * share, quat.slerp(
        turns[first], turns[second], share[..., 0]
    )


def _sorted(rig: Rig) -> list[int]:
    """Joints with parents first, and children in their order."""
    out: list[int] = []

    def add(j: int) -> None:
        out.append(j)
        for k, p in enumerate(rig.parents):
            if p == j:
                add(k)

    add(rig.parents.index(-1))
    return out
