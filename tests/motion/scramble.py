"""Clips rewritten as other programs would have written them: the oracle of everything that reads a rig.

A real clip of the 31 joints is written with other names, another zero pose, other bone lengths, more or fewer
joints, other axes and units, and at another rate. The world positions of its joints are known, so the result
for it must equal the result for the clip itself.

    python -m tests.motion.scramble ../shared/mocap/cmu --count 240
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.motion.options import ClipMotion

Array = np.ndarray
SIDES = (("Left", "L"), ("Right", "R"))
NEAR = 3.5  # cm: a floor 3.1 cm off is put at 0, and one 2.9 off is not, which says nothing of a rig
BALL = 3.0  # cm: how much higher or lower a figure may stand whose balls of the feet had to be guessed
TRUNK = ("Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head")
LIMB = ("Shoulder", "Arm", "ForeArm", "Hand", "FingerBase", "HandIndex1", "Thumb")
LEG = ("HipJoint", "UpLeg", "Leg", "Foot", "ToeBase")


def _names(
    trunk: Sequence[str | None], limb: Sequence[str | None], leg: Sequence[str | None], side: Callable
):
    """Joint of the 31 -> its name in another program. Joints without a name are left out."""
    out = dict(zip(TRUNK, trunk, strict=True))
    for mine, letter in SIDES:
        prefix = {"HipJoint": letter, "Thumb": letter}
        for part, name in zip((*LIMB, *LEG), (*limb, *leg), strict=True):
            out[prefix.get(part, mine) + part] = None if name is None else side(name, mine)
    return {a: b for a, b in out.items() if b is not None}


def _prefixed(text: str):
    return lambda name, side: text.format(name=name, side=side, s=side[0].lower(), S=side[0])


STYLES = {
    "own": {name: name for name in _names(TRUNK, LIMB, LEG, lambda n, s: s[0] + n if n in ("HipJoint", "Thumb") else s + n).values()},  # noqa: E501
    "mixamo": _names(
        ("mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2", None, "mixamorig:Neck", "mixamorig:Head"),  # noqa: E501
        ("Shoulder", "Arm", "ForeArm", "Hand", None, "HandIndex1", "HandThumb1"),
        (None, "UpLeg", "Leg", "Foot", "ToeBase"), _prefixed("mixamorig:{side}{name}")),
    "blender": _names(
        ("spine", None, "spine.001", "spine.003", None, "spine.004", "spine.006"),
        ("shoulder", "upper_arm", "forearm", "hand", None, "f_index.01", "thumb.01"),
        (None, "thigh", "shin", "foot", "toe"), _prefixed("{name}.{S}")),
    "rigify": _names(
        ("DEF-spine", "DEF-spine.001", "DEF-spine.002", "DEF-spine.003", None, "DEF-spine.004", "DEF-spine.006"),  # noqa: E501
        ("DEF-shoulder", "DEF-upper_arm", "DEF-forearm", "DEF-hand", None, None, None),
        (None, "DEF-thigh", "DEF-shin", "DEF-foot", "DEF-toe"), _prefixed("{name}.{S}")),
    "biped": _names(
        ("Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Spine2", None, "Bip01 Neck", "Bip01 Head"),
        ("Clavicle", "UpperArm", "Forearm", "Hand", None, "Finger1", "Finger0"),
        (None, "Thigh", "Calf", "Foot", "Toe0"), _prefixed("Bip01 {S} {name}")),
    "rokoko": _names(
        ("Hips", "Spine1", "Spine2", "Spine4", None, "Neck", "Head"),
        ("Shoulder", "Arm", "ForeArm", "Hand", None, "Finger2Proximal", "Finger1Metacarpal"),
        (None, "Thigh", "Shin", "Foot", "Toe"), _prefixed("{side}{name}")),
    "xsens": _names(
        ("Hips", "Chest", "Chest2", "Chest4", None, "Neck", "Head"),
        ("Collar", "Shoulder", "Elbow", "Wrist", None, None, None),
        (None, "Hip", "Knee", "Ankle", "Toe"), _prefixed("{side}{name}")),
    "motionbuilder": _names(
        ("Hips", "Spine", "Spine1", "Spine2", None, "Neck", "Head"),
        ("Shoulder", "Arm", "ForeArm", "Hand", None, "HandIndex1", "HandThumb1"),
        (None, "UpLeg", "Leg", "Foot", "ToeBase"), _prefixed("Bob:{side}{name}")),
    "neuron": _names(
        ("Robot_Hips", "Robot_Spine", "Robot_Spine1", "Robot_Spine2", None, "Robot_Neck", "Robot_Head"),
        ("Shoulder", "Arm", "ForeArm", "Hand", None, "HandIndex", "HandThumb1"),
        (None, "UpLeg", "Leg", "Foot", None), _prefixed("Robot_{side}{name}")),
    "smpl": _names(
        ("Pelvis", "Spine1", "Spine2", "Spine3", None, "Neck", "Head"),
        ("Collar", "Shoulder", "Elbow", "Wrist", None, "Hand", None),
        (None, "Hip", "Knee", "Ankle", "Foot"), _prefixed("{S}_{name}")),
    "daz": _names(
        ("hip", "abdomen", "abdomen2", "chest", None, "neck", "head"),
        ("Collar", "Shldr", "ForeArm", "Hand", None, "Index1", "Thumb1"),
        ("Buttock", "Thigh", "Shin", "Foot", "Toe"), _prefixed("{s}{name}")),
    "words": {},
}  # fmt: skip
SYLLABLES = ("ka", "lo", "mi", "ru", "ta", "ne", "so", "vi", "pe", "du", "gra", "zo", "fi", "bu", "qua")
RESTS = (
    "own",
    "a pose",
    "arms down",
    "lying",
    "facing x",
    "one axis",
    "one axis per side",
    "twisted",
    "heap",
    "sitting",
)
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
    rig = _told(clip, names)
    _extras(rig, names, clip, how, rng)
    if how.above:
        _lifted(rig, names, how)
    first = np.argmin([0 if p < 0 else 1 for p in rig.parents])
    assert first == 0
    return _as_clip(rig, clip, how, rng), names


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


def _told(clip: Clip, names: dict[str, str]) -> Rig:
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


def _as_clip(rig: Rig, clip: Clip, how: Scramble, rng: np.random.Generator) -> Clip:
    order = _sorted(rig)
    new = {old: i for i, old in enumerate(order)}
    names = tuple(rig.names[j] for j in order)
    parents = tuple(new.get(rig.parents[j], -1) for j in order)
    places = np.stack([rig.places[j] for j in order], axis=1)
    turns = np.stack([rig.turns[j] for j in order], axis=1)
    turns = quat.mul(turns, _zero(places, turns, parents, names, how, rng))
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


def _zero(
    places: Array, turns: Array, parents: Sequence[int], names: Sequence[str], how: Scramble, rng
) -> Array:
    """(J, 4) additional rotation of each joint, which gives the rig another zero pose."""
    n = len(parents)
    none = np.broadcast_to(quat.IDENTITY, (n, 4)).copy()
    x, z = np.eye(3)[0], np.eye(3)[2]
    if how.rest == "own":
        return none
    if how.rest in ("a pose", "arms down"):
        angle = np.radians(45.0 if how.rest == "a pose" else 80.0)
        for side, sign in (("Left", 1), ("Right", -1)):
            for j in _arm_of(names, parents, places, turns, side):
                none[j] = quat.from_axis_angle(z, np.array(angle * sign))
        return none
    if how.rest == "lying":
        return np.broadcast_to(quat.from_axis_angle(x, np.array(np.pi / 2)), (n, 4)).copy()
    if how.rest == "facing x":
        return np.broadcast_to(quat.yaw(-np.pi / 2), (n, 4)).copy()
    if how.rest == "sitting":
        bent = quat.from_axis_angle(x, np.array(np.pi / 2))
        for j in _thighs(parents, places, turns):
            none[j] = bent
        return none
    if how.rest == "heap":
        return quat.normalize(rng.normal(size=(n, 4)))
    for j in range(n):
        below = [k for k in range(n) if parents[k] == j]
        bones = [
            np.median(quat.rotate(quat.inv(turns[:, j]), places[:, k] - places[:, j]), axis=0) for k in below
        ]
        bone = max(bones, key=np.linalg.norm, default=x)
        if np.linalg.norm(bone) < 1.0:
            bone = x
        roll = (
            rng.choice([0.0, 0.5, 1.0, 1.5]) * np.pi if how.rest != "twisted" else rng.uniform(-np.pi, np.pi)
        )
        spin = quat.from_axis_angle(bone / np.linalg.norm(bone), np.array(roll))
        if how.rest == "twisted":
            none[j] = spin
            continue
        axis = -x if how.rest == "one axis per side" and bone[0] < -0.5 else x
        none[j] = quat.mul(spin, quat.between(axis, bone))
    return none


def _local(places: Array, turns: Array, j: int, k: int) -> Array:
    return np.median(quat.rotate(quat.inv(turns[:, j]), places[:, k] - places[:, j]), axis=0)


def _thighs(parents: Sequence[int], places: Array, turns: Array) -> list[int]:
    """Joints that point down in the clip's own zero pose, as do their children."""
    out = []
    for j in range(len(parents)):
        for k in (k for k in range(len(parents)) if parents[k] == j):
            bone = _local(places, turns, j, k)
            if bone[1] < -15 and parents[j] >= 0 and not any(parents[j] == o for o in out):
                out.append(j)
    return out


def _arm_of(
    names: Sequence[str], parents: Sequence[int], places: Array, turns: Array, side: str
) -> list[int]:
    """The joints of one arm from the shoulder on, if they point outward in the clip's own zero pose."""
    sign = 1 if side == "Left" else -1
    out: list[int] = []
    for j in range(len(parents)):
        below = [k for k in range(len(parents)) if parents[k] == j]
        bones = [_local(places, turns, j, k) for k in below]
        long = any(b[0] * sign > 15 and abs(b[1]) < 1 and abs(b[2]) < 0.8 for b in bones)
        if parents[j] in out or long:
            out.append(j)
    return out


@dataclass(frozen=True)
class Outcome:
    """The result for a scrambled file: `off`, (N,) cm for each of `names`, or why it was refused. said: the
    note about what is uncertain.
    """

    how: Scramble
    names: dict[str, str]
    off: Array | None
    refused: str = ""
    said: str = ""

    @property
    def right(self) -> bool:
        """Within 1 cm on average."""
        return self.off is not None and float(self.off.mean()) <= 1.0

    def __str__(self) -> str:
        if self.off is None:
            return f"refused: {self.refused[:200]} {self.how}"
        worst = sorted(zip(self.off, self.names, strict=True), reverse=True)[:4]
        parts = ", ".join(f"{name} {x:.1f}" for x, name in worst)
        return f"{self.off.mean():.2f} cm ({parts}) {'said ' if self.said else ''}{self.how}"


def outcome(file: Path, seed: int, folder: Path, frames: int | None = None) -> Outcome:
    """Scramble a file of the 31 joints, make a clip of it and of the file itself, and compare the two.

    frames: how many of the clip's first frames are taken.
    """
    from hobble.core.bvh import write_bvh
    from hobble.core.errors import HobbleError
    from hobble.motion.file_motion import load_source
    from hobble.motion.make import make_clip
    from hobble.motion.read import read_bvh
    from hobble.motion.rig import load_skeleton

    maps = Path(__file__).parents[2] / "config" / "skeletons"
    options, how, target = ClipMotion(), Scramble.drawn(seed), maps / "holden31.yaml"
    clip = load_source(read_bvh(file), load_skeleton(target), maps, options).clip
    part = slice(0, frames)
    clip = stretched(replace(clip, rotations=clip.rotations[part], root=clip.root[part]), how)
    plain, other = folder / "plain.bvh", folder / "other.bvh"
    write_bvh(plain, clip, decimals=6)
    told, names = written(clip, how)
    write_bvh(other, told, how.order, decimals=8)
    try:
        first, one = make_clip(plain, target, maps, "plain", "holden31", options)
        # Nothing but names tells a figure from its mirror image: of words, it has to be said.
        hand: Literal["auto", "right", "left"] = "left" if how.left_handed else "right"
        said = ClipMotion(handedness=hand) if how.style == "words" else options
        second, two = make_clip(other, target, maps, "other", "holden31", said)
    except HobbleError as error:
        return Outcome(how, names, None, str(error))
    lowered = floor_of(two) - floor_of(one)
    if abs(lowered) <= NEAR + (0.0 if "LeftToeBase" in names else BALL):
        second = replace(second, root=second.root + np.array([0.0, lowered, 0.0]))
    return Outcome(how, names, compare(first, second, names), said=" ".join(two["unsure"]))


def floor_of(report: Mapping[str, Any]) -> float:
    """The height at which a clip's floor was found, if it was moved to 0."""
    found = (
        re.match(r"The floor lies at (-?[\d.]+) cm; the clip was moved", text) for text in report["repairs"]
    )
    return next((float(match[1]) for match in found if match), 0.0)


def main() -> None:
    """Scramble as many clips as requested, and print the outcome of each that is not right."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, help="clips of the 31 joints")
    parser.add_argument("--count", type=int, default=240)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--frames", type=int)
    parser.add_argument("--seeds", type=int, nargs="+", help="these alone, in place of --first and --count")
    given = parser.parse_args()
    files = sorted(given.folder.glob("*.bvh"))
    all_of_them = []
    for seed in given.seeds or range(given.first, given.first + given.count):
        file = files[seed * 7 % len(files)]
        with tempfile.TemporaryDirectory() as folder:
            one = outcome(file, seed, Path(folder), given.frames)
        all_of_them.append(one)
        if not one.right:
            print(f"{seed} {file.stem} {one}", flush=True)
    done = [one for one in all_of_them if one.off is not None]
    off = np.array([one.off.mean() for one in done])
    silent = sum(not one.right and not one.said for one in done)
    print(
        f"{len(all_of_them)} scrambled: {(off <= 1).sum()} within 1 cm, {(off > 1).sum()} further off "
        f"({silent} without a word, {(off > 2).sum()} more than 2 cm), "
        f"{len(all_of_them) - len(done)} refused; median {np.median(off):.2f}, most {off.max():.2f} cm"
    )


def compare(first: Clip, second: Clip, names: dict[str, str]) -> Array:
    """(N,) mean distance in centimetres of each joint that both have.

    A rig without toes does not tell how high its ankles are above the balls of its feet: how much higher or
    lower all of the figure stands for that, BALL at most, is taken off.
    """
    frames = min(len(first), len(second))
    joints = [first.skeleton.index(name) for name in names]
    apart = second.positions[:frames, joints] - first.positions[:frames, joints]
    if "LeftToeBase" not in names:
        apart[..., 1] -= np.clip(np.median(apart[..., 1]), -BALL, BALL)
    return np.linalg.norm(apart, axis=-1).mean(axis=0)


if __name__ == "__main__":
    main()
