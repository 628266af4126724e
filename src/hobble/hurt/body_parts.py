"""Finds the part of the body that a link (a bone that can be hurt) belongs to, by the roles of joints."""

from __future__ import annotations

from dataclasses import dataclass

from hobble.core.skeleton import Skeleton

LEFT, RIGHT = 0, 1
SIDES = ("left", "right")
# (role, part): the part reaches down to the joint with this role. It begins at the joint with the previous
# role; the first part begins at the hips (LEG) or the chest (ARM).
LEG = (("hip", "hip"), ("knee", "thigh"), ("heel", "shank"))
ARM = (("shoulder", "shoulder"), ("elbow", "upper arm"), ("wrist", "forearm"))


@dataclass(frozen=True)
class BodyPart:
    """A part of the body: pelvis, hip, thigh, shank, foot, back, neck, shoulder, upper arm, forearm or hand.

    side: LEFT, RIGHT, or None on the midline.
    """

    name: str
    side: int | None


def part_of_link(skeleton: Skeleton, link: tuple[str, str]) -> BodyPart:
    """The part of the body that a link (parent joint, child joint) belongs to."""
    child = skeleton.index(link[1])
    for side, word in enumerate(SIDES):
        for top, limb, last_part in (("hips", LEG, "foot"), ("chest", ARM, "hand")):
            upper = skeleton.role(top)
            for role, name in limb:
                lower = skeleton.role(f"{word}_{role}")
                if child in _chain(skeleton, lower, upper):
                    # Joints between the hips and the hip joint belong to the pelvis.
                    above_hip = role == "hip" and child != lower
                    return BodyPart("pelvis" if above_hip else name, side)
                upper = lower
            if upper in joint_and_ancestors(skeleton, child):  # below the ankle or the wrist
                return BodyPart(last_part, side)
    if child in _chain(skeleton, skeleton.role("chest"), skeleton.role("hips")):
        return BodyPart("back", None)
    if skeleton.role("chest") in joint_and_ancestors(skeleton, child):
        return BodyPart("neck", None)
    return BodyPart("back", None)


def joint_and_ancestors(skeleton: Skeleton, joint: int) -> list[int]:
    """Indices of the joint itself, its parent, and so on to the root."""
    out = [joint]
    while skeleton.parents[out[-1]] >= 0:
        out.append(skeleton.parents[out[-1]])
    return out


def _chain(skeleton: Skeleton, joint: int, above: int) -> list[int]:
    """The joints from `joint` up to the one below `above`. Empty if `above` is not an ancestor."""
    path = joint_and_ancestors(skeleton, joint)
    return path[: path.index(above)] if above in path else []
