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
SEVERITY = 8.0  # of the parts that hurt in the loops of STUDY
# Looping pictures of walks: name -> parts that hurt. Injuries are not coloured in them. In the films of the
# questionnaire (`study/films.py`) the injury begins during the film.
STUDY: dict[str, tuple[str, ...]] = {
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
# Scenarios (walks in which the severity rises): name -> roles of the joints at the two ends of the hurt part.
HURT = {
    "left_knee": ("left_hip", "left_knee"),
    "right_knee": ("right_hip", "right_knee"),
    "left_ankle": ("left_knee", "left_heel"),
    "lower_back": ("hips", "spine"),
    "left_arm": ("left_shoulder", "left_elbow"),
}


def shown(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> ChannelDisplay:
    """Sliders and presets of the parts that were hurt in training, and the regions of the body."""
    parts = {label: links[i] for label, i in body_parts(skeleton, links, trained).items()}
    felt = {label: link for label, link in parts.items() if link in trained}
    presets = {
        name: {felt[label]: float(value) for label, value in values.items()}
        for name, values in PRESETS.items()
        if all(label in felt for label in values)
    }
    return ChannelDisplay(tuple(spoken_links(skeleton, links)), felt, presets, regions(skeleton, links))


def loops(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> list[SampleWalk]:
    """The thirteen walks of the study, and the coloured presets."""
    parts = {label: links[i] for label, i in body_parts(skeleton, links, trained).items()}
    out = [
        SampleWalk(name, {parts[label]: SEVERITY for label in labels}, False)
        for name, labels in STUDY.items()
    ]
    for title, values in PRESETS.items():
        hurt = {parts[label]: float(value) for label, value in values.items()}
        out.append(SampleWalk(f"preset-{title.lower().replace(' ', '-')}", hurt, True))
    return out


def sweeps(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> dict[str, str]:
    """The links that hurt in the scenarios: name -> link.

    It is the part's uppermost link that was hurt in training. If there is none, it is the uppermost of all.
    """
    out = {}
    for name, (upper, lower) in HURT.items():
        child, top = skeleton.role(lower), skeleton.role(upper)
        path = [child]
        while path[-1] != top and skeleton.parents[path[-1]] >= 0:
            path.append(skeleton.parents[path[-1]])
        pairs = [f"{skeleton.joints[p]}-{skeleton.joints[c]}" for c, p in pairwise(path)]
        for known in (trained, links):
            if name not in out and (there := [pair for pair in reversed(pairs) if pair in known]):
                out[name] = there[0]
    return out


def body_parts(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str] = ()) -> dict[str, int]:
    """Label -> index of the link that stands for the part, for the parts that the network knows.

    It is the uppermost link between the part's two ends that was `hurt` in training. If there is none, it is
    the uppermost of all. A link that was never hurt in training has no effect.
    """
    found = {}
    for label, upper, lower in PARTS:
        known = [name for name in links_between(skeleton, upper, lower) if name in links]
        if known:
            best = next((name for name in known if name in hurt), known[0])
            found[label] = list(links).index(best)
    return found


def links_between(skeleton: Skeleton, upper: str, lower: str) -> list[str]:
    """Links from the joint of the role `upper` down to that of `lower`, uppermost first.

    It is empty if the skeleton lacks a role, or if the second joint is not below the first.
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
    """The name of a link for readers, such as "left thigh". If there is none, it is the link's label."""
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
    found = [spoken(skeleton, link) for link in links]
    return [
        word if found.count(word) == 1 or word == link else f"{word} ({link})"
        for word, link in zip(found, links, strict=True)
    ]


def _above(skeleton: Skeleton, joint: int) -> list[str]:
    """Names of the joint and of all above it."""
    names = [skeleton.joints[joint]]
    while skeleton.parents[joint] >= 0:
        joint = skeleton.parents[joint]
        names.append(skeleton.joints[joint])
    return names
