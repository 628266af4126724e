"""Names of joints in other programs, for clips that are rewritten as those programs would write them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

SIDES = (("Left", "L"), ("Right", "R"))
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
