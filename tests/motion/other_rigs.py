"""Rigs of other programs, studios and languages, built from clips of the 31 joints, and a dog.

A rig is a text with a line `name|parent|joint` for each joint. The joint is one of the 31, or `ground`.
`+x,y,z` moves it by so many centimetres in that joint's own axes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from tests.motion.scramble import SYLLABLES, Rig, Scramble, X, as_clip, from_world

LEG, ARM = ("UpLeg", "Leg", "Foot", "ToeBase"), ("Shoulder", "Arm", "ForeArm", "Hand")
SIDES = {"L": "Left", "R": "Right"}


def human(
    name: str, trunk: str, leg: str, arm: str, order: str = "LR", hips: str = "", more: str = ""
) -> str:
    """A rig by names. name: of a limb's joint, with {n} for the word and {L} or {l} for the side's.

    trunk: `name=joint` from the hips to the head. leg, arm: the words of the four joints of each.
    """
    lines, chain = [], [part.split("=") for part in trunk.split()]
    last = "-"
    for joint, place in chain:
        lines.append(f"{joint}|{last}|{place}")
        last = joint
    chest = next(joint for joint, place in chain if place == "Spine1")
    for side in order:
        for words, parts, top in ((leg, LEG, chain[0][0]), (arm, ARM, chest)):
            last = top
            for word, part in zip(words.split(), parts, strict=True):
                own = name.format(n=word, S=SIDES[side], L=side, l=side.lower(), J="左右"["LR".index(side)])
                lines.append(f"{own}|{last}|{SIDES[side]}{part}")
                last = own
    return "\n".join(lines)


TRUNK = "{}=Hips {}=Spine {}=Spine1 {}=Neck1 {}=Head"
PLAIN = human(
    "{n}_{l}",
    TRUNK.format("hips", "spine", "chest", "neck", "head"),
    "thigh shin foot toe",
    "shoulder upper_arm forearm hand",
)
# Pairs of chains that are no limbs: four joints of skirt on each side, twin tails of hair, wings, a tail.
TAIL = "\ntail1|hips|Hips+0,0,-8\ntail2|tail1|Hips+0,-5,-30\ntail3|tail2|Hips+0,-10,-55"
CLOTHES = TAIL + "".join(
    f"\nskirt_{s}|hips|Hips+{12 * x},-4,0\nskirt2_{s}|skirt_{s}|Hips+{14 * x},-24,0"
    f"\nskirt3_{s}|skirt2_{s}|Hips+{17 * x},-44,0\nskirt4_{s}|skirt3_{s}|Hips+{18 * x},-60,0"
    f"\nhair_{s}|head|Head+{7 * x},5,-3\nhair2_{s}|hair_{s}|Head+{14 * x},-15,-5"
    f"\nhair3_{s}|hair2_{s}|Head+{14 * x},-40,-6\nhair4_{s}|hair3_{s}|Head+{14 * x},-60,-6"
    f"\nwing_{s}|chest|Spine1+{6 * x},8,-6\nwing2_{s}|wing_{s}|Spine1+{36 * x},20,-10"
    f"\nwing3_{s}|wing2_{s}|Spine1+{84 * x},20,-10"
    for s, x in (("l", 1), ("r", -1))
)
GAME = "".join(
    f"\nthigh_twist_{s}|thigh_{s}|{side}UpLeg+0,-20,0\nik_hand_{s}|root|{side}Hand\nik_foot_{s}|root|{side}Foot"
    for s, side in (("l", "Left"), ("r", "Right"))
)
# As Rigify has it: a second leg that only moves the first, a longer chain to the heel than to the ball.
MECHANISM = "".join(
    f"\nmch_thigh_{s}|hips|{side}UpLeg\nmch_shin_{s}|mch_thigh_{s}|{side}Leg\nmch_foot_{s}|mch_shin_{s}|{side}Foot"
    f"\nheel_{s}|foot_{s}|{side}Foot+0,-6,-5\nheel_end_{s}|heel_{s}|{side}Foot+{6 * x},-6,-14"
    for s, side, x in (("l", "Left", 1), ("r", "Right", -1))
)
# As avatars of Second Life have them, and a rig nearly three times as wide as high.
HIND = "\nhind|hips|Hips+0,0,-6" + "".join(
    f"\nhind1_{s}|hind|Hips+{10 * x},0,-10\nhind2_{s}|hind1_{s}|Hips+{12 * x},-40,-8"
    f"\nhind3_{s}|hind2_{s}|Hips+{12 * x},-80,-8\nhind4_{s}|hind3_{s}|Hips+{12 * x},-86,2"
    f"\nwing_{s}|chest|Spine1+{10 * x},10,-10\nwing2_{s}|wing_{s}|Spine1+{16 * x},15,-14"
    f"\nwing3_{s}|wing2_{s}|Spine1+{230 * x},15,-14"
    for s, x in (("l", 1), ("r", -1))
)
ROLLS = "hips|-|Hips\nspine|hips|LowerBack\nspine1|spine|Spine\nspine2|spine1|Spine1\n" + "\n".join(
    ["neck|spine2|Neck", "neck1|neck|Neck1", "head|neck1|Head"]
    + [
        f"{s}{name}|{'' if top in ('hips', 'spine2') else s}{top}|{s}{joint}{move.format(x)}"
        for s, x in (("Left", 1), ("Right", -1))
        for name, top, joint, move in (
            ("Shoulder", "spine2", "Shoulder", ""),
            ("Arm", "Shoulder", "Arm", ""),
            ("ArmRoll", "Arm", "Arm", "+{}3,0,0"),
            ("ForeArm", "ArmRoll", "ForeArm", ""),
            ("ForeArmRoll", "ForeArm", "ForeArm", "+{}0,0,0"),
            ("Hand", "ForeArmRoll", "Hand", ""),
            ("UpLeg", "hips", "UpLeg", ""),
            ("UpLegRoll", "UpLeg", "UpLeg", "+0,-18,0"),
            ("Leg", "UpLegRoll", "Leg", ""),
            ("LegRoll", "Leg", "Leg", "+0,-18,0"),
            ("Foot", "LegRoll", "Foot", ""),
            ("ToeBase", "Foot", "ToeBase", ""),
        )
    ]
)

# As the Master Motor Map of KIT has it: several joints in one place, one for each axis.
KIT = "\n".join(
    f"{name}|{parent}|{joint}"
    for name, parent, joint in (
        *(("root", "-", "Hips"), ("BPx", "root", "LowerBack"), ("BPy", "BPx", "LowerBack")),
        *(("BTx", "BPy", "Spine1"), ("BTy", "BTx", "Spine1"), ("BLNx", "BTy", "Neck1")),
        *(("BLNy", "BLNx", "Neck1"), ("BUNx", "BLNy", "Head")),
        *(
            (letter + name, parent if parent in ("root", "BTy") else letter + parent, side + joint)
            for letter, side in SIDES.items()
            for name, parent, joint in (
                *(("Hx", "root", "UpLeg"), ("Hy", "Hx", "UpLeg"), ("Hz", "Hy", "UpLeg")),
                *(("Kx", "Hz", "Leg"), ("Ax", "Kx", "Foot"), ("Ay", "Ax", "Foot"), ("Fx", "Ay", "ToeBase")),
                *(("SCx", "BTy", "Shoulder"), ("Sx", "SCx", "Arm"), ("Sy", "Sx", "Arm")),
                *(("Ex", "Sy", "ForeArm"), ("Ez", "Ex", "ForeArm"), ("Wx", "Ez", "Hand")),
            )
        ),
    )
)


def nameless(rig: str) -> str:
    """The rig with names that only tell the side."""
    rng, new = np.random.default_rng(2), {"-": "-"}

    def word(name: str) -> str:
        if name not in new:
            new[name] = "".join(rng.choice(SYLLABLES, 3)) + (name[-2:] if name[-2:] in ("_l", "_r") else "")
        return new[name]

    lines = (line.split("|") for line in rig.splitlines())
    return "\n".join(f"{word(name)}|{word(parent)}|{joint}" for name, parent, joint in lines)


def rigged(clip: Clip, text: str, **how: Any) -> tuple[Clip, dict[str, str]]:
    """The clip on a rig, and joint of the 31 -> its name there. how: fields of a Scramble, such as `rest`."""
    rig, names = Rig([], [], [], []), {}
    for line in text.splitlines():
        name, parent, at = line.split("|")
        joint, _, move = at.partition("+")
        if joint == "ground":
            place, turn = np.zeros_like(clip.root), np.broadcast_to(quat.IDENTITY, (len(clip), 4))
        else:
            j = clip.skeleton.index(joint)
            turn = clip.global_rotations[:, j]
            off = np.array([float(x) for x in move.split(",")]) if move else np.zeros(3)
            place = clip.positions[:, j] + quat.rotate(turn, off)
            if not move:
                names.setdefault(joint, name)
        rig.add(name, -1 if parent == "-" else rig.names.index(parent), place, turn)
    plain = {"rest": "own", "unit": "cm", "rate": 60.0, "z_up": False, "left_handed": False, "six": False}
    return as_clip(rig, clip, replace(Scramble.drawn(3), **plain | how), np.random.default_rng(5)), names


def rezeroed(clip: Clip, joints: tuple[str, ...], turn: np.ndarray) -> Clip:
    """The same motion on a rig whose joints with these first letters are turned in the zero pose."""
    turned, places = clip.global_rotations.copy(), clip.positions
    for j, name in enumerate(clip.skeleton.joints):
        if name.startswith(joints):
            turned[:, j] = quat.mul(turned[:, j], turn)
    return from_world(clip.skeleton, clip.fps, places, turned)


def dog() -> Clip:
    """A dog that trots, four seconds."""
    time = np.arange(240) / 60
    joints = [("root", -1, (0, 0, 0)), ("spine1", 0, (0, 5, 25)), ("spine2", 1, (0, 0, 25))]
    joints += [("neck", 2, (0, 12, 12)), ("head", 3, (0, 10, 10))]
    bones = {
        "hind": (0, ((0, -3, 0), (0, -25, 3), (0, -22, -8), (0, -10, 6))),
        "front": (2, ((0, -5, 5), (0, -22, -4), (0, -24, 2), (0, -8, 5))),
    }
    swing = {}
    for limb, (hub, places) in bones.items():
        for side, x in (("L", 8), ("R", -8)):
            first = len(joints)
            swing[first] = 0.0 if (limb == "hind") == (side == "L") else np.pi
            for k, (_, y, z) in enumerate(places):
                parent = hub if k == 0 else len(joints) - 1
                joints.append((f"{limb}{k}_{side}", parent, (x if k == 0 else 0, y, z)))
    names, parents, offsets = zip(*joints, strict=True)
    skeleton = Skeleton("dog", names, parents, np.array(offsets, float))
    rotations = np.broadcast_to(quat.IDENTITY, (240, len(names), 4)).copy()
    for first, phase in swing.items():
        for k, angle in enumerate((0.4 * np.sin(6 * time + phase), 0.3 * np.cos(6 * time + phase) + 0.2)):
            rotations[:, first + k] = quat.from_axis_angle(X, angle)
    return Clip("dog", skeleton, 60.0, rotations, np.stack([0 * time, 0 * time + 58, 120 * time], axis=1))


def crawling(clip: Clip) -> Clip:
    """A figure of the 31 joints that crawls on hands and knees."""
    index, time = clip.skeleton.index, np.arange(len(clip)) / clip.fps
    rotations = np.broadcast_to(quat.IDENTITY, clip.rotations.shape).copy()
    rotations[:, 0] = quat.from_axis_angle(X, np.array(1.4))
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        swing = 0.35 * sign * np.sin(5 * time)
        rotations[:, index(f"{side}UpLeg")] = quat.from_axis_angle(X, swing - 1.4)
        rotations[:, index(f"{side}Leg")] = quat.from_axis_angle(X, 1.65 + 0.1 * sign * np.cos(5 * time))
        rotations[:, index(f"{side}Arm")] = quat.yaw(np.full(len(time), -1.4 * sign))
        rotations[:, index(f"{side}ForeArm")] = quat.yaw(-sign * (0.2 + 0.15 * np.sin(5 * time)))
    root = np.stack([0 * time, 0 * time + 45, 40 * time], axis=1)
    return replace(clip, rotations=rotations, root=root)
