"""Reads the side and the part of the body from the name of a joint."""

from __future__ import annotations

import re
from collections.abc import Sequence

# Words for left and right, in several languages.
LEFT = {
    "left",
    "l",
    "lft",
    "lt",
    "lf",
    "links",
    "linke",
    "linker",
    "linkes",
    "gauche",
    "izquierda",
    "izquierdo",
}
LEFT |= {"izquierdo", "sinistra", "sinistro", "sx", "hidari", "esq", "esquerda", "izq"}
RIGHT = {"right", "r", "rgt", "rt", "rght", "rechts", "rechte", "rechter", "rechtes", "droite", "droit"}
RIGHT |= {"derecha", "derecho", "destra", "destro", "dx", "migi", "dir", "direita", "der"}
# Parts of the body and the words for each. The first match counts, so longer words come first: "forearm"
# contains "arm". The meaning of `shoulder`, `arm`, `hip` and `leg` depends on the other joints of the limb:
# see `limb_parts`.
WORDS = (
    ("twist", ("twist", "roll", "tweak", "helper", "corrective", "muscle")),
    (
        "finger",
        ("finger", "thumb", "index", "middle", "ring", "pinky", "pinkie", "little", "palm", "metacarp"),
    ),
    ("finger", ("carpal", "inhand")),
    ("toe", ("toe", "ball", "orteil", "zeh")),
    ("clavicle", ("clavicle", "collar", "scapula", "clav")),
    (
        "forearm",
        ("forearm", "lowerarm", "unterarm", "lowarm", "loarm", "elbow", "armlower", "radius", "ulna"),
    ),
    ("upperarm", ("upperarm", "oberarm", "uparm", "upprarm", "armupper", "shldr", "humerus", "bicep")),
    (
        "shank",
        (
            "lowerleg",
            "unterschenkel",
            "lowleg",
            "loleg",
            "leglower",
            "calf",
            "shin",
            "shank",
            "knee",
            "tibia",
            "fibula",
        ),
    ),
    (
        "thigh",
        ("thigh", "oberschenkel", "cuisse", "muslo", "upperleg", "upleg", "legupper", "upprleg", "femur"),
    ),
    ("ankle", ("ankle", "heel")),
    ("wrist", ("wrist",)),
    ("hand", ("hand",)),
    ("foot", ("foot", "feet", "fuss")),
    ("shoulder", ("shoulder", "schulter", "hombro")),
    ("head", ("head", "skull", "kopf")),
    ("neck", ("neck", "cervical", "hals")),
    ("chest", ("chest", "thorax", "ribcage", "sternum", "torso")),
    ("hips", ("hips", "pelvis", "becken", "cog")),
    ("spine", ("spine", "back", "abdomen", "waist", "lumbar", "belly", "stomach", "vertebra")),
    ("arm", ("arm",)),
    ("leg", ("leg",)),
    ("hip", ("hip", "buttock", "femoral")),
)
CONTROLS = ("ik", "mch", "ctrl", "control", "ctl", "pole", "target", "effector")  # joints that move others
ENDS = ("end", "nub", "site", "tip", "top")  # joints that only mark the end of a bone


def words(name: str) -> list[str]:
    """The words of a name in lower case, split at capitals, digits and signs such as "_".

    >>> words("mixamorig:LeftUpLeg"), words("Bip01 L Thigh"), words("DEF-shin.R.001"), words("lShin")
    (['mixamorig', 'left', 'up', 'leg'], ['bip', 'l', 'thigh'], ['def', 'shin', 'r'], ['l', 'shin'])
    """
    return [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name.replace("ß", "ss"))]


def side_of(name: str) -> str | None:
    """The side that a name says: "left" or "right", or None if it says neither or both.

    >>> side_of("LeftUpLeg"), side_of("thigh.R"), side_of("rForeArm"), side_of("LLeg"), side_of("Spine")
    ('left', 'right', 'right', 'left', None)
    """
    found = words(name)
    left, right = any(w in LEFT for w in found), any(w in RIGHT for w in found)
    if not left and not right:
        text = name.lower()
        left, right = "left" in text or "左" in text, "right" in text or "右" in text
    if not left and not right and (glued := re.match(r"([LR])[A-Z][a-z]", name)):
        left, right = glued[1] == "L", glued[1] == "R"
    return None if left == right else "left" if left else "right"


def side_of_pair(name: str, other: str) -> str | None:
    """The side of a joint, by its own name and the name of its counterpart on the other side of the body.

    None if the names do not say it. Two names that differ only in one letter may say it together, though
    neither says it alone.

    >>> side_of_pair("lfemur", "rfemur"), side_of_pair("toe_r2", "toe_l2"), side_of_pair("armA", "armB")
    ('left', 'right', None)
    """
    own, across = side_of(name), side_of(other)
    if own is not None or across is not None:
        return None if own == across else own or ("left" if across == "right" else "right")
    if len(name) != len(other):
        return None
    unlike = [pair for pair in zip(name.lower(), other.lower(), strict=True) if pair[0] != pair[1]]
    return {("l", "r"): "left", ("r", "l"): "right"}.get(unlike[0]) if len(unlike) == 1 else None


def are_twins(name: str, other: str) -> bool:
    """Whether two names mean the same joint on the left and on the right.

    >>> are_twins("LeftToe2", "RightToe2"), are_twins("toe2.L", "toe1.R"), are_twins("lfemur", "rfemur")
    (True, False, True)
    """
    if side_of_pair(name, other) is None:
        return False
    if side_of(name) is None and side_of(other) is None:
        return True
    return _without_side(name) == _without_side(other)


def _without_side(name: str) -> list[str]:
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", re.sub("[左右]", " ", name))
    if glued := re.match(r"[LR](?=[A-Z][a-z])", name):
        parts = [parts[0].removeprefix(glued[0]), *parts[1:]]
    return [part.lower() for part in parts if part and part.lower() not in LEFT | RIGHT]


def part_of(name: str) -> str | None:
    """The part of the body that a name means: the first in WORDS with a word that the name contains, or None.

    >>> part_of("LeftForeArm"), part_of("RightShoulder"), part_of("Bip01 R Calf"), part_of("qwertz")
    ('forearm', 'shoulder', 'shank', None)
    """
    text = "".join(w for w in words(name) if w not in LEFT | RIGHT)
    for part, spellings in WORDS:
        if any(word in text for word in spellings):
            return part
    return None


def is_end(name: str) -> bool:
    """Whether a name says that the joint only marks the end of a bone, like HeadTop_End."""
    return any(w in ENDS for w in words(name))


def is_control(name: str) -> bool:
    """Whether a name says that the joint is not part of the body but moves other joints, like foot_ik.L."""
    return any(w in CONTROLS for w in words(name))


def limb_parts(names: Sequence[str]) -> dict[str, int]:
    """The parts of a limb, by names alone. names: the names of its joints, from the trunk outward.

    Returns part -> index in `names`, as far as the names say. The parts are thigh, shank, foot and toe, or
    clavicle, upperarm, forearm and hand.
    """
    parts = [part_of(name) for name in names]
    out: dict[str, int] = {}
    for i, part in enumerate(parts):
        before, after = parts[:i], parts[i + 1 :]
        if part == "shoulder":
            part = "clavicle" if {"upperarm", "arm"} & set(after) else "upperarm"
        elif part == "arm":
            part = "forearm" if "upperarm" in before else "upperarm"
        elif part in ("hip", "hips"):
            part = None if {"thigh", "leg"} & set(after) else "thigh"
        elif part == "leg":
            part = "shank" if {"thigh", "hip"} & set(before) or "leg" in before else "thigh"
        elif part == "ankle":
            part = "foot"
        elif part == "foot":
            part = "toe" if "ankle" in before else "foot"
        elif part == "wrist":
            part = "hand"
        elif part == "hand":
            part = "finger" if "wrist" in before else "hand"
        if part is not None and part not in out and not (is_end(names[i]) and part in ("hand", "foot")):
            out[part] = i
    return out
