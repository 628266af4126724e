"""How injuries are shown: names of body parts, sliders, presets, loops and sweeps.

A link is the piece of the body between two neighbouring joints. Its label is a pair of joints, such as
"LeftUpLeg-LeftLeg". A role is a name for a joint that is the same in all skeletons, such as "left_knee". A
loop is a walk for a looping picture. A sweep is a walk in which the severity of one link rises.
"""

from collections.abc import Collection, Sequence

from hobble.channels.shown import ChannelDisplay, SampleWalk
from hobble.core.skeleton import Skeleton
from hobble.figure.pack import link_ends, links_of_bones

# Parts of the body: label -> roles of the joints at the upper and the lower end.
PARTS = {
    "left thigh": ("left_hip", "left_knee"),
    "left shank": ("left_knee", "left_heel"),
    "left foot": ("left_heel", "left_toe"),
    "right thigh": ("right_hip", "right_knee"),
    "right shank": ("right_knee", "right_heel"),
    "right foot": ("right_heel", "right_toe"),
    "lower back": ("hips", "spine"),
    "left upper arm": ("left_shoulder", "left_elbow"),
    "right upper arm": ("right_shoulder", "right_elbow"),
    "left forearm": ("left_elbow", "left_wrist"),
    "right forearm": ("right_elbow", "right_wrist"),
    "upper back": ("spine", "chest"),
    "neck": ("chest", "neck"),
    "head": ("neck", "head"),
    "left hip": ("hips", "left_hip"),
    "right hip": ("hips", "right_hip"),
    "left shoulder": ("chest", "left_shoulder"),
    "right shoulder": ("chest", "right_shoulder"),
}
SLIDERS = tuple(PARTS)[:9]  # the parts that have a slider on the page
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
    **{part.replace(" ", "-"): (part,) for part in SLIDERS[:7]},
    "left-arm": ("left upper arm",),
    "right-arm": ("right upper arm",),
    "left-leg": ("left thigh", "left shank", "left foot"),
    "right-leg": ("right thigh", "right shank", "right foot"),
    "thigh-and-back": ("left thigh", "lower back"),
}
# Name of a sweep -> label of the part that hurts.
SWEPT_PARTS = {
    "left_knee": "left thigh",
    "right_knee": "right thigh",
    "left_ankle": "left shank",
    "lower_back": "lower back",
    "left_arm": "left upper arm",
}


def display(skeleton: Skeleton, links: Sequence[str], trained: Collection[str]) -> ChannelDisplay:
    """What the page shows of the channel. Only parts that were hurt in training have sliders and presets.

    links: the labels of all links. trained: the labels of the links that were hurt in training.
    """
    found = {label: link_of_part(skeleton, label, links, trained) for label in PARTS}
    parts = {label: link for label, link in found.items() if link is not None}
    sliders = {label: parts[label] for label in SLIDERS if parts.get(label) in trained}
    presets = {
        name: {parts[label]: float(value) for label, value in values.items()}
        for name, values in PRESETS.items()
        if all(label in parts for label in values)
    }
    coloured = {f"preset-{name.lower().replace(' ', '-')}": values for name, values in presets.items()}
    other_names: dict[str, str] = {}  # a part of the body ("left thigh") or the joint below it ("left knee")
    for label, link in parts.items():
        other_names.setdefault(label, link)
        other_names.setdefault(PARTS[label][1].replace("_heel", "_ankle").replace("_", " "), link)
    return ChannelDisplay(
        spoken_links(skeleton, links),
        sliders,
        sweeps={name: parts[label] for name, label in SWEPT_PARTS.items() if label in parts},
        loops=[
            *(
                SampleWalk(name, {parts[label]: LOOP_SEVERITY for label in labels})
                for name, labels in PLAIN_LOOPS.items()
                if all(label in parts for label in labels)
            ),
            *(SampleWalk(name, values, True) for name, values in coloured.items()),
        ],
        presets={name: values for name, values in presets.items() if set(values) <= set(trained)},
        regions=links_of_bones(skeleton, links),
        other_names=other_names,
        neutral_button="Healthy",
        slider_step=1,
        address_key="hurt",
        untrained_note="never hurt in training, so it has no effect",
        headline="Say where it hurts.",
        network_told="that its {} hurts",
        active_word="hurt",
    )


def link_of_part(
    skeleton: Skeleton, part: str, links: Sequence[str], hurt: Collection[str] = ()
) -> str | None:
    """The link that stands for a part of PARTS, which may consist of several links.

    It is the uppermost of them that was hurt in training, or the uppermost of all if none was; None if the
    part has no link. links: all links of the channel. hurt: those hurt in training.
    """
    of_part = [link for link in links_between(skeleton, *PARTS[part]) if link in links]
    return next((link for link in of_part if link in hurt), of_part[0] if of_part else None)


def links_between(skeleton: Skeleton, upper: str, lower: str) -> list[str]:
    """Links from the joint with the role `upper` down to the joint with the role `lower`, uppermost first.

    The list is empty if the skeleton lacks a role, or if the joint `lower` is not below the joint `upper`.
    """
    if any(skeleton.roles.get(role) not in skeleton.joints for role in (upper, lower)):
        return []
    path = skeleton.path_up(skeleton.role(lower), skeleton.role(upper))
    return [f"{skeleton.joints[skeleton.parents[j]]}-{skeleton.joints[j]}" for j in path[::-1]]


def spoken_link(skeleton: Skeleton, link: str) -> str:
    """The name of a link for readers, such as "left thigh". A link without a name keeps its label."""
    for label, roles in PARTS.items():
        if link in links_between(skeleton, *roles):
            return label
    # The links below a wrist are the hand, and those below a toe joint the toes.
    ends = link_ends(skeleton.joints, [link])[0]
    ancestors = [skeleton.joints[j] for j in skeleton.path_up(ends[0])] if ends else []
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
