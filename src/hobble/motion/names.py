"""Tells from the names of joints which side and which part of the body they are."""

import re
from collections.abc import Sequence
from functools import lru_cache

# Words for left and right, in several languages.
LEFT, RIGHT = (
    frozenset(text.split())
    for text in (
        "left l lft lt lf links linke linker linkes gauche izquierda izquierdo izq sinistra sinistro sx "
        "hidari esq esquerda",
        "right r rgt rt rght rechts rechte rechter rechtes droite droit derecha derecho der destra destro dx "
        "migi dir direita",
    )
)
# Part of the body -> words in names that mean it. The first part with a matching word counts. So "forearm"
# comes before "arm", which it contains. What `shoulder`, `arm`, `hip` and `leg` mean depends on the other
# joints of the limb: see `limb_parts`.
WORDS = {
    "twist": "twist roll tweak helper corrective muscle",
    "finger": "finger thumb index middle ring pinky pinkie little palm metacarp carpal inhand",
    "toe": "toe ball orteil zeh",
    "clavicle": "clavicle collar scapula clav",
    "forearm": "forearm lowerarm unterarm lowarm loarm elbow armlower radius ulna",
    "upperarm": "upperarm oberarm uparm upprarm armupper shldr humerus bicep",
    "shank": "lowerleg unterschenkel lowleg loleg leglower calf shin shank knee tibia fibula",
    "thigh": "thigh oberschenkel cuisse muslo upperleg upleg legupper upprleg femur",
    "ankle": "ankle heel",
    "wrist": "wrist",
    "hand": "hand",
    "foot": "foot feet fuss",
    "shoulder": "shoulder schulter hombro",
    "head": "head skull kopf",
    "neck": "neck cervical hals",
    "chest": "chest thorax ribcage sternum torso",
    "hips": "hips pelvis becken cog",
    "spine": "spine back abdomen waist lumbar belly stomach vertebra",
    "arm": "arm",
    "leg": "leg",
    "hip": "hip buttock femoral",
}
SPELLINGS = {part: tuple(known.split()) for part, known in WORDS.items()}
KINDS = {  # parts that suggest a kind of limb
    "leg": {"thigh", "shank", "foot", "ankle", "toe", "leg", "hip"},
    "arm": {"clavicle", "upperarm", "forearm", "hand", "wrist", "finger", "arm", "shoulder"},
}
# Words in the names of joints that are no part of the body but move other joints.
CONTROLS = ("ik", "mch", "ctrl", "control", "ctl", "pole", "target", "effector")
ENDS = ("end", "nub", "site", "tip", "top")  # words in the names of joints that only mark the end of a bone


def words(name: str) -> list[str]:
    """The words of a joint's name in lower case. The name is split at capitals, digits and signs such as "_".

    >>> words("mixamorig:LeftUpLeg"), words("Bip01 L Thigh"), words("DEF-shin.R.001"), words("lShin")
    (['mixamorig', 'left', 'up', 'leg'], ['bip', 'l', 'thigh'], ['def', 'shin', 'r'], ['l', 'shin'])
    """
    return [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name.replace("ß", "ss"))]


@lru_cache(8192)  # a rig's names, of which each is asked for very often
def side_of(name: str) -> str | None:
    """The side that a joint's name says: "left" or "right", or None if it says neither or both.

    >>> side_of("LeftUpLeg"), side_of("thigh.R"), side_of("rForeArm"), side_of("LLeg"), side_of("Spine")
    ('left', 'right', 'right', 'left', None)
    """
    found, text = set(words(name)), name.lower()
    left, right = bool(found & LEFT), bool(found & RIGHT)
    if not left and not right:
        left, right = "left" in text or "左" in text, "right" in text or "右" in text
    if not left and not right and (glued := re.match(r"([LR])[A-Z][a-z]", name)):
        left, right = glued[1] == "L", glued[1] == "R"
    return None if left == right else "left" if left else "right"


def side_of_pair(name: str, other: str) -> str | None:
    """The side of a joint: "left" or "right", or None if the names do not say it.

    name: the name of the joint. other: the name of its counterpart on the other side of the body. If neither
    name says the side alone, the two may say it together: they differ in only one letter, l in one and r in
    the other.

    >>> side_of_pair("lfemur", "rfemur"), side_of_pair("toe_r2", "toe_l2"), side_of_pair("armA", "armB")
    ('left', 'right', None)
    """
    own, opposite = side_of(name), side_of(other)
    if own or opposite:
        return None if own == opposite else own or ("left" if opposite == "right" else "right")
    if len(name) != len(other):
        return None
    unlike = [pair for pair in zip(name.lower(), other.lower(), strict=True) if pair[0] != pair[1]]
    return {("l", "r"): "left", ("r", "l"): "right"}.get(unlike[0]) if len(unlike) == 1 else None


def are_twins(name: str, other: str) -> bool:
    """Whether two names say that the joints are the same part of the body, one left and one right.

    >>> are_twins("LeftToe2", "RightToe2"), are_twins("toe2.L", "toe1.R"), are_twins("lfemur", "rfemur")
    (True, False, True)
    """
    if side_of_pair(name, other) is None:
        return False
    told_together = side_of(name) is None and side_of(other) is None
    return told_together or _without_side(name) == _without_side(other)


def _without_side(name: str) -> list[str]:
    """The words and numbers of a name in lower case, without the words for left and right."""
    name = re.sub(r"^[LR](?=[A-Z][a-z])", "", re.sub("[左右]", " ", name))
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+", name)
    return [part.lower() for part in parts if part.lower() not in LEFT | RIGHT]


def part_of(name: str) -> str | None:
    """The part of the body that a joint's name means, as WORDS calls it, or None if it means none of them.

    >>> part_of("LeftForeArm"), part_of("RightShoulder"), part_of("Bip01 R Calf"), part_of("qwertz")
    ('forearm', 'shoulder', 'shank', None)
    """
    text = "".join(w for w in words(name) if w not in LEFT | RIGHT)
    return next((part for part, known in SPELLINGS.items() if any(word in text for word in known)), None)


def is_end(name: str) -> bool:
    """Whether a name says that the joint only marks the end of a bone, like HeadTop_End."""
    return any(w in ENDS for w in words(name))


def is_control(name: str) -> bool:
    """Whether a name says that the joint is not part of the body but moves other joints, like foot_ik.L."""
    return any(w in CONTROLS for w in words(name))


def kind_score(names: Sequence[str], kind: str) -> float:
    """Score from -1 to 1 for how strongly the names of joints suggest a kind of limb, "leg" or "arm".

    Names of the other kind lower the score. So do names of joints that only control other joints.
    """
    parts = [part_of(name) for name in names]
    other = KINDS["arm" if kind == "leg" else "leg"]
    against = sum(part in other or is_control(name) for part, name in zip(parts, names, strict=True))
    return (sum(part in KINDS[kind] for part in parts) - against) / len(parts)


def limb_parts(names: Sequence[str]) -> dict[str, int]:
    """Which joint of a limb begins which part, by the names of the joints alone.

    names: the names of the limb's joints, from the trunk outward. Returns part -> index in `names`, as far as
    the names say it: thigh, shank, foot and toe, or clavicle, upperarm, forearm and hand. Other parts of
    WORDS that occur, such as finger or twist, are keys, too.

    Some words mean different joints on different rigs. For example, `shoulder` is the clavicle if an upper
    arm follows, and else the upper arm itself.
    """
    parts = [part_of(name) for name in names]
    out: dict[str, int] = {}
    for i, word in enumerate(parts):
        before, after = set(parts[:i]), set(parts[i + 1 :])
        hip = None if after & {"thigh", "leg", "hip"} else "thigh"
        meaning: dict[str, str | None] = {
            "shoulder": "clavicle" if after & {"upperarm", "arm"} else "upperarm",
            "arm": "forearm" if "upperarm" in before else "upperarm",
            "hip": hip,
            "hips": hip,
            "leg": "shank" if before & {"thigh", "hip", "leg"} else "thigh",
            "ankle": "foot",
            "foot": "toe" if "ankle" in before else "foot",
            "wrist": "hand",
            "hand": "finger" if "wrist" in before else "hand",
        }
        part = meaning.get(word, word) if word else None
        # The first joint of a part counts. A joint like Hand_End is not where the hand begins.
        if part is not None and part not in out and not (is_end(names[i]) and part in ("hand", "foot")):
            out[part] = i
    return out
