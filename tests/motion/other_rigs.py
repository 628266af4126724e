"""Rigs of other programs, studios and languages, built from clips of the 31 joints, and a dog.

A rig is a text with a line `name|parent|joint` for each joint. The joint is one of the 31, or `ground`.
`+x,y,z` moves it by so many centimetres in that joint's own axes.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from tests.motion.scramble import SYLLABLES, Rig, Scramble, as_clip, from_world

LEG, ARM = ("UpLeg", "Leg", "Foot", "ToeBase"), ("Shoulder", "Arm", "ForeArm", "Hand")
SIDES = {"L": "Left", "R": "Right"}


def human(name: str, trunk: str, leg: str, arm: str) -> str:
    """A rig by names. name: of a limb's joint, with {n} for the word and {l} for the side's letter.

    trunk: `name=joint` from the hips to the head. leg, arm: the words of the four joints of each.
    """
    lines, chain = [], [part.split("=") for part in trunk.split()]
    last = "-"
    for joint, place in chain:
        lines.append(f"{joint}|{last}|{place}")
        last = joint
    chest = next(joint for joint, place in chain if place == "Spine1")
    for letter, side in SIDES.items():
        for words, parts, top in ((leg, LEG, chain[0][0]), (arm, ARM, chest)):
            last = top
            for word, part in zip(words.split(), parts, strict=True):
                own = name.format(n=word, l=letter.lower())
                lines.append(f"{own}|{last}|{side}{part}")
                last = own
    return "\n".join(lines)


PLAIN = human(
    "{n}_{l}",
    "hips=Hips spine=Spine chest=Spine1 neck=Neck1 head=Head",
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
