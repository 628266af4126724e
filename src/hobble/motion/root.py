"""Computes the root of each frame: where the character is and where it faces. Converts to root coordinates.

The formulas are those of the original pipeline (Holden, Komura, Saito 2017). The root is on the ground below
the hips. Its Z axis is the facing direction, its X axis points to the character's left. A rotation "world to
root" converts a world vector to root coordinates.
"""

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, path_to_root, rest_positions
from hobble.core.smooth import gaussian

STEADY = 10  # frames at 60 Hz; their median velocity continues the root beyond an end of the clip


@dataclass(frozen=True)
class RootFrames:
    """The root of each of F frames.

    position: (F, 2) x and z of the hips, cm, not smoothed. direction: (F, 3) unit facing direction,
    horizontal, smoothed. rotation: (F, 4) world to root: the rotation about Y that takes `direction` to +Z.
    turn: (F - 1,) radians by which the world turns, seen from the root, from each frame to the next. The root
    itself turns by the same angle in the other direction. The network predicts `turn` with this sign.
    """

    position: Array = field(repr=False)
    direction: Array = field(repr=False)
    rotation: Array = field(repr=False)
    turn: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.position)


def across_body(skeleton: Skeleton, positions: Array) -> Array:
    """Unit vectors (..., 3) from the body's right to its left: the mean over shoulders and hips.

    positions: (..., J, 3) of the joints.
    """
    pairs = ([skeleton.role(f"{s}_{part}") for s in ("left", "right")] for part in ("shoulder", "hip"))
    shoulders, hips = (positions[..., a, :] - positions[..., b, :] for a, b in pairs)
    across = shoulders + hips
    return across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)


def facing_directions(skeleton: Skeleton, positions: Array, sigma: float) -> Array:
    """Facing direction (F, 3), unit and horizontal, of joint positions (F, J, 3).

    It is the cross product of `across_body` and up, smoothed over time by a Gaussian and normalised again.
    Beyond the ends of the clip, the smoothing uses its first and last frame. sigma: standard deviation of the
    Gaussian in frames; 0 for no smoothing.
    """
    forward = np.cross(across_body(skeleton, positions), [0.0, 1.0, 0.0])
    if sigma > 0:
        forward = gaussian(forward, sigma)
    return forward / np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), 1e-9)


def root_frames(clip: Clip, sigma: float) -> RootFrames:
    """The root of every frame of a clip. sigma: as for `facing_directions`; usually 20 frames at 60 Hz."""
    direction = facing_directions(clip.skeleton, clip.positions, sigma)
    rotation = quat.yaw(-np.arctan2(direction[:, 0], direction[:, 2]))
    change = quat.rotate(quat.mul(rotation[1:], quat.inv(rotation[:-1])), np.array([0.0, 0.0, 1.0]))
    turn = np.arctan2(change[:, 0], change[:, 2])
    hips = clip.skeleton.role("hips")
    return RootFrames(clip.positions[:, hips][:, [0, 2]], direction, rotation, turn)


def extend_root(root: RootFrames, frames: int) -> RootFrames:
    """The root, continued by `frames` frames at each end of the clip.

    It goes straight on, with the facing direction at that end and the median velocity of the nearest STEADY
    frames. Frame i of the clip is frame i + `frames` of the result. On walks of the CMU database, a path that
    is continued in this way for half a second ends 11 cm off the captured path.
    """
    steps = np.diff(root.position, axis=0) if len(root) > 1 else np.zeros((1, 2))
    distance = np.arange(1, frames + 1)[:, None]  # frames from the end of the clip
    before = root.position[0] - distance[::-1] * np.median(steps[:STEADY], axis=0)
    after = root.position[-1] + distance * np.median(steps[-STEADY:], axis=0)

    def repeat_ends(values: Array) -> Array:
        return np.pad(values, ((frames, frames), (0, 0)), mode="edge")

    return RootFrames(
        np.concatenate([before, root.position, after]),
        repeat_ends(root.direction),
        repeat_ends(root.rotation),
        np.pad(root.turn, frames),
    )


def points_to_root(root: RootFrames, points: Array, frames: Array | slice | None = None) -> Array:
    """World points (N, ..., 3), cm, in root coordinates.

    frames: the N frames whose roots are used, point by point; by default all frames. Heights stay relative to
    the world's zero.
    """
    at = slice(None) if frames is None else frames
    position, _ = _roots_to_broadcast(root, at, points)
    origin = np.zeros((*position.shape[:-1], 3))
    origin[..., [0, 2]] = position
    return vectors_to_root(root, points - origin, at)


def vectors_to_root(root: RootFrames, vectors: Array, frames: Array | slice | None = None) -> Array:
    """World vectors (N, ..., 3), such as velocities and directions, in root coordinates.

    frames: as for `points_to_root`.
    """
    _, rotation = _roots_to_broadcast(root, slice(None) if frames is None else frames, vectors)
    return quat.rotate(rotation, vectors)


def rotations_to_root(root: RootFrames, rotations: Array, frames: Array | slice | None = None) -> Array:
    """World rotations (N, ..., 4) as rotations (N, ..., 4) relative to the root.

    frames: as for `points_to_root`.
    """
    _, to_root = _roots_to_broadcast(root, slice(None) if frames is None else frames, rotations)
    return quat.mul(np.broadcast_to(to_root, rotations.shape), rotations)


def usual_rotations(skeleton: Skeleton) -> Array:
    """Rotations (J, 4) relative to the root of a person who stands, with upper arms down and forearms ahead.

    A forearm that points ahead has turned by 120 degrees from a T-pose, so it often turns by more than 180,
    where the axis times the angle jumps. From here, hardly any motion turns it by half a turn. Without the
    role of an elbow, the joints of the arm have no rotation.
    """
    out, rest = np.tile(quat.IDENTITY, (len(skeleton.joints), 1)), rest_positions(skeleton)
    down, ahead = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    for side in ("left", "right"):
        if f"{side}_elbow" not in skeleton.roles:
            continue  # nothing shows how this arm points
        shoulder, elbow = (skeleton.role(f"{side}_{part}") for part in ("shoulder", "elbow"))
        upper_arm = quat.between(rest[elbow] - rest[shoulder], down)
        for joint in range(len(skeleton.joints)):
            path = path_to_root(skeleton.parents, joint)
            if elbow in path:
                out[joint] = quat.mul(quat.between(down, ahead), upper_arm)
            elif shoulder in path:
                out[joint] = upper_arm
    return out


def local_pose(clip: Clip, root: RootFrames) -> tuple[Array, Array, Array]:
    """The pose as the network sees it, for the frames 0 .. F-2.

    The last frame is left out, because it has no velocity to a next frame.

    Returns positions (F-1, J, 3) in cm, velocities (F-1, J, 3) in cm a frame, and rotations (F-1, J, 3) as
    axis times half the angle in radians. All are in the root coordinates of their frame. An angle may be more
    than half a turn: it is the one that is continuous around `usual_rotations`.
    """
    frames = slice(0, len(clip) - 1)
    positions = points_to_root(root, clip.positions[frames], frames)
    velocities = vectors_to_root(root, np.diff(clip.positions, axis=0), frames)
    to_root = rotations_to_root(root, clip.global_rotations[frames], frames)
    rotations = quat.log(to_root, usual_rotations(clip.skeleton))
    return positions, velocities, rotations


def _roots_to_broadcast(root: RootFrames, frames: Array | slice, values: Array) -> tuple[Array, Array]:
    """Position (N, 1, ..., 2) and rotation (N, 1, ..., 4) of the roots of N frames.

    They have as many axes as `values` (N, ..., k), so that they broadcast with them.
    """
    position, rotation = root.position[frames], root.rotation[frames]
    between = (1,) * (values.ndim - 2)
    return position.reshape(len(position), *between, 2), rotation.reshape(len(rotation), *between, 4)
