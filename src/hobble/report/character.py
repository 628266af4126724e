"""Packs a trained network to run in a page: weights, the first seconds of its walk, a recogniser of limps."""

from __future__ import annotations

import base64
import itertools
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hobble.channels import channel
from hobble.channels.shown import channel_display, channel_words
from hobble.channels.speed_limits import SLOWEST, SUM_NORM
from hobble.core.files import to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.gait.cycles import measure_cycles
from hobble.gait.profile import Profile, features, healthy_profile, profile_of_walk
from hobble.gait.recognise import LEANING, PARTS, SIDES, STRENGTHS, Grader, grader_of_all_people
from hobble.models.network import Network, inverse_or_0
from hobble.runtime import (
    bounds,
    caller_targets,
    controller,
    feet,
    leg_reach,
    network_rows,
    trajectory,
)
from hobble.runtime.animation import Pose, ProceduralAnimation
from hobble.runtime.bounds import Bounds
from hobble.runtime.character import start_characters
from hobble.runtime.export import restore_bone_lengths
from hobble.runtime.options import Runtime

AHEAD = (0.0, 2.5)  # target velocity, cm a frame: as fast as walking in the page's section Play


def walk_straight(
    network: Network, runtime: Runtime, frames: int, channels: Mapping[str, Mapping[str, float]]
) -> Iterator[tuple[ProceduralAnimation, Pose]]:
    """Yields the character and its pose after each frame, at 60 Hz. The character is always the same object.

    channels: channel -> column -> value. A channel is a group of inputs of the network, such as the
    severities of injuries, and a column is one of them. Columns that are not given have the value 0.
    """
    animation = ProceduralAnimation(network, **dict(runtime))
    for _ in range(frames):
        yield animation, animation.next_pose(AHEAD, None, "walk", **channels)


NO_EFFECT = 1e-7  # inputs are multiplied by 1 / standard deviation; below this factor they have no effect


def playable_data(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of the page's JavaScript runtime; {} if the network has no skeleton.

    Inputs without effect are left out. So are the predicted rotations of joints that move no part of the
    drawn body, such as fingers. In the page these joints keep their rest pose relative to their parents.
    """
    skeleton = network.skeleton
    if skeleton is None:
        return {}
    layout = network.layout
    turning = turning_joints(skeleton)
    scale = inverse_or_0(network.x_std)
    inputs = np.flatnonzero(scale > NO_EFFECT)
    # Of the rotations, which are the last block, only those of the joints `turning` are used.
    rotations = layout.y_joint_rotation.start
    of_joints = rotations + 3 * np.asarray(turning)[:, None] + np.arange(3)
    outputs = np.concatenate([np.arange(rotations), of_joints.ravel()])
    legs = feet.leg_joints(skeleton)
    sole = feet.sole_heights(network, legs).tolist()
    parts = feet.foot_parts(skeleton, legs)
    return {
        "network": {"kind": network.kind, **network.page_data(inputs, outputs)},
        "recordedPoses": network.plays_recorded_poses,
        "inputColumns": inputs.tolist(),
        "xMean": _floats(network.x_mean[inputs]),
        "xScale": _floats(scale[inputs]),
        "yMean": _floats(network.y_mean[outputs]),
        "yStd": _floats(network.y_std[outputs]),
        "turning": turning,
        "joints": layout.joints,
        "names": list(skeleton.joints),
        "parents": list(skeleton.parents),
        "bounds": _bounds(network, outputs),
        "start": _start(network),
        "offsets": np.round(skeleton.offsets, 4).tolist(),
        "roles": dict(skeleton.roles),
        "window": layout.window,
        "step": layout.step,
        "x": {name: block.start for name, block in layout.blocks("x").items()} | {"size": layout.x_size},
        "y": {name: block.start for name, block in layout.blocks("y").items()},
        "gaits": list(network.gaits),
        "channels": shown_channels(network, runtime),
        "legs": legs.tolist(),
        "ahead": feet.rest_facing(skeleton).tolist(),
        # For each foot, all joints below the heel; `toes` has only the toe and the joints below the toe.
        "carried": [np.flatnonzero(row).tolist() for row in parts],
        "toes": [np.flatnonzero(row == feet.TOES).tolist() for row in parts],
        "sole": sole,
        "body": mesh_key(skeleton),
        "footLocking": runtime.foot_locking,
        "steering": runtime.steering,
        "constants": {**_constants(), "side": network.terrain_side},
    }


def shown_channels(network: Network, runtime: Runtime) -> list[dict[str, Any]]:
    """The data of each channel for the page. A channel is a group of inputs (columns) of the network.

    `columns` are the labels of the inputs, `trained` the labels of those that were above 0 in training.
    `sliders`, `presets` and `regions` refer to a column by its index in `columns`. `first`: index of the
    channel's first column among the columns of all channels. `rate`: largest change of a value in one frame.
    `scale`: values are divided by it before the network gets them. `limits`: speed limits, or None. Entries
    that say how a channel is shown, such as `spoken`, `sliders` and `says`, come from
    `hobble.channels.shown`.
    """
    skeleton, out, first = network.skeleton, [], 0
    assert skeleton is not None
    for name, columns in network.channels.items():
        definition, wording, index_of = channel(name), channel_words(name), list(columns).index
        speed_limits = network.limits.get(name)
        display = channel_display(name, skeleton, columns, network.trained_labels(name))
        presets = [
            {"name": preset, "values": [[index_of(column), value] for column, value in values.items()]}
            for preset, values in display.presets.items()
        ]
        out.append(
            {
                "name": name,
                "title": definition.title,
                "key": wording.address_key or name,
                "first": first,
                "columns": list(columns),
                "trained": list(network.trained_labels(name)),
                "spoken": list(display.spoken_names),
                "sliders": {label: index_of(column) for label, column in display.sliders.items()},
                "presets": presets,
                "regions": [list(indices) for indices in display.regions],
                "highest": definition.highest,
                "start": definition.default,
                "sliderStep": wording.slider_step,
                "rest": wording.neutral_button,
                "never": wording.untrained_note,
                "headline": wording.headline,
                "says": wording.network_told,
                "on": wording.active_word,
                "rate": runtime.rates.get(name, definition.rate) / 60,  # from a second to a frame
                "scale": runtime.scales.get(name, 1.0),
                "limits": speed_limits.to_dict() if runtime.limits and speed_limits is not None else None,
            }
        )
        first += len(columns)
    return out


def turning_joints(skeleton: Skeleton) -> list[int]:
    """Indices of the joints whose rotations the page needs.

    These are the joints that move the drawn body, the joints of the legs, and all ancestors of both.
    """
    needed: set[int] = set()
    for joint in (*body_mesh(skeleton).bones.tolist(), *feet.leg_joints(skeleton).ravel().tolist()):
        while joint >= 0 and joint not in needed:
            needed.add(joint)
            joint = skeleton.parents[joint]
    return sorted(needed)


def skeleton_of(spec: Mapping[str, Any]) -> Skeleton:
    """The skeleton of a character that `playable_data` packed. It has all that is needed to draw the body."""
    joints, parents = tuple(spec["names"]), tuple(spec["parents"])
    return Skeleton("", joints, parents, np.array(spec["offsets"]), spec["roles"])


def _floats(values: NDArray) -> str:
    """Numbers as 32-bit floats, packed."""
    return to_base64(np.asarray(values).astype(np.float32))


def _bounds(network: Network, outputs: NDArray[np.int64]) -> dict[str, Any]:
    """The ranges to which the page clips all inputs, and the outputs with the indices `outputs`."""
    found = Bounds.of(network)
    return {
        "xLow": _floats(found.x_low),
        "xHigh": _floats(found.x_high),
        "yLow": _floats(found.y_low[outputs]),
        "yHigh": _floats(found.y_high[outputs]),
        "fastest": found.fastest,
        "hips": list(found.hips),
    }


def _start(network: Network) -> dict[str, Any]:
    """The state in which a character begins, at the origin and facing ahead."""
    state = start_characters(network, 1, np.zeros((1, 2)), np.zeros(1))
    names = ("position", "direction", "gait", "joint_position", "joint_velocity", "joint_rotation")
    return {name: _floats(getattr(state, name)[0]) for name in names} | {"phase": float(state.phase[0])}


def _constants() -> dict[str, float]:
    """The constants of the Python runtime in camel case, so that the page does not define them again."""
    found: dict[str, Any] = {"SUM_NORM": SUM_NORM, "SLOWEST_SHARE": SLOWEST}
    for module in (trajectory, caller_targets, network_rows, controller, bounds, leg_reach, feet):
        found |= {name: value for name, value in vars(module).items() if name.isupper()}
    numbers = {name: value for name, value in found.items() if isinstance(value, int | float)}
    return {_camel_case(name): float(value) for name, value in numbers.items()}


# Value of the slider when the page opens, in tenths of the highest: easy to see, but not the maximum.
OPENING_VALUE = 7


def opening_slider(playable: Mapping[str, Any], measurements: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """The slider that is set when the page opens, and its value.

    playable: data of the character, from `playable_data` in `hobble.report.character`. measurements: the
    results of each measurement.

    In the result, `part` is the label of a slider, or None if no channel has sliders. It is the slider that
    makes the walk limp most. If no limps were measured, it is the slider that changes the pose most. If poses
    were not measured either, it is the first slider. `value` is its value, in tenths of the highest.
    """
    channel = opening_channel(playable)
    if channel is None:
        return {"part": None, "value": 0}
    # Column -> label of its slider.
    labels = {channel["columns"][i]: label for label, i in channel["sliders"].items()}
    # Column -> its highest rank. A row of a table names its column under "link".
    ranks: dict[str, tuple[float, float]] = {}
    for results in measurements:
        # `responses`: how much the pose changes with severity. `sizes`: how large each limp is.
        for table, rank in (("responses", _pose_change_rank), ("sizes", _limp_rank)):
            for row in results.get(table) or ():
                if row.get("gait") == "walk" and row["link"] in labels:
                    ranks[row["link"]] = max(ranks.get(row["link"], (0.0, 0.0)), rank(row))
    best = max(ranks, key=lambda column: ranks[column]) if ranks else next(iter(labels))
    return {"part": labels[best], "value": OPENING_VALUE}


def _pose_change_rank(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how far severity 10 moves the joints, cm. It is below the rank of every walk that limps.

    Limps come first because people open the page to see a limp. If only the change of pose counted, the back
    would win, because a hurt back bends the whole figure.
    """
    return 0.0, row.get("from_healthy_cm") or 0.0


def _limp_rank(row: Mapping[str, Any]) -> tuple[float, float]:
    """A rank by how much the limp changes the walk: the changes of stance, step and knee, added up.

    `stance`: how much longer the sound leg stands than the hurt one, as a share of the cycle; the healthy
    walk has 0. `step_hurt`, `knee_hurt`: length of the step and range of the knee of the hurt leg, divided
    by those of the healthy walk.
    """
    ratios = [row.get(name) for name in ("step_hurt", "knee_hurt")]
    return abs(row.get("stance") or 0.0) + sum(abs(1 - ratio) for ratio in ratios if ratio is not None), 0.0


def body_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first channel with a slider and columns that stand for parts of the body, or None."""
    return next((c for c in playable.get("channels", ()) if c["regions"] and c["sliders"]), None)


def opening_channel(playable: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The channel that the top of the page shows: `body_channel`, or else the first with sliders, or None."""
    return body_channel(playable) or next((c for c in playable.get("channels", ()) if c["sliders"]), None)


OPENING_FRAMES = (
    120  # frames of walking before the page opens: two seconds, enough to get up to speed and to limp
)

IN_STEP = 0.03  # share of a gait cycle by which characters in step may differ

# Fields of `hobble.runtime.character.Character` that the page has as flat lists, with names in camel case.
FLAT_FIELDS = (
    "gait",
    "ground",
    "joint_position",
    "joint_velocity",
    "joint_rotation",
    "channel_values",
    "channel_targets",
    "memory",
)
# Fields that the page has as nested lists or as numbers, also with names in camel case.
NESTED_FIELDS = (
    *("root_height", "phase", "smoothed_velocity", "smoothed_direction", "strafe", "correction", "placed"),
    *("foot_lock", "foot_hold", "foot_step", "foot_missed", "foot_lift", "foot_added"),
    *("leg_shown", "body_lift"),
)


def opening_walk(
    network: Network, runtime: Runtime, playable: Mapping[str, Any], measurements: Iterable[Mapping[str, Any]]
) -> dict[str, Any]:
    """The result of `opening_slider` and, under `walked`, the states of the characters.

    playable, measurements: the arguments of `opening_slider`. The characters have walked straight on for
    OPENING_FRAMES frames on flat ground, so they already walk when the page opens. If the network has a
    channel with sliders, there are two: the first has the slider's value, the second the value 0 everywhere.
    Otherwise there is only one. Names and units in a state are those of the page's state of a character.
    """
    chosen, channel = opening_slider(playable, measurements), opening_channel(playable)
    values: list[Mapping[str, Mapping[str, float]]] = [{}]
    if channel is not None:
        column = channel["columns"][channel["sliders"][chosen["part"]]]
        # The value is in tenths of the highest value of the channel.
        values.insert(0, {channel["name"]: {column: chosen["value"] / 10 * channel["highest"]}})
    walked: list[dict[str, Any]] = []
    for each in values:
        walked.append(_state_after_walk(network, runtime, each, walked[0]["phase"] if walked else None))
    return chosen | {"walked": walked}


def _state_after_walk(
    network: Network, runtime: Runtime, channels: Mapping[str, Mapping[str, float]], phase: float | None
) -> dict[str, Any]:
    """The state of a character after the opening walk.

    channels: channel -> column -> value. phase: if given, it walks on for up to a gait cycle until it is in
    step with a character in this phase.
    """
    walk = walk_straight(network, runtime, 2 * OPENING_FRAMES, channels)
    animation, pose = next(itertools.islice(walk, OPENING_FRAMES - 1, None))
    state = animation.state  # of the present frame
    while phase is not None and (float(state.phase[0]) - phase) % 1.0 > IN_STEP:
        if (after := next(walk, None)) is None:
            break
        pose = after[1]
    values = {name: np.ravel(getattr(state, name)[0]) for name in FLAT_FIELDS}
    values |= {name: getattr(state, name)[0] for name in NESTED_FIELDS}
    for axis, name in enumerate("xz"):
        values |= {f"p{name}": state.position[0, :, axis], f"d{name}": state.direction[0, :, axis]}
    values |= {"pose_position": np.ravel(pose.positions), "pose_rotation": np.ravel(pose.rotations)}
    values |= {"contacts": pose.contacts, "root": pose.root}
    return {_camel_case(name): _plain(value) for name, value in values.items()}


def _camel_case(name: str) -> str:
    first, *others = name.lower().split("_")
    return first + "".join(map(str.title, others))


def _plain(values: ArrayLike | Array) -> Any:
    """`values` as nested lists, a number or a bool. Numbers have at most five digits after the point."""
    array = np.asarray(values)
    return array.tolist() if array.dtype == bool else np.round(array.astype(float), 5).tolist()


HEALTHY_WARM_UP, HEALTHY_MEASURED = 3 * 60, 8 * 60  # frames to get up to speed, and frames that are measured
ROLES = ("hip", "knee", "heel", "toe", "shoulder")  # joint roles that the skeleton must have on both sides


def playable_with_recogniser(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of `hobble.report.character`, and under `recogniser` what the page needs to recognise a limp.

    There is no `recogniser` if no channel (group of inputs) of the network belongs to parts of the body, if
    the skeleton lacks one of ROLES, or if the healthy character walks no complete gait cycle.
    """
    spec = playable_data(network, runtime)
    if any(channel["regions"] for channel in spec.get("channels", ())):
        assert network.skeleton is not None
        healthy = healthy_walk(network, network.skeleton, runtime)
        if healthy is not None:
            spec["recogniser"] = {"learnt": packed_statistics(), "healthy": healthy}
    return spec


def healthy_walk(network: Network, skeleton: Skeleton, runtime: Runtime) -> Profile | None:
    """The profile of the healthy character walking straight on. Bones have constant lengths, as in the page.

    None if the skeleton lacks one of ROLES, or if the character walks no complete gait cycle.
    """
    if not all(f"{side}_{part}" in skeleton.roles for side in SIDES for part in ROLES):
        return None
    poses = [pose for _, pose in walk_straight(network, runtime, HEALTHY_WARM_UP + HEALTHY_MEASURED, {})][
        HEALTHY_WARM_UP:
    ]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    walk = measure_cycles(skeleton, restore_bone_lengths(skeleton, positions, rotations)[1], 60)
    return profile_of_walk(walk) if len(walk) else None


def packed_statistics(statistics: Grader | None = None) -> dict[str, Any]:
    """Packs what the graded recogniser of `hobble.gait.recognise` learnt from people's walks.

    A walk has D features. statistics: by default those learnt from all people.

    In the result, `features`: names of the features. `strengths`: the strengths of a limp that are tried; 1
    is the mean strength of people's limps. `healthySpread`: (D, D) covariance of healthy walks. `kinds`: a
    list with an entry for each kind of limp. A kind has a `label`, such as "antalgic", and a `side`: "left",
    "right", or the direction in which the trunk leans. An entry also has the kind in `words` for the page,
    the `mean` (D,) of the features at strength 1, and their covariance `spread` (D, D). Arrays are float64
    in base64.
    """
    statistics = statistics or grader_of_all_people()
    normal = healthy_profile([])
    return {
        "features": list(features(normal, normal)),  # any two profiles do: only the names are used
        "strengths": STRENGTHS.tolist(),
        "healthySpread": to_base64(statistics.healthy),
        "kinds": [
            {
                "label": label,
                "side": side,
                "words": kind_in_words(label, side),
                "mean": to_base64(mean),
                "spread": to_base64(spread),
            }
            for (label, side), (mean, spread) in statistics.kinds.items()
        ],
    }


def kind_in_words(label: str, side: str) -> str:
    """What may hurt, such as "left thigh, shank or foot" or "back, leaning forward".

    label, side: a key of `Grader.kinds`.
    """
    parts = PARTS[label]
    parts_in_words = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} or {parts[-1]}"
    return f"{parts_in_words}, leaning {side}" if label == LEANING else f"{side} {parts_in_words}"


# A weight is stored as an integer times a factor. This many weights of a row share a factor. With one factor
# for a whole row the error doubles.
GROUP = 64
LARGEST_INTEGER = 127


def round_weights(spec: Mapping[str, Any]) -> dict[str, Any]:
    """A character with weights of 8 bits instead of 16. spec: its data, from `hobble.report.character`.

    A network without layers of weights, such as motion matching, stays as it is.
    """
    network = {
        key: [_round_layer(layer) for layer in value] if _are_layers(value) else value
        for key, value in spec["network"].items()
    }
    return {**spec, "network": network}


def _are_layers(value: Any) -> bool:
    """Whether an entry of the network's data is a list of layers with weights."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict) and "biases" in value[0]


def _round_layer(packed_layer: Mapping[str, Any]) -> dict[str, Any]:
    """A layer with weights of 8 bits. packed_layer: from `hobble.models.network.pack_layer`."""
    shape = packed_layer["points"], packed_layer["rows"], packed_layer["columns"]
    integers = np.frombuffer(base64.b64decode(packed_layer["weights"]), "<i2").reshape(shape)
    scale = np.frombuffer(base64.b64decode(packed_layer["scale"]), "<f4").reshape(*shape[:2], 1)
    small, factors = _round_in_groups(integers * scale)
    return {
        **packed_layer,
        "bits": 8,
        "group": GROUP,
        "weights": to_base64(small.reshape(*shape[:2], -1)[..., : shape[2]]),
        "scale": to_base64(factors),
    }


def _round_in_groups(weights: Array) -> tuple[Array, Array]:
    """Round weights (..., columns) to integers (..., groups, GROUP) times factors (..., groups).

    Returns the integers and the factors. The last group of a row is padded with 0.
    """
    groups = -(-weights.shape[-1] // GROUP)  # rounded up
    padded = np.zeros((*weights.shape[:-1], groups * GROUP))
    padded[..., : weights.shape[-1]] = weights
    padded = padded.reshape(*weights.shape[:-1], groups, GROUP)
    factors = np.maximum(np.abs(padded).max(axis=-1) / LARGEST_INTEGER, 1e-30).astype(np.float32)
    return np.round(padded / factors[..., None]).astype(np.int8), factors
