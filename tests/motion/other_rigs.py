"""Rigs of other programs, studios and languages, built from clips of the 31 joints.

A rig is a text with a line `name|parent|joint` for each joint. The joint is one of the 31, or `ground`.
`+x,y,z` moves it by so many centimetres in that joint's own axes.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from tests.motion.scramble import SYLLABLES, Rig, Scramble, as_clip

SIDES = {"L": "Left", "R": "Right"}


def human(name: str, trunk: str, leg: str, arm: str) -> str:
    """A rig by names: `name=joint` of the trunk from the hips to the head, and of each limb.

    name: of a limb's joint, with {n} for its name and {l} or {L} for the side's letter.
    """
    chain, leg_joints, arm_joints = ([part.split("=") for part in text.split()] for text in (trunk, leg, arm))
    lines = [
        f"{own}|{above}|{joint}" for (above, _), (own, joint) in zip([("-", ""), *chain], chain, strict=False)
    ]
    chest = next(own for own, joint in reversed(chain) if joint == "Spine1")
    for letter, side in SIDES.items():
        for joints, last in ((leg_joints, chain[0][0]), (arm_joints, chest)):
            for word, joint in joints:
                own = name.format(n=word, l=letter.lower(), L=letter)
                lines.append(f"{own}|{last}|{side}{joint}")
                last = own
    return "\n".join(lines)


PLAIN = human(
    "{n}_{l}",
    "hips=Hips spine=Spine chest=Spine1 neck=Neck1 head=Head",
    "thigh=UpLeg shin=Leg foot=Foot toe=ToeBase",
    "shoulder=Shoulder upper_arm=Arm forearm=ForeArm hand=Hand",
)
# As the Master Motor Map of KIT has it: several joints in one place, one for each axis.
KIT = human(
    "{L}{n}",
    "root=Hips BPx=LowerBack BPy=LowerBack BTx=Spine1 BTy=Spine1 BLNx=Neck1 BLNy=Neck1 BUNx=Head",
    "Hx=UpLeg Hy=UpLeg Hz=UpLeg Kx=Leg Ax=Foot Ay=Foot Fx=ToeBase",
    "SCx=Shoulder Sx=Arm Sy=Arm Ex=ForeArm Ez=ForeArm Wx=Hand",
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


def both(
    clip: Clip, rig: str, folder: Path, make: Callable, **how: Any
) -> tuple[Clip, Clip, dict, dict[str, str]]:
    """Results for a clip and for it on another rig, the latter's report, and the names that both have."""
    other, names = rigged(clip, rig, **how)
    write_bvh(folder / "plain.bvh", clip, decimals=6)
    write_bvh(folder / "other.bvh", other, "YZX", decimals=8)
    return make(folder / "plain.bvh")[0], *make(folder / "other.bvh"), names
