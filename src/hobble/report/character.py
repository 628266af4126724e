"""Packs a trained network to run in a page, with what the page shows of it, and a recogniser of limps."""

import base64
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
from hobble.core.files import to_base64
from hobble.core.skeleton import Skeleton
from hobble.engine.hob import character_bytes
from hobble.figure.mesh import mesh_key
from hobble.gait.cycles import SCALARS, measure_cycles
from hobble.gait.profile import Profile, profile_of_walk
from hobble.gait.recognise import LEANING, PARTS, SIDES, STRENGTHS, Grader, grader_of_all_people
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.feet import leg_joints
from hobble.runtime.generated import restore_bone_lengths
from hobble.runtime.options import Runtime

AHEAD = (0.0, 2.5)  # target velocity, cm a frame: as fast as walking in the page's section Play


def playable_data(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of a character in the page; {} if the network has no skeleton.

    file: the character file that the runtime in C reads (`hobble.engine.hob`), in base64. Its weights are
    int16, and in each frame they are computed exactly from the phase, whatever mode `runtime` has. Other
    entries say what the page draws and shows. side: cm from the path to the ground heights beside it.
    """
    skeleton = network.skeleton
    if skeleton is None:
        return {}
    exact = runtime.model_copy(update={"mode": None})
    file = character_bytes(network.copy_for_page(), exact, "int16")
    return {
        "file": base64.b64encode(file).decode("ascii"),
        "names": list(skeleton.joints),
        "parents": list(skeleton.parents),
        "offsets": np.round(skeleton.offsets, 4).tolist(),
        "roles": dict(skeleton.roles),
        "step": network.layout.step,
        "side": network.terrain_side,
        "gaits": list(network.gaits),
        "channels": shown_channels(network, runtime.scales),
        "legs": leg_joints(skeleton).tolist(),
        "body": mesh_key(skeleton),
    }


def shown_channels(network: Network, scales: Mapping[str, float]) -> list[dict[str, Any]]:
    """The data of each channel for the page. A channel is a group of inputs (columns) of the network.

    `columns` are the labels of the inputs, `trained` the labels of those that were above 0 in training.
    `sliders`, `presets` and `regions` refer to a column by its index in `columns`. `first`: index of the
    channel's first column among the columns of all channels. `scale`: values are divided by it before the
    network gets them. Entries that say how a channel is shown, such as `spoken`, `sliders` and `says`, come
    from `hobble.channels.shown`.
    """
    skeleton, out, first = network.skeleton, [], 0
    assert skeleton is not None
    for name, columns in network.channels.items():
        definition, index_of = channel(name), list(columns).index
        display = channel_display(name, skeleton, columns, network.trained_labels(name))
        presets = [
            {"name": preset, "values": [[index_of(column), value] for column, value in values.items()]}
            for preset, values in display.presets.items()
        ]
        out.append(
            {
                "name": name,
                "title": definition.title,
                "key": display.address_key or name,
                "first": first,
                "columns": list(columns),
                "trained": list(network.trained_labels(name)),
                "spoken": list(display.spoken_names),
                "sliders": {label: index_of(column) for label, column in display.sliders.items()},
                "presets": presets,
                "regions": [list(indices) for indices in display.regions],
                "highest": definition.highest,
                "start": definition.default,
                "sliderStep": display.slider_step,
                "rest": display.neutral_button,
                "never": display.untrained_note,
                "headline": display.headline,
                "says": display.network_told,
                "on": display.active_word,
                "scale": scales.get(name, 1.0),
            }
        )
        first += len(columns)
    return out


def skeleton_of(spec: Mapping[str, Any]) -> Skeleton:
    """The skeleton of a character that `playable_data` packed. It has all that is needed to draw the body."""
    joints, parents = tuple(spec["names"]), tuple(spec["parents"])
    return Skeleton("", joints, parents, np.array(spec["offsets"]), spec["roles"])


# Value of the slider when the page opens, in tenths of the highest: easy to see, but not the maximum.
OPENING_VALUE = 7


def opening_slider(playable: Mapping[str, Any], measurements: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    playable: data of the character, from `playable_data` in `hobble.report.character`. measurements: the
    results of each measurement.

    In the result, `part` is the label of a slider, or None if no channel has sliders. It is the slider that
    makes the walk limp most; the first one if no limps were measured. `value` is its value, in tenths of the
    highest.
    """
    channel = opening_channel(playable)
    if channel is None:
        return {"part": None, "value": 0}
    # Column -> label of its slider. A row of the limps that were measured names its column under "link".
    labels = {channel["columns"][i]: label for label, i in channel["sliders"].items()}
    rows = [row for results in measurements for row in results.get("sizes") or ()]
    limps = [row for row in rows if row.get("gait") == "walk" and row["link"] in labels]
    part = labels[max(limps, key=_limp_size)["link"]] if limps else next(iter(labels.values()))
    return {"part": part, "value": OPENING_VALUE}


def _limp_size(row: Mapping[str, Any]) -> float:
    """How much a limp changes the walk: the changes of stance, step and knee, added up.

    `stance`: how much longer the sound leg stands than the hurt one, as a share of the cycle; the healthy
    walk has 0. `step_hurt`, `knee_hurt`: length of the step and range of the knee of the hurt leg, divided
    by those of the healthy walk.
    """
    ratios = [row.get(name) for name in ("step_hurt", "knee_hurt")]
    return abs(row.get("stance") or 0.0) + sum(abs(1 - ratio) for ratio in ratios if ratio is not None)


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with a slider and columns that stand for parts of the body, or None."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def opening_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: `body_channel`, or else the first with sliders, or None."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)


HEALTHY_WARM_UP, HEALTHY_MEASURED = 3 * 60, 8 * 60  # frames to get up to speed, and frames that are measured
ROLES = ("hip", "knee", "heel", "toe", "shoulder")  # joint roles that the skeleton must have on both sides


def playable_with_recogniser(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of `playable_data`, and under `recogniser` what the page needs to recognise a limp.

    There is no `recogniser` if no channel (group of inputs) of the network belongs to parts of the body, if
    the skeleton lacks one of ROLES, or if the healthy character walks no complete gait cycle. healthy: the
    profile of the healthy walk, and joints: the joints that are measured, both for `c/hobble_gait.h`.
    """
    spec = playable_data(network, runtime)
    if any(channel["regions"] for channel in spec.get("channels", ())):
        assert network.skeleton is not None
        healthy = healthy_walk(network, network.skeleton, runtime)
        if healthy is not None:
            spec["recogniser"] = packed_statistics() | {
                "healthy": [healthy[name] for name in PROFILE_IN_C],
                "joints": measured_joints(network.skeleton),
            }
    return spec


def healthy_walk(network: Network, skeleton: Skeleton, runtime: Runtime) -> Profile | None:
    """The profile of the healthy character walking straight on. Bones have constant lengths, as in the page.

    None if the skeleton lacks one of ROLES, or if the character walks no complete gait cycle.
    """
    if not all(f"{side}_{part}" in skeleton.roles for side in SIDES for part in ROLES):
        return None
    animation = ProceduralAnimation(network, **dict(runtime))
    poses = [animation.next_pose(AHEAD, None, "walk") for _ in range(HEALTHY_WARM_UP + HEALTHY_MEASURED)]
    poses = poses[HEALTHY_WARM_UP:]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    walk = measure_cycles(skeleton, restore_bone_lengths(skeleton, positions, rotations)[1], 60)
    return profile_of_walk(walk) if len(walk) else None


# The numbers of a profile in `c/hobble_gait.h`, in their order.
CURVES_IN_C = (
    *(
        f"{limb}_{side}"
        for side in "LR"
        for limb in (
            *("hip_flexion", "hip_abduction", "knee_flexion"),
            *("ankle_height", "ankle_forward", "arm_forward"),
        )
    ),
    *("trunk_forward", "trunk_left", "pelvis_left_up"),
)
PROFILE_IN_C = (*SCALARS, *(f"{kind} {curve}" for kind in ("range", "mean") for curve in CURVES_IN_C))


def measured_joints(skeleton: Skeleton) -> list[int]:
    """The joints of `c/hobble_gait.h`: hips and top of the trunk, then those of each side; -1: none."""
    trunk = next(role for role in ("neck", "chest", "head") if role in skeleton.roles)
    found = [skeleton.role("hips"), skeleton.role(trunk)]
    for side in ("left", "right"):
        found += [skeleton.role(f"{side}_{part}") for part in ("hip", "knee", "heel", "shoulder")]
        hands = (f"{side}_elbow", f"{side}_wrist")
        found.append(next((skeleton.role(role) for role in hands if role in skeleton.roles), -1))
    return found


def packed_statistics(statistics: Grader | None = None) -> dict[str, Any]:
    """What the graded recogniser of `hobble.gait.recognise` learnt from people's walks.

    statistics: by default those learnt from all people. In the result, `words`: for each kind of limp what
    may hurt. `learnt`: the numbers that `c/hobble_gait.h` describes, float64 in base64.
    """
    statistics = statistics or grader_of_all_people()
    labels = list(dict.fromkeys(label for label, _ in statistics.kinds))
    numbers: list[Any] = [[len(statistics.kinds), len(STRENGTHS)], STRENGTHS, statistics.healthy]
    for (label, _), (mean, spread) in statistics.kinds.items():
        numbers += [[labels.index(label)], mean, spread]
    return {
        "words": [kind_in_words(*kind) for kind in statistics.kinds],
        "learnt": to_base64(np.concatenate([np.ravel(part) for part in numbers]).astype(float)),
    }


def kind_in_words(label: str, side: str) -> str:
    """What may hurt, such as "left thigh, shank or foot" or "back, leaning forward".

    label, side: a key of `Grader.kinds`.
    """
    parts = PARTS[label]
    parts_in_words = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} or {parts[-1]}"
    return f"{parts_in_words}, leaning {side}" if label == LEANING else f"{side} {parts_in_words}"
