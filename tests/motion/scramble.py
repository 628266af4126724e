"""Clips rewritten as other programs would have written them: the oracle of everything that reads a rig.

A real clip of the 31 joints is written with other names, another zero pose, other bone lengths, more or fewer
joints, other axes and units, and at another rate; every choice is drawn at random from a seed. The world
positions of its joints are known, so the result for it must equal the result for the clip itself.

    python -m tests.motion.scramble ../shared/mocap/cmu --count 240
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton, local_rotations, path_to_root
from hobble.motion import ClipMotion
from hobble.motion.make import load_source, make_clip
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import load_skeleton

Array = np.ndarray
X, _, Z = np.eye(3)
SKELETONS = Path(__file__).parents[2] / "config" / "skeletons"
RATES = (120.0, 60.0, 30.0, 24.0, 50.0, 100.0)
UNITS = {"cm": 1.0, "m": 100.0, "mm": 0.1, "inch": 2.54, "CMU": 5.6444}
# A floor 3.1 cm off is moved to 0 and one 2.9 cm off is not. Such a difference is no error of the rig.
NEAR = 3.5  # cm
BALL = 1.2  # cm: allowed error of the height of a figure whose balls of the feet had to be guessed
RESTS = ("own", "a pose", "arms down", "lying", "facing x", "one axis", "one axis per side", "twisted")
RESTS += ("heap", "sitting")
SIDES = (("Left", "L"), ("Right", "R"))
TRUNK = ("Hips", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head")
LIMB = ("Shoulder", "Arm", "ForeArm", "Hand", "FingerBase", "HandIndex1", "Thumb")
LEG = ("HipJoint", "UpLeg", "Leg", "Foot", "ToeBase")


# Three lines for each program: its name and how it names limbs ({n} is the word, {side} the side, {S} and {s}
# its letter); names of TRUNK; words of LIMB and LEG. Joints without a name ("-") are left out.
PROGRAMS = """
mixamo|mixamorig:{side}{n}
mixamorig:Hips, mixamorig:Spine, mixamorig:Spine1, mixamorig:Spine2, -, mixamorig:Neck, mixamorig:Head
Shoulder, Arm, ForeArm, Hand, -, HandIndex1, HandThumb1, -, UpLeg, Leg, Foot, ToeBase
blender|{n}.{S}
spine, -, spine.001, spine.003, -, spine.004, spine.006
shoulder, upper_arm, forearm, hand, -, f_index.01, thumb.01, -, thigh, shin, foot, toe
rigify|{n}.{S}
DEF-spine, DEF-spine.001, DEF-spine.002, DEF-spine.003, -, DEF-spine.004, DEF-spine.006
DEF-shoulder, DEF-upper_arm, DEF-forearm, DEF-hand, -, -, -, -, DEF-thigh, DEF-shin, DEF-foot, DEF-toe
biped|Bip01 {S} {n}
Bip01 Pelvis, Bip01 Spine, Bip01 Spine1, Bip01 Spine2, -, Bip01 Neck, Bip01 Head
Clavicle, UpperArm, Forearm, Hand, -, Finger1, Finger0, -, Thigh, Calf, Foot, Toe0
rokoko|{side}{n}
Hips, Spine1, Spine2, Spine4, -, Neck, Head
Shoulder, Arm, ForeArm, Hand, -, Finger2Proximal, Finger1Metacarpal, -, Thigh, Shin, Foot, Toe
xsens|{side}{n}
Hips, Chest, Chest2, Chest4, -, Neck, Head
Collar, Shoulder, Elbow, Wrist, -, -, -, -, Hip, Knee, Ankle, Toe
motionbuilder|Bob:{side}{n}
Hips, Spine, Spine1, Spine2, -, Neck, Head
Shoulder, Arm, ForeArm, Hand, -, HandIndex1, HandThumb1, -, UpLeg, Leg, Foot, ToeBase
neuron|Robot_{side}{n}
Robot_Hips, Robot_Spine, Robot_Spine1, Robot_Spine2, -, Robot_Neck, Robot_Head
Shoulder, Arm, ForeArm, Hand, -, HandIndex, HandThumb1, -, UpLeg, Leg, Foot, -
smpl|{S}_{n}
Pelvis, Spine1, Spine2, Spine3, -, Neck, Head
Collar, Shoulder, Elbow, Wrist, -, Hand, -, -, Hip, Knee, Ankle, Foot
daz|{s}{n}
hip, abdomen, abdomen2, chest, -, neck, head
Collar, Shldr, ForeArm, Hand, -, Index1, Thumb1, Buttock, Thigh, Shin, Foot, Toe
"""


def _styles() -> dict[str, dict[str, str]]:
    """Program -> {joint of the 31: its name there}."""
    sided = [
        ((letter if part in ("HipJoint", "Thumb") else side) + part, k, {"side": side, "S": letter})
        for side, letter in SIDES
        for k, part in enumerate((*LIMB, *LEG))
    ]
    out = {"own": {joint: joint for joint in (*TRUNK, *(joint for joint, _, _ in sided))}}
    lines = PROGRAMS.strip().splitlines()
    for head, *lists in zip(lines[::3], lines[1::3], lines[2::3], strict=True):
        (program, style), (trunk, limbs) = head.split("|"), (line.split(", ") for line in lists)
        names = dict(zip(TRUNK, trunk, strict=True))
        for joint, k, side in sided:
            name = style.format(n=limbs[k], s=side["S"].lower(), **side)
            names[joint] = "-" if limbs[k] == "-" else name
        out[program] = {joint: name for joint, name in names.items() if name != "-"}
    return out | {"words": {}}


STYLES = _styles()
SYLLABLES = ("ka", "lo", "mi", "ru", "ta", "ne", "so", "vi", "pe", "du", "gra", "zo", "fi", "bu", "qua")


def zero_pose(
    places: Array, turns: Array, parents: Sequence[int], rest: str, rng: np.random.Generator
) -> Array:
    """(J, 4) rotation to add to each joint, so that a rig stands otherwise at angles of 0."""
    joints, out = range(len(parents)), np.tile(quat.IDENTITY, (len(parents), 1))

    def local(j: int, k: int) -> Array:  # (3,) where joint k is in the axes of joint j
        return np.median(quat.rotate(quat.inv(turns[:, j]), places[:, k] - places[:, j]), axis=0)

    bones = [[local(j, k) for k in joints if parents[k] == j] for j in joints]
    if rest in ("a pose", "arms down"):
        for sign in (1, -1):
            arm: list[int] = []  # from the shoulder on, if it points outward in the clip's own zero pose
            for j in joints:
                long = any(b[0] * sign > 15 and abs(b[1]) < 1 and abs(b[2]) < 0.8 for b in bones[j])
                if parents[j] in arm or long:
                    arm.append(j)
            out[arm] = quat.from_axis_angle(Z, np.radians(45.0 if rest == "a pose" else 80.0) * sign)
    elif rest == "lying":
        out[:] = quat.from_axis_angle(X, np.pi / 2)
    elif rest == "facing x":
        out[:] = quat.yaw(-np.pi / 2)
    elif rest == "sitting":
        thighs: list[int] = []  # joints that point down in the clip's own zero pose, but not their children
        for j in joints:
            if any(b[1] < -15 for b in bones[j]) and parents[j] >= 0 and parents[j] not in thighs:
                thighs.append(j)
        out[thighs] = quat.from_axis_angle(X, np.pi / 2)
    elif rest == "heap":
        out = quat.normalize(rng.normal(size=(len(joints), 4)))
    elif rest != "own":  # bones along one axis, or twisted about their own length
        for j in joints:
            bone = max(bones[j], key=np.linalg.norm, default=X)
            bone = X if np.linalg.norm(bone) < 1.0 else bone
            twisted = rest == "twisted"
            roll = rng.uniform(-np.pi, np.pi) if twisted else rng.choice([0.0, 0.5, 1.0, 1.5]) * np.pi
            out[j] = quat.from_axis_angle(bone / np.linalg.norm(bone), roll)
            if not twisted:
                axis = -X if rest == "one axis per side" and bone[0] < -0.5 else X
                out[j] = quat.mul(out[j], quat.between(axis, bone))
    return out


@dataclass(frozen=True)
class Scramble:
    """How a clip is rewritten: everything that was chosen at random, so that a failure can be repeated."""

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
        style, rest = tuple(STYLES)[seed % len(STYLES)], RESTS[(seed // len(STYLES) + seed) % len(RESTS)]
        unit, rate = str(rng.choice(list(UNITS))), float(rng.choice(RATES))
        order = "".join(rng.permutation(list("XYZ")))
        z_up, left_handed, six = (bool(rng.random() < share) for share in (0.4, 0.25, 0.35))
        above = str(rng.choice(["", "", "still", "moving", "second hips"]))
        more = (bool(rng.random() < share) for share in (0.35, 0.4, 0.25, 0.8, 0.8))
        lengths = [*more, float(rng.choice([0.0, 0.0, 0.12]))]
        return cls(seed, style, rest, unit, rate, order, z_up, left_handed, six, above, *lengths)


@dataclass
class Rig:
    """The joints that are written: position and rotation of each in the world, in every frame."""

    names: list[str]
    parents: list[int]
    places: list[Array]
    turns: list[Array]

    def add(self, *joint: object) -> int:
        """One more joint, after all others: its name, parent, place and turn."""
        for of_all, own in zip((self.names, self.parents, self.places, self.turns), joint, strict=True):
            of_all.append(own)
        return len(self.names) - 1


def stretched(clip: Clip, how: Scramble) -> Clip:
    """The clip with other bone lengths, the same on both sides, and a straight neck where a joint will go."""
    rng, skeleton = np.random.default_rng(how.seed + 1), clip.skeleton
    offsets, rotations = skeleton.offsets.copy(), clip.rotations.copy()
    for j, name in enumerate(skeleton.joints):
        if name == name.replace("Right", "Left").replace("RHip", "LHip").replace("RThumb", "LThumb"):
            factor = 1 + rng.uniform(-1, 1) * how.lengths
            for k in {j, skeleton.mirror_joints[j]}:
                offsets[k] *= factor
    if not how.neck or "Neck" not in STYLES[how.style]:
        for name in ("Neck",) if how.neck else ("Neck", "Neck1"):
            rotations[:, skeleton.index(name)] = quat.IDENTITY
    for name in ("LHipJoint", "RHipJoint", "LowerBack", "LeftFingerBase", "RightFingerBase"):
        offsets[skeleton.index(name)] = 0.0
    return replace(clip, skeleton=replace(skeleton, offsets=offsets), rotations=rotations)


def written(clip: Clip, how: Scramble) -> tuple[Clip, dict[str, str]]:
    """The clip as the other program has it, ready for `write_bvh`, and joint of the 31 -> its name there."""
    rng = np.random.default_rng(how.seed + 2)
    names = _style(clip, how, rng)
    rig, at, skeleton = Rig([], [], [], []), {-1: -1}, clip.skeleton
    for j, (name, parent) in enumerate(zip(skeleton.joints, skeleton.parents, strict=True)):
        at[j] = at[parent]  # a joint without a name is left out
        if name in names:
            at[j] = rig.add(names[name], at[parent], clip.positions[:, j], clip.global_rotations[:, j])
    _add_extras(rig, names, how)
    if how.above:
        _lift(rig, names, how)
    return as_clip(rig, clip, how, rng), names


def _style(clip: Clip, how: Scramble, rng: np.random.Generator) -> dict[str, str]:
    names = dict(STYLES[how.style])
    if how.style == "words":
        for joint in clip.skeleton.joints:
            while (word := "".join(rng.choice(SYLLABLES, 3))) in names.values():
                pass
            names[joint] = word
        unnamed = ("LHipJoint", "RHipJoint", "Neck", "LeftFingerBase", "RightFingerBase", "LThumb", "RThumb")
        names = {joint: name for joint, name in names.items() if joint not in unnamed}
    gone = (() if how.toes else ("LeftToeBase", "RightToeBase")) + (() if how.neck else ("Neck", "Neck1"))
    return {a: b for a, b in names.items() if a not in gone}


def _add_extras(rig: Rig, names: dict[str, str], how: Scramble) -> None:
    """Adds twist joints along bones, fingers, and a thing in one hand."""
    place, words = {joint: rig.names.index(name) for joint, name in names.items()}, how.style == "words"
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        hand, arm, fore, knee, thigh = (place[side + p] for p in ("Hand", "Arm", "ForeArm", "Leg", "UpLeg"))
        if how.twists:
            centre = 0.5 * (rig.places[thigh] + rig.places[knee])
            rig.parents[knee] = rig.add(f"{rig.names[thigh]}.tw", thigh, centre, rig.turns[thigh])
            half = 0.5 * (rig.places[fore] + rig.places[hand])
            rig.add(f"{rig.names[fore]}Roll", fore, half, rig.turns[hand])
            rig.add(f"{rig.names[arm]}Roll", arm, rig.places[arm], rig.turns[arm])
        for k in range(3 if how.fingers else 0):
            last = hand
            for n in range(3):
                off = quat.rotate(rig.turns[hand], np.array([sign * (8.0 + 3.0 * n), 0.0, 2.0 * (k - 1)]))
                name = rig.names[hand] + (f"{'aei'[k]}{'ptk'[n]}" if words else f"_f{k}{n}")
                last = rig.add(name, last, rig.places[hand] + off, rig.turns[hand])
    if how.prop:
        hand = place["RightHand"]
        grip = rig.add("zzz" if words else "Prop", hand, rig.places[hand], rig.turns[hand])
        end = rig.places[hand] + quat.rotate(rig.turns[hand], np.array([0.0, 10.0, 95.0]))
        rig.add("zzzz" if words else "PropEnd", grip, end, rig.turns[hand])


def _lift(rig: Rig, names: dict[str, str], how: Scramble) -> None:
    """Adds a joint above the hips that stands or moves along on the floor, or hips for the legs alone."""
    hips = rig.places[0]
    if how.above == "second hips":
        low = rig.add("olo" if how.style == "words" else "Pelvis2", 0, hips, rig.turns[0])
        for joint in ("LHipJoint", "RHipJoint", "LeftUpLeg", "RightUpLeg"):
            if joint in names and rig.parents[j := rig.names.index(names[joint])] == 0:
                rig.parents[j] = low
        return
    still = how.above == "still"
    rig.names.insert(0, "aaa" if how.style == "words" else "Reference")
    rig.parents[:] = [-1, *(p + 1 for p in rig.parents)]
    rig.places.insert(0, np.zeros_like(hips) if still else hips * [1, 0, 1])
    rig.turns.insert(0, quat.yaw(np.linspace(0, 0 if still else 1, len(hips))))


def as_clip(rig: Rig, clip: Clip, how: Scramble, rng: np.random.Generator) -> Clip:
    """The motion of a rig as a clip at the rate, and in the unit and axes, that `how` says."""
    # Each joint right after its parent and what hangs from the parent before it, as in a BVH file.
    order = sorted(range(len(rig.names)), key=lambda j: path_to_root(rig.parents, j)[::-1])
    parents = tuple(order.index(rig.parents[j]) if rig.parents[j] >= 0 else -1 for j in order)
    places, turns = (np.stack([of[j] for j in order], axis=1) for of in (rig.places, rig.turns))
    turns = quat.mul(turns, zero_pose(places, turns, parents, how.rest, rng))
    if how.z_up:
        up = quat.from_axis_angle(X, np.pi / 2)
        places, turns = quat.rotate(up, places), quat.mul(up, turns)
    if how.left_handed:
        places, turns = places * [-1, 1, 1], turns * [1, 1, -1, -1]
    every = np.arange(0, len(places) - 1e-9, clip.fps / how.rate)
    first = np.minimum(np.floor(every).astype(int), len(places) - 1)
    second, share = np.minimum(first + 1, len(places) - 1), (every - first)[:, None, None]
    places = (places[first] * (1 - share) + places[second] * share) / UNITS[how.unit]
    turns = quat.slerp(turns[first], turns[second], share[..., 0])
    skeleton = Skeleton("other", tuple(rig.names[j] for j in order), parents, np.zeros((len(order), 3)))
    return from_world(skeleton, how.rate, places, turns, how.six)


def from_world(skeleton: Skeleton, fps: float, places: Array, turns: Array, six: bool = False) -> Clip:
    """A clip of joints whose places and rotations in the world are known. six: with all positions."""
    above = [max(p, 0) for p in skeleton.parents]
    arms = quat.rotate(quat.inv(turns[:, above]), places - places[:, above])
    skeleton = replace(skeleton, offsets=np.median(arms, axis=0))
    moving = np.abs(arms - skeleton.offsets).max() > 1e-5 or six
    rotations = quat.continuous(local_rotations(skeleton, turns))
    return Clip("other", skeleton, fps, rotations, places[:, 0], arms if moving else None)


@dataclass(frozen=True)
class Outcome:
    """The result for a scrambled file: `off`, (N,) cm for each of `names`, or why it was refused."""

    how: Scramble
    names: dict[str, str]
    off: Array | None
    refused: str = ""
    said: str = ""  # on what is uncertain

    @property
    def right(self) -> bool:
        """Within 1 cm on average."""
        return self.off is not None and float(self.off.mean()) <= 1.0


def source_of(file: Path, frames: int | None = None) -> Clip:
    """A file of the 31 joints, or its first frames, on its own rig."""
    clip = load_source(
        read_bvh(file), load_skeleton(SKELETONS / "holden31.yaml"), SKELETONS, ClipMotion()
    ).clip
    return replace(clip, rotations=clip.rotations[:frames], root=clip.root[:frames])


def outcome(file: Path, seed: int, folder: Path, frames: int | None = None) -> Outcome:
    """Scramble a file of the 31 joints, or its first frames, and compare its clip with the plain file's."""
    how, target = Scramble.drawn(seed), SKELETONS / "holden31.yaml"
    clip = stretched(source_of(file, frames), how)
    rewritten, names = written(clip, how)
    write_bvh(folder / "plain.bvh", clip, decimals=6)
    write_bvh(folder / "other.bvh", rewritten, how.order, decimals=8)
    # Nothing but names tells a figure from its mirror image: of words, it has to be said.
    hand = ("left" if how.left_handed else "right") if how.style == "words" else "auto"
    try:
        (first, one), (second, two) = (
            make_clip(folder / f"{name}.bvh", target, SKELETONS, name, "holden31", options)
            for name, options in (("plain", ClipMotion()), ("other", ClipMotion(handedness=hand)))
        )
    except HobbleError as error:
        return Outcome(how, names, None, str(error))
    lowered = floor_of(two["repairs"]) - floor_of(one["repairs"])
    if abs(lowered) <= NEAR + (0.0 if "LeftToeBase" in names else BALL):
        second = replace(second, root=second.root + np.array([0.0, lowered, 0.0]))
    return Outcome(how, names, compare(first, second, names), said=" ".join(two["unsure"]))


def floor_of(repairs: Sequence[str]) -> float:
    """The height at which a clip's floor was found, if it was moved to 0."""
    found = re.search(r"The floor lies at (-?[\d.]+) cm; the clip was moved", " ".join(repairs))
    return float(found[1]) if found else 0.0


def compare(first: Clip, second: Clip, names: dict[str, str]) -> Array:
    """(N,) mean distance in centimetres of each joint that both have.

    A rig without toes does not show how high its ankles are above the balls of its feet. So the error of the
    whole figure's height, up to BALL, is subtracted.
    """
    frames = min(len(first), len(second))
    joints = [first.skeleton.index(name) for name in names]
    apart = second.positions[:frames, joints] - first.positions[:frames, joints]
    if "LeftToeBase" not in names:
        apart[..., 1] -= np.clip(np.median(apart[..., 1]), -BALL, BALL)
    return np.linalg.norm(apart, axis=-1).mean(axis=0)


def main() -> None:
    """Scramble as many clips as requested, and print the outcome of each that is not right."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path, help="clips of the 31 joints")
    for name, default in (("--count", 240), ("--first", 0), ("--frames", None)):
        parser.add_argument(name, type=int, default=default)
    given = parser.parse_args()
    files, outcomes = sorted(given.folder.glob("*.bvh")), []
    for seed in range(given.first, given.first + given.count):
        file = files[seed * 7 % len(files)]
        with tempfile.TemporaryDirectory() as folder:
            outcomes.append(one := outcome(file, seed, Path(folder), given.frames))
        if not one.right:
            print(seed, file.stem, one.refused or one.off.mean(), one.said, one.how, flush=True)
    done = [one for one in outcomes if one.off is not None]
    off = np.array([one.off.mean() for one in done])
    silent = sum(not one.right and not one.said for one in done)
    print(
        f"{(off <= 1).sum()} within 1 cm, {(off > 1).sum()} further off ({silent} without a word), "
        f"{len(outcomes) - len(done)} refused; median {np.median(off):.2f}, most {off.max():.2f} cm"
    )


if __name__ == "__main__":
    main()
