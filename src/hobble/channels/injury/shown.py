"""How injuries are shown: names of body parts, sliders, colours and presets."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise

from hobble.channels.shown import ChannelDisplay, ChannelWords, SampleWalk
from hobble.core.skeleton import Skeleton
from hobble.figure.pack import link_ends, regions

WORDS = ChannelWords(
    rest="Healthy",
    step=1,
    key="hurt",
    grows="Walks while the {} hurts more and more",
    never="never hurt in training, so it has no effect",
    headline="Say where it hurts.",
    says="that its {} hurts",
    on="hurt",
)
# Parts of the body that have a slider on the page: label, roles of the joints at the two ends.
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
# Parts of the body with a name but no slider.
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
PRESETS = {
    "Hurt knee": {"left thigh": 7, "left shank": 7},
    "Sprained ankle": {"right shank": 6, "right foot": 8},
    "Bad back": {"lower back": 8},
    "Knee and back": {"left thigh": 7, "left shank": 7, "lower back": 7},
}
LOOP_SEVERITY = 8.0  # of the parts that hurt in PLAIN_LOOPS
# Looping pictures in which the injuries are not coloured: name -> parts that hurt during the whole loop. (In
# the films of the questionnaire, the injury begins during the film: see `study/films.py`.)
PLAIN_LOOPS: dict[str, tuple[str, ...]] = {
    "healthy": (),
    "left-thigh": ("left thigh",),
    "left-shank": ("left shank",),
    "left-foot": ("left foot",),
    "right-thigh": ("right thigh",),
    "right-shank": ("right shank",),
    "right-foot": ("right foot",),
    "lower-back": ("lower back",),
    "left-arm": ("left upper arm",),
    "right-arm": ("right upper arm",),
    "left-leg": ("left thigh", "left shank", "left foot"),
    "right-leg": ("right thigh", "right shank", "right foot"),
    "thigh-and-back": ("left thigh", "lower back"),
}
# Sweeps (walks in which the severity rises): name -> roles of the joints at the two ends of the hurt part.
SWEPT_PARTS = {
    "left_knee": ("left_hip", "left_knee"),
    "right_knee": ("right_hip", "right_knee"),
    "left_ankle": ("left_knee", "left_heel"),
    "lower_back": ("hips", "spine"),
    "left_arm": ("left_shoulder", "left_elbow"),
}


def shown(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> ChannelDisplay:
    """Sliders and presets of the parts that were hurt in training, and the regions of the body.

    links: the names of all links. trained: the names of those that were hurt in training.
    """
    parts = {label: links[i] for label, i in body_parts(skeleton, links, trained).items()}
    felt = {label: link for label, link in parts.items() if link in trained}
    presets = {
        name: {felt[label]: float(value) for label, value in values.items()}
        for name, values in PRESETS.items()
        if all(label in felt for label in values)
    }
    return ChannelDisplay(tuple(spoken_links(skeleton, links)), felt, presets, regions(skeleton, links))


def loops(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> list[SampleWalk]:
    """PLAIN_LOOPS, and a loop in colour of each preset. links, trained: as in `shown`."""
    parts = {label: links[i] for label, i in body_parts(skeleton, links, trained).items()}
    out = [
        SampleWalk(name, {parts[label]: LOOP_SEVERITY for label in labels}, False)
        for name, labels in PLAIN_LOOPS.items()
    ]
    for title, values in PRESETS.items():
        hurt = {parts[label]: float(value) for label, value in values.items()}
        out.append(SampleWalk(f"preset-{title.lower().replace(' ', '-')}", hurt, True))
    return out


def sweeps(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> dict[str, str]:
    """The links that hurt in the sweeps: name -> link. links, trained: as in `shown`.

    Of the hurt part's links, the uppermost that was hurt in training is taken. If none was, the part's
    uppermost link is taken.
    """
    out = {}
    for name, (upper, lower) in SWEPT_PARTS.items():
        child, top = skeleton.role(lower), skeleton.role(upper)
        path = [child]
        while path[-1] != top and skeleton.parents[path[-1]] >= 0:
            path.append(skeleton.parents[path[-1]])
        pairs = [f"{skeleton.joints[p]}-{skeleton.joints[c]}" for c, p in pairwise(path)]
        for candidates in (trained, links):
            if name not in out and (found := [pair for pair in reversed(pairs) if pair in candidates]):
                out[name] = found[0]
    return out


def body_parts(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str] = ()) -> dict[str, int]:
    """Label of a part -> index in `links` of the link that stands for it. Parts without a link are left out.

    hurt: the links that were hurt in training. Of the part's links, the uppermost of these is taken. If there
    is none, the part's uppermost link is taken, but it has no effect.
    """
    indices = {}
    for label, upper, lower in PARTS:
        of_part = [name for name in links_between(skeleton, upper, lower) if name in links]
        if of_part:
            best = next((name for name in of_part if name in hurt), of_part[0])
            indices[label] = list(links).index(best)
    return indices


def links_between(skeleton: Skeleton, upper: str, lower: str) -> list[str]:
    """Links from the joint with the role `upper` down to the joint with the role `lower`, uppermost first.

    The list is empty if the skeleton lacks a role, or if the joint `lower` is not below the joint `upper`.
    """
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
    """The name of a link for readers, such as "left thigh". A link without such a name keeps its label."""
    for label, upper, lower in (*PARTS, *OTHERS):
        if link in links_between(skeleton, upper, lower):
            return label
    ends = link_ends(skeleton.joints, [link])[0]
    for side in ("left", "right"):
        for role, word in (("wrist", "hand"), ("toe", "toes")):
            if ends and skeleton.roles.get(f"{side}_{role}") in _above(skeleton, ends[0]):
                return f"{side} {word}"
    return link


def spoken_links(skeleton: Skeleton, links: Sequence[str]) -> list[str]:
    """A name for each link. If several links have the same name, their labels are added."""
    names = [spoken(skeleton, link) for link in links]
    return [
        name if names.count(name) == 1 or name == link else f"{name} ({link})"
        for name, link in zip(names, links, strict=True)
    ]


def _above(skeleton: Skeleton, joint: int) -> list[str]:
    """Names of the joint and of all above it."""
    names = [skeleton.joints[joint]]
    while skeleton.parents[joint] >= 0:
        joint = skeleton.parents[joint]
        names.append(skeleton.joints[joint])
    return names
