"""Packs what a page plays: a network, a recogniser of limps, and captured beside predicted clips."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
from hobble.core.files import load_npz, to_base64
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.engine.hob import character_bytes
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.gait.cycles import SCALARS, measure_cycles
from hobble.gait.profile import Profile, profile_of_walk
from hobble.gait.recognise import LEANING, PARTS, SIDES, STRENGTHS, grader_of_all_people
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, load_clip_rows, unbroken_stretches
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.generated import restore_bone_lengths
from hobble.runtime.leg import leg_joints

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
    makes the walk limp most, by how much longer the sound leg stands than the hurt one; the first one if no
    limps were measured. `value` is its value, in tenths of the highest.
    """
    channel = opening_channel(playable)
    if channel is None:
        return {"part": None, "value": 0}
    # Column -> label of its slider. A row of the limps that were measured names its column under "link".
    labels = {channel["columns"][i]: label for label, i in channel["sliders"].items()}
    sizes = dict.fromkeys(labels.values(), 0.0)
    for row in (row for results in measurements for row in results.get("sizes") or ()):
        if row.get("gait") == "walk" and row["link"] in labels:
            label = labels[row["link"]]
            sizes[label] = max(sizes[label], abs(row.get("stance") or 0.0))
    return {"part": max(sizes, key=lambda label: sizes[label]), "value": OPENING_VALUE}


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
LIMBS = ("hip_flexion", "hip_abduction", "knee_flexion", "ankle_height", "ankle_forward", "arm_forward")
TRUNK = ("trunk_forward", "trunk_left", "pelvis_left_up")
CURVES_IN_C = (*(f"{limb}_{side}" for side in "LR" for limb in LIMBS), *TRUNK)
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


def packed_statistics() -> dict[str, Any]:
    """What the graded recogniser of `hobble.gait.recognise` learnt from people's walks.

    In the result, `words`: for each kind of limp what
    may hurt. `learnt`: the numbers that `c/hobble_gait.h` describes, float64 in base64.
    """
    statistics = grader_of_all_people()
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


FPS = 20  # frame rate of the motion in the page
UNIT = 0.01  # joint positions are stored as 16-bit integers in steps of this many cm
TURN = 32767  # the integer that stands for 1 in packed rotations


def packed_motion(positions: Array, rotations: Array, keep: Sequence[int]) -> dict[str, str]:
    """Packs world positions (F, J, 3), cm, and rotations (F, J, 4) of the joints `keep`, as base64.

    In the result, `root`: (F, 3) positions of joint 0, float32, cm. `pose`: positions relative to joint 0,
    int16, in steps of UNIT. `turn`: rotations, int16, where TURN stands for 1.
    """
    root = positions[:, 0].astype(np.float32)
    steps = np.round((positions[:, keep] - root[:, None].astype(float)) / UNIT)
    turns = np.round(np.clip(rotations[:, keep], -1, 1) * TURN)
    return {
        "root": to_base64(root),
        "pose": to_base64(np.clip(steps, -32767, 32767).astype(np.int16)),
        "turn": to_base64(turns.astype(np.int16)),
    }


FEWEST_CLIPS = 6  # if fewer clips are held out, training clips are added up to this number
MOST_HELD_OUT = 6  # at most this many held-out clips are shown; each takes up to 150 kB of the page
LONGEST = 12 * 60  # at most this many frames of a clip are shown: 12 seconds


def packed_comparisons(
    network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]
) -> dict[str, Any]:
    """The longest stretch of consecutive frames of each shown clip, captured and predicted.

    paths: `database/clips/<clip>.npz`. splits: clip -> "held_out" or "train". At most MOST_HELD_OUT held-out
    clips are shown. If fewer than FEWEST_CLIPS are held out, training clips are added. Each pose is predicted
    from the captured input of the frame before. The ground is the first terrain fit of the frame: fits are
    ground heights that suit the motion. Both motions are drawn at the captured root.

    Keys of the result: `fps`; `joints`, the number of joints that are drawn; `body`, the key of the body's
    mesh; `clips`, one `_compared_clip` each. It is {} if there is no clip to show or the network has no
    skeleton.
    """
    if network.skeleton is None:
        return {}
    drawn_joints = body_mesh(network.skeleton).bones.tolist()
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    # Take clips from all over the list: neighbours in it are often takes of the same motion.
    for path in order[: max(FEWEST_CLIPS, held_out)][:: max(1, -(-held_out // MOST_HELD_OUT))]:
        rows = load_clip_rows(path, longest_stretch(path))
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared_clip(network, rows, splits.get(rows.clip, "train"), drawn_joints))
    if not clips:
        return {}
    return {"fps": FPS, "joints": len(drawn_joints), "body": mesh_key(network.skeleton), "clips": clips}


def longest_stretch(path: str | Path) -> tuple[int, int]:
    """First row of a clip's longest stretch of consecutive frames, and the row after its last.

    The stretch is cut to LONGEST frames. Both numbers are 0 if the clip has no rows.
    """
    stretches = unbroken_stretches(load_npz(path, ["frame"])["frame"])
    if not stretches:
        return 0, 0
    longest = max(stretches, key=len)[:LONGEST]
    return int(longest[0]), int(longest[-1]) + 1


def _compared_clip(network: Network, rows: ClipRows, split: str, drawn_joints: list[int]) -> dict[str, Any]:
    """The data of one clip for the page.

    rows: consecutive frames of the clip. Keys of the result: `name` of the clip; `split`; `frames`, their
    number; `captured` and `predicted`, from `packed_motion`; `error`, for each frame the mean distance from
    predicted to captured joints, cm.
    """
    found = ProceduralAnimation(network).compare(rows)
    frame_step = round(60 / FPS)  # rows have 60 frames a second, the page has FPS
    error = found.distance.mean(axis=1)[::frame_step]
    assert network.skeleton is not None
    captured, predicted = (
        restore_bone_lengths(
            network.skeleton, pose.positions[::frame_step], pose.rotations[::frame_step].astype(float)
        )
        for pose in (found.truth, found.predicted)
    )
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(error),
        "captured": packed_motion(captured[1], captured[0], drawn_joints),
        "predicted": packed_motion(predicted[1], predicted[0], drawn_joints),
        "error": np.round(error, 2).tolist(),
    }
