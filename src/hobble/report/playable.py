"""Packs a trained network to run in the report page: 16-bit weights, and what the page's runtime needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.channels import channel
from hobble.channels.shown import channel_display, channel_words
from hobble.channels.speed_limits import SLOWEST
from hobble.core.several_effects import SUM_NORM
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.models.network import Network, inverse_or_0
from hobble.models.packing import to_base64
from hobble.rows.layout import RowLayout
from hobble.runtime import (
    advance,
    caller_targets,
    feet,
    foot_lock,
    leg_reach,
    limits,
    network_rows,
    trajectory,
)
from hobble.runtime.bounds import Bounds
from hobble.runtime.character import start_characters
from hobble.runtime.options import Runtime

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
    outputs, scale = _used_outputs(layout, turning), inverse_or_0(network.x_std)
    inputs = np.flatnonzero(scale > NO_EFFECT)
    legs = feet.leg_joints(skeleton)
    sole = feet.sole_heights(network, legs).tolist()
    parts = feet.foot_parts(skeleton, legs)
    return {
        "network": {"kind": network.kind, **network.page_data(inputs, outputs)},
        "recordedPoses": network.plays_recorded_poses,
        "inputColumns": inputs.tolist(),
        "xMean": to_base64(network.x_mean[inputs].astype(np.float32)),
        "xScale": to_base64(scale[inputs].astype(np.float32)),
        "yMean": to_base64(network.y_mean[outputs].astype(np.float32)),
        "yStd": to_base64(network.y_std[outputs].astype(np.float32)),
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


def _used_outputs(layout: RowLayout, turning: Sequence[int]) -> NDArray[np.int64]:
    """Indices of the outputs that the page uses.

    Of the rotations, which are the last block, only those of the joints `turning` are used. All other outputs
    are used.
    """
    start = layout.y_joint_rotation.start
    rotations = start + 3 * np.asarray(turning)[:, None] + np.arange(3)
    return np.concatenate([np.arange(start), rotations.ravel()])


def skeleton_of(spec: Mapping[str, Any]) -> Skeleton:
    """The skeleton of a character that `playable_data` packed. It has all that is needed to draw the body."""
    joints, parents = tuple(spec["names"]), tuple(spec["parents"])
    return Skeleton("", joints, parents, np.array(spec["offsets"]), spec["roles"])


def _bounds(network: Network, outputs: NDArray[np.int64]) -> dict[str, Any]:
    """The ranges to which the page clips inputs and outputs, from `hobble.runtime.bounds`.

    outputs: indices of the outputs that the page uses. The ranges of all inputs are packed.
    """
    bounds = Bounds.of(network)
    y_low, y_high = bounds.y_low[outputs], bounds.y_high[outputs]
    arrays = {"xLow": bounds.x_low, "xHigh": bounds.x_high, "yLow": y_low, "yHigh": y_high}
    return {name: to_base64(array.astype(np.float32)) for name, array in arrays.items()} | {
        "fastest": bounds.fastest,
        "hips": list(bounds.hips),
    }


def _start(network: Network) -> dict[str, Any]:
    """The state in which a character begins, at the origin and facing ahead."""
    state = start_characters(network, 1, np.zeros((1, 2)), np.zeros(1))
    names = ("position", "direction", "gait", "joint_position", "joint_velocity", "joint_rotation")
    arrays = {name: to_base64(getattr(state, name)[0].astype(np.float32)) for name in names}
    return {**arrays, "phase": float(state.phase[0])}


def _constants() -> dict[str, float]:
    """The constants of the Python runtime, packed so that the page does not define them a second time."""
    return {
        "targetMix": trajectory.TARGET_MIX,
        "gaitMix": trajectory.GAIT_MIX,
        "still": trajectory.STILL,
        "steeringLimit": trajectory.STEERING_LIMIT,
        "correctionRate": trajectory.CORRECTION_RATE,
        "correctionWithin": trajectory.CORRECTION_WITHIN,
        "mostCorrection": trajectory.MOST_CORRECTION,
        "backwardLoss": advance.BACKWARD_LOSS,
        "pull": advance.PULL,
        "pullAhead": advance.PULL_AHEAD,
        "furthestTurn": float(trajectory.FURTHEST_TURN),
        "strafeFrom": float(trajectory.STRAFE_FROM),
        "turnInPlace": float(caller_targets.TURN_IN_PLACE),
        "jogFrom": limits.JOG_FROM,
        "lameBelow": limits.LAME_BELOW,
        "hurryFactor": limits.HURRY_FACTOR,
        "slowestShare": SLOWEST,
        "sumNorm": SUM_NORM,
        "lockAt": foot_lock.LOCK_AT,
        "release": foot_lock.RELEASE,
        "tooFar": foot_lock.TOO_FAR,
        "tooFarAlone": foot_lock.TOO_FAR_ALONE,
        "missed": foot_lock.MISSED,
        "missedAlone": foot_lock.MISSED_ALONE,
        "stepFrames": foot_lock.STEP_FRAMES,
        "stepHeight": foot_lock.STEP_HEIGHT,
        "fastestTurn": float(network_rows.FASTEST_TURN),
        "heightMix": feet.HEIGHT_MIX,
        "fastestLift": feet.FASTEST_LIFT,
        "floating": feet.FLOATING,
        "bodyMix": feet.BODY_MIX,
        "bodyFree": feet.BODY_FREE,
        "bodyMinContact": feet.BODY_MIN_CONTACT,
        "mostClimb": network_rows.MOST_CLIMB,
        "mostAdded": leg_reach.MOST_ADDED,
        "kneeAhead": leg_reach.KNEE_AHEAD,
        "stretch": feet.STRETCH,
        "behind": feet.BEHIND,
    }
