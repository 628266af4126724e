"""Words for a reader: the names of the parts of the body, and not of the joints of a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from hobble.core.skeleton import Skeleton
from hobble.figure.pack import link_ends

# Parts of the body that have a slider and a key of their own: label, roles of the ends.
PARTS = (
    ("left thigh", "left_hip", "left_knee"),
    ("left shank", "left_knee", "left_heel"),
    ("left foot", "left_heel", "left_toe"),
    ("right thigh", "right_hip", "right_knee"),
    ("right shank", "right_knee", "right_heel"),
    ("right foot", "right_heel", "right_toe"),
    ("lower back", "hips", "spine"),
    ("left upper arm", "left_shoulder", "left_elbow"),
    ("right upper arm", "right_shoulder", "right_elbow"),
)
# Parts without a slider of their own, which still have a name.
OTHERS = (
    ("left forearm", "left_elbow", "left_wrist"),
    ("right forearm", "right_elbow", "right_wrist"),
    ("upper back", "spine", "chest"),
    ("neck", "chest", "neck"),
    ("head", "neck", "head"),
    ("left hip", "hips", "left_hip"),
    ("right hip", "hips", "right_hip"),
    ("left shoulder", "chest", "left_shoulder"),
    ("right shoulder", "chest", "right_shoulder"),
)


def way(skeleton: Skeleton, upper: str, lower: str) -> list[str]:
    """Links from the joint of one role down to that of another, uppermost first; [] where there is no way."""
    if any(skeleton.roles.get(role) not in skeleton.joints for role in (upper, lower)):
        return []
    joint, top, out = skeleton.role(lower), skeleton.role(upper), []
    while joint != top:
        parent = skeleton.parents[joint]
        if parent < 0:
            return []
        out.append(f"{skeleton.joints[parent]}-{skeleton.joints[joint]}")
        joint = parent
    return out[::-1]


def spoken(skeleton: Skeleton, link: str) -> str:
    """What a link is called: "left thigh"; its own name where the body has no word for it."""
    for label, upper, lower in (*PARTS, *OTHERS):
        if link in way(skeleton, upper, lower):
            return label
    ends = link_ends(skeleton.joints, [link])[0]
    for side in ("left", "right"):
        for role, word in (("wrist", "hand"), ("toe", "toes")):
            if ends and skeleton.roles.get(f"{side}_{role}") in _above(skeleton, ends[0]):
                return f"{side} {word}"
    return link


def spoken_links(skeleton: Skeleton, links: Sequence[str]) -> list[str]:
    """A name for each link; where several have the same one, all but the first keep their own beside it."""
    out: list[str] = []
    for link in links:
        word = spoken(skeleton, link)
        out.append(word if word not in out or word == link else f"{word} ({link})")
    return out


def speaker(skeleton: Mapping[str, Any]) -> Callable[[str], str]:
    """A function from a link's name to what a reader calls it; names of no link stay as they are.

    skeleton: as a network's file holds it, empty where that is not known.
    """
    if not skeleton:
        return str
    figure = Skeleton.from_dict({"name": "", **skeleton})
    words = dict(zip(figure.link_names, spoken_links(figure, figure.link_names), strict=True))
    return lambda link: words.get(link, link)


def _above(skeleton: Skeleton, joint: int) -> list[str]:
    """Names of the joint and of all above it."""
    names = [skeleton.joints[joint]]
    while skeleton.parents[joint] >= 0:
        joint = skeleton.parents[joint]
        names.append(skeleton.joints[joint])
    return names
