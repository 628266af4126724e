"""How injuries are shown: names of body parts, sliders, presets, loops and sweeps.

A link is the piece of the body between two neighbouring joints. Its label is a pair of joints, such as
"LeftUpLeg-LeftLeg". A role is a name for a joint that is the same in all skeletons, such as "left_knee". A
loop is a walk for a looping picture. A sweep is a walk in which the severity of one link rises.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from hobble.channels.shown import ChannelDisplay, ChannelWords, SampleWalk
from hobble.core.skeleton import Skeleton
from hobble.figure.pack import link_ends, links_of_bones

# Words on the report page; `ChannelWords` explains them. {} stands for the name of a link.
WORDS = ChannelWords(
    neutral_button="Healthy",
    slider_step=1,
    address_key="hurt",
    sweep_description="Walks while the {} hurts more and more",
    untrained_note="never hurt in training, so it has no effect",
    headline="Say where it hurts.",
    network_told="that its {} hurts",
    active_word="hurt",
)
# Parts of the body that have a slider on the page: label, roles of the joints at the upper and the lower end.
PARTS_WITH_SLIDER = (
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
# Parts of the body with a name but no slider: label and roles as in PARTS_WITH_SLIDER.
PARTS_WITHOUT_SLIDER = (
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
# Name of a preset (a button on the page) -> label of a part -> severity.
PRESETS = {
    "Hurt knee": {"left thigh": 7, "left shank": 7},
    "Sprained ankle": {"right shank": 6, "right foot": 8},
    "Bad back": {"lower back": 8},
    "Knee and back": {"left thigh": 7, "left shank": 7, "lower back": 7},
}
LOOP_SEVERITY = 8.0  # of the parts that hurt in PLAIN_LOOPS
# Loops in which the hurt parts are not coloured: name -> labels of the parts that hurt during the whole loop.
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
# Name of a sweep -> roles of the joints at the upper and the lower end of the part that hurts.
SWEPT_PARTS = {
    "left_knee": ("left_hip", "left_knee"),
    "right_knee": ("right_hip", "right_knee"),
    "left_ankle": ("left_knee", "left_heel"),
    "lower_back": ("hips", "spine"),
    "left_arm": ("left_shoulder", "left_elbow"),
}


def shown(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> ChannelDisplay:
    """What the page shows of the channel: names, sliders, presets and regions of the body.

    Only parts that were hurt in training have sliders and presets. links: the labels of all links. trained:
    the labels of the links that were hurt in training.
    """
    parts = link_by_part(skeleton, links, trained)
    trained_parts = {label: link for label, link in parts.items() if link in trained}
    presets = {
        name: {trained_parts[label]: float(value) for label, value in values.items()}
        for name, values in PRESETS.items()
        if all(label in trained_parts for label in values)
    }
    return ChannelDisplay(
        tuple(spoken_links(skeleton, links)), trained_parts, presets, links_of_bones(skeleton, links)
    )


def loops(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> list[SampleWalk]:
    """The loops of PLAIN_LOOPS, and for each preset a loop in which the hurt parts are coloured.

    links, trained: as in `shown`.
    """
    parts = link_by_part(skeleton, links, trained)
    out = [
        SampleWalk(name, {parts[label]: LOOP_SEVERITY for label in labels}, False)
        for name, labels in PLAIN_LOOPS.items()
    ]
    for title, values in PRESETS.items():
        hurt = {parts[label]: float(value) for label, value in values.items()}
        out.append(SampleWalk(f"preset-{title.lower().replace(' ', '-')}", hurt, True))
    return out


def sweeps(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> dict[str, str]:
    """Name of each sweep -> label of the link that hurts in it. links, trained: as in `shown`."""
    found = {name: link_of_part(skeleton, ends, links, trained) for name, ends in SWEPT_PARTS.items()}
    return {name: link for name, link in found.items() if link is not None}


def link_by_part(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str] = ()) -> dict[str, str]:
    """Label of each part in PARTS_WITH_SLIDER -> the one of `links` that its slider sets.

    hurt: the links that were hurt in training. If no link of a part was hurt, its slider has no effect. Parts
    without a link are left out.
    """
    found = {label: link_of_part(skeleton, ends, links, hurt) for label, *ends in PARTS_WITH_SLIDER}
    return {label: link for label, link in found.items() if link is not None}


def link_of_part(
    skeleton: Skeleton, ends: Sequence[str], links: Sequence[str], hurt: Collection[str]
) -> str | None:
    """The link that stands for a part of the body, which may consist of several links.

    It is the uppermost of them that was hurt in training, or the uppermost of all if none was; None if the
    part has no link. ends: roles of the joints at the upper and the lower end. links: all links of the
    channel. hurt: those hurt in training.
    """
    of_part = [link for link in links_between(skeleton, *ends) if link in links]
    return next((link for link in of_part if link in hurt), of_part[0] if of_part else None)


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


def other_names(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str]) -> dict[str, str]:
    """Other names of links: a part of the body ("left thigh") or the joint below it ("left knee") -> link.

    links, hurt: as in `link_of_part`.
    """
    found: dict[str, str] = {}
    for label, upper, lower in (*PARTS_WITH_SLIDER, *PARTS_WITHOUT_SLIDER):
        if (link := link_of_part(skeleton, (upper, lower), links, hurt)) is not None:
            found.setdefault(label, link)
            found.setdefault(lower.replace("_heel", "_ankle").replace("_", " "), link)
    return found


def spoken_link(skeleton: Skeleton, link: str) -> str:
    """The name of a link for readers, such as "left thigh". A link without a name keeps its label."""
    for label, upper, lower in (*PARTS_WITH_SLIDER, *PARTS_WITHOUT_SLIDER):
        if link in links_between(skeleton, upper, lower):
            return label
    # The links below a wrist are the hand, and those below a toe joint the toes.
    ends = link_ends(skeleton.joints, [link])[0]
    above = ends[0] if ends else -1  # index of a joint above the link; -1 above the root
    ancestors = []
    while above >= 0:
        ancestors.append(skeleton.joints[above])
        above = skeleton.parents[above]
    for side in ("left", "right"):
        for role, word in (("wrist", "hand"), ("toe", "toes")):
            if skeleton.roles.get(f"{side}_{role}") in ancestors:
                return f"{side} {word}"
    return link


def spoken_links(skeleton: Skeleton, links: Sequence[str]) -> list[str]:
    """The name of each link from `spoken_link`. Links that share a name are numbered, from above."""
    names = [spoken_link(skeleton, link) for link in links]
    counts = [(names[: i + 1].count(name), names.count(name)) for i, name in enumerate(names)]
    return [
        name if total == 1 else f"{name}, part {number} of {total}"
        for name, (number, total) in zip(names, counts, strict=True)
    ]
