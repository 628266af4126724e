"""A rig's motion told anew on an upright one: the same joints in the same places, in a rest pose that stands.

What a joint's rotations mean depends on the pose in which all of them are zero. Where a person could stand in
that pose, it is the rest pose. Where nobody could (all bones along one axis, a heap of twisted bones), the
directions of the bones while the figure moves tell how each joint is turned when its bone points down a leg,
out along an arm or up the trunk; knees and elbows tell where a limb's front is, and feet that stand, what is
level.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations, rest_positions
from hobble.motion.axes import rest_frame
from hobble.motion.body import REACH, SIDES, Body, above

UP, AHEAD, LEFT = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
LEG, TRUNK, HEAD, FOOT = 40.0, 40.0, 50.0, 50.0  # degrees off the straight at which a person still stands
STEADY = 0.15  # share of frames, those in which a foot is lowest and slowest, that tell how it stands
SAMPLES = 400
FLEXED = 0.05  # mean sine of the bend of a knee or an elbow from which on it tells where the front is
MOVES = 0.1  # cm
BALL = np.array([0.0, -0.045, 0.14])  # from the ankle, to the length of the leg, of a foot without toes
TRUSTED = (
    30.0  # degrees between what zero pose and motion say of a joint, from which on the motion is believed
)
SHRUG = 12.0  # degrees from the chest, on average, up to which clavicles are at rest as in the zero pose
LIMP = 60.0  # and hands from their forearms
UPRIGHT = 0.6  # height of the hips above a foot that stands, to the length of the leg
AGREE = np.radians(25.0)  # joints of a trunk that are turned no further from each other have one rest pose
SHORT = 2.0  # cm: a bone shorter than this has no direction


@dataclass(frozen=True)
class Upright:
    """A clip whose rest pose stands, facing +Z with the arms out; its joints are those of the body.

    rest: where the stance is from, in words. body: the parts by their new indices.
    """

    clip: Clip = field(repr=False)
    body: Body
    rest: str


@dataclass(frozen=True)
class Spine:
    """Where the bones of a trunk and a neck point in a rest pose that stands, facing +Z.

    shares: (N,) how far up from hips (0) to chest (1) the bones begin. axes: (N, 3). neck: (3,) to the head.
    """

    shares: Array
    axes: Array
    neck: Array

    @classmethod
    def of(cls, skeleton: Skeleton, body: Body) -> Spine:
        """The spine of a skeleton, whose rest pose stands; what comes to it should point as it does."""
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        chain = (body.hips, *body.trunk, *body.neck, body.head)
        long = [j for k, j in enumerate(chain[1:]) if np.linalg.norm(rest[j] - rest[chain[k]]) > SHORT]
        long = [body.hips, *long]
        way = np.concatenate(
            [[0.0], np.cumsum([np.linalg.norm(rest[b] - rest[a]) for a, b in pairwise(long)])]
        )
        axes = np.array([_unit(rest[b] - rest[a]) for a, b in pairwise(long)])
        chest = max(
            float(np.linalg.norm(np.diff(rest[list(chain[: len(body.trunk) + 1])], axis=0), axis=-1).sum()),
            1e-9,
        )
        below = way[:-1] <= chest * 1.001
        return cls(way[:-1][below] / chest, axes[below], axes[-1])

    def at(self, share: float) -> Array:
        """(3,) where the bone points that begins nearest below a share of the way, or little above it."""
        return self.axes[max(0, int(np.searchsorted(self.shares, share + REACH, side="right")) - 1)]


def stands(body: Body, rest: Array) -> str | None:
    """What keeps anybody from standing in a rest pose, in words; None where nothing does. rest: (J, 3)."""
    hips = 0.5 * (rest[body.legs["left"][0]] + rest[body.legs["right"][0]])
    shoulders = 0.5 * (rest[body.arms["left"][1]] + rest[body.arms["right"][1]])
    up = _unit(shoulders - hips)
    left = rest[body.legs["left"][0]] - rest[body.legs["right"][0]]
    across = rest[body.arms["left"][1]] - rest[body.arms["right"][1]]
    if _off(left, across) > 30 or abs(_off(left, up) - 90) > 25:
        return "hips and shoulders lie crosswise"
    if _off(rest[body.head] - shoulders, up) > HEAD:
        return "the head is not above the shoulders"
    ahead = np.cross(_unit(left), up)
    facing = []
    for side in SIDES:
        hip, knee, heel, toe = body.legs[side]
        if max(_off(rest[knee] - rest[hip], -up), _off(rest[heel] - rest[knee], -up)) > LEG:
            return f"the {side} leg does not point down"
        if toe is not None:
            foot = rest[toe] - rest[heel]
            level = foot - up * (foot @ up)
            facing.append(level @ ahead)
            if abs(_off(level, ahead) - 90) < 90 - FOOT or np.linalg.norm(level) < 0.4 * np.linalg.norm(foot):
                return f"the {side} foot does not point forward"
    if facing and min(facing) < 0 < max(facing):
        return "the feet point in opposite directions"
    trunk = [rest[j] for j in (body.hips, *body.trunk)]
    for a, b in pairwise(trunk):
        if np.linalg.norm(b - a) > SHORT and _off(b - a, up) > TRUNK:
            return "the trunk is not straight"
    return None


def upright(clip: Clip, body: Body, spine: Spine, others: Collection[int] = ()) -> Upright:
    """The motion of a body on a rig that stands in its rest pose. clip: centimetres, right-handed, Y up.

    spine: where the bones of a trunk point in that pose.

    Where the bones point decides alone how trunk, limbs and feet are turned, so that the same motion comes
    out of any rig alike; a zero pose that stands adds what no bone shows: how head, clavicles and hands are
    turned. others: further joints that are to be kept, turned as the part of the body that they hang from.
    """
    every = np.unique(np.linspace(0, len(clip) - 1, SAMPLES).round().astype(int))
    ends = {
        side: clip.skeleton.end_sites.get(clip.skeleton.joints[leg[2]]) for side, leg in body.legs.items()
    }
    seen = _Seen(body, clip.positions[every], clip.global_rotations[every], ends, spine)
    rest = rest_positions(clip.skeleton)
    frames, problem = seen.from_motion(), stands(body, rest)
    if problem is None:
        zero = seen.from_rest(rest)
        if max(_apart(zero[j], frames[j]) for j in (body.hips, *body.trunk)) > TRUSTED:
            problem = "the trunk is twisted"
        else:
            _add_rest(frames, zero, seen)
    said = "its zero pose" if problem is None else f"its motion, since in its zero pose {problem}"
    kept = _kept(clip, seen, others, frames)
    clip, body = _with_balls(clip, body, frames)
    return Upright(*_told_anew(clip, body, [*body.joints, *kept], frames), said)


def _add_rest(frames: dict[int, Array], zero: dict[int, Array], seen: _Seen) -> None:
    """Put into `frames` what the zero pose knows better."""
    body = seen.body
    if _apart(zero[body.head], frames[body.head]) < TRUSTED:
        frames[body.head] = zero[body.head]
    for side in SIDES:
        clavicle, _, _, wrist = body.arms[side]
        if clavicle is not None and _apart(frames[body.chest], frames[clavicle]) < SHRUG:
            frames[clavicle] = frames[body.chest]
        if _apart(zero[wrist], frames[wrist]) < LIMP:
            frames[wrist] = zero[wrist]
        heel, toe = body.legs[side][2:]
        frames[heel] = _foot(frames[heel], zero[heel], seen, side)
        if toe is not None:
            frames[toe] = _foot(frames[toe], zero[toe], seen, side)


def _foot(standing: Array, zero: Array, seen: _Seen, side: str) -> Array:
    """How a foot is turned: rolled as it stands, pointing as in the zero pose, where the two agree at all.

    Feet of a rig whose legs are splayed in the zero pose are rolled there; a patient's foot may never be
    flat.
    """
    if not seen.stands(side):
        return zero
    heel, toe = seen.body.legs[side][2:]
    if toe is None:
        return zero if _apart(standing, zero) < TRUSTED else standing
    bone = seen.bone(heel, toe)
    if _apart(standing, zero) > TRUSTED + 60:
        return standing
    wanted, found = (quat.rotate(quat.inv(frame), bone) for frame in (zero, standing))
    return quat.mul(standing, quat.between(wanted, found)) if _off(wanted, found) < TRUSTED else standing


def _apart(a: Array, b: Array) -> float:
    """Degrees between two rotations."""
    return float(np.degrees(quat.angle(a, b)))


def _kept(clip: Clip, seen: _Seen, others: Collection[int], frames: dict[int, Array]) -> list[int]:
    """Those of the other joints that can be kept, with their frames put into `frames`.

    Each is turned, on average, as the part of the body that it hangs from; the base of a finger points along
    it.
    """
    body, parents = seen.body, clip.skeleton.parents
    out = []
    for joint in sorted(set(others) - set(body.joints)):
        carrier = next((j for j in above(parents, joint)[1:] if j in body.joints), None)
        if carrier is None:
            continue
        part = quat.mul(seen.turned[:, carrier], frames[carrier])
        frames[joint] = _mean(quat.mul(quat.inv(seen.turned[:, joint]), part))
        for side, sign in (("left", 1.0), ("right", -1.0)):
            tips = [j for j in others if joint in above(parents, j)[1:]]
            bones = [bone for j in tips if np.linalg.norm(bone := seen.bone(joint, j)) > SHORT]
            if carrier == body.arms[side][3] and bones:
                frames[joint] = _pointed(frames[joint], sign * LEFT, bones[0])
        out.append(joint)
    return out


class _Seen:
    """What is seen of a body in the frames that are looked at: bones, fronts, and how its joints are turned.

    A joint's frame is the rotation (4,) from the axes of a figure that stands facing +Z, arms out, to the
    joint's own: its world rotation times it is how far the part is turned from that stance.
    """

    def __init__(
        self,
        body: Body,
        positions: Array,
        rotations: Array,
        ends: Mapping[str, tuple[float, float, float] | None],
        spine: Spine,
    ) -> None:
        self.body, self.at, self.turned, self.ends, self.spine = body, positions, rotations, ends, spine
        self.hips_left = self.line(body.legs["right"][0], body.legs["left"][0])
        self.chest_left = self.line(body.arms["right"][1], body.arms["left"][1])

    def line(self, start: int, end: int) -> Array:
        """(S, 3) unit vectors from joint to joint."""
        return _unit(self.at[:, end] - self.at[:, start])

    def local(self, joint: int, vectors: Array) -> Array:
        """The mean of world vectors (S, 3) as the joint has them, (3,)."""
        own = quat.rotate(quat.inv(self.turned[:, joint]), vectors)
        return _robust(own)

    def bone(self, start: int, end: int) -> Array:
        """(3,) the bone to `end` as `start` has it."""
        return self.local(start, self.at[:, end] - self.at[:, start])

    def from_rest(self, rest: Array) -> dict[int, Array]:
        """Frames of all joints from a rest pose (J, 3) that stands; limbs by where they point in it."""
        body = self.body
        across = [
            rest[side["left"][k]] - rest[side["right"][k]] for side, k in ((body.legs, 0), (body.arms, 1))
        ]
        left = _unit(_unit(across[0]) + _unit(across[1]))
        middle = [
            0.5 * (rest[side["left"][k]] + rest[side["right"][k]])
            for side, k in ((body.legs, 0), (body.arms, 1))
        ]
        upward = rest[body.head] - rest[body.hips]
        whole = _snapped(
            _frame(upward if upward @ (middle[1] - middle[0]) > 0 else middle[1] - middle[0], UP, left, LEFT)
        )
        frames = dict.fromkeys((body.hips, *body.trunk, *body.neck, body.head), whole)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            clavicle, shoulder, elbow, wrist = body.arms[side]
            if clavicle is not None:
                frames[clavicle] = whole
            for start, end in ((shoulder, elbow), (elbow, wrist)):
                frames[start] = _pointed(whole, sign * LEFT, self.bone(start, end))
            frames[wrist] = self._hand(side, frames[elbow], sign)
            hip, knee, heel, toe = body.legs[side]
            for start, end in ((hip, knee), (knee, heel)):
                frames[start] = _pointed(whole, -UP, self.bone(start, end))
            frames[heel] = whole
            if toe is not None:
                frames[toe] = whole
        return frames

    def from_motion(self) -> dict[int, Array]:
        """Frames of all joints from where their bones point while the figure moves."""
        frames: dict[int, Array] = {}
        self._trunk(frames)
        for side, sign in (("left", 1.0), ("right", -1.0)):
            self._arm(frames, side, sign)
            self._leg(frames, side)
        return frames

    def _trunk(self, frames: dict[int, Array]) -> None:
        body = self.body
        chain = (body.hips, *body.trunk)
        ends = (*body.neck, body.head)
        both = _unit(self.hips_left + self.chest_left)
        steps = [
            float(np.median(np.linalg.norm(self.at[:, b] - self.at[:, a], axis=-1)))
            for a, b in pairwise(chain)
        ]
        way = np.concatenate([[0.0], np.cumsum(steps)])
        for i, joint in enumerate(chain):
            left = self.hips_left if i == 0 else self.chest_left if joint == body.chest else both
            following = (*chain[i + 1 :], *ends)
            bone = self._first_long(joint, following)
            frames[joint] = _frame(
                bone, self.spine.at(way[i] / max(way[-1], 1e-9)), self.local(joint, left), LEFT
            )
        for i, joint in enumerate(body.neck):
            bone = self._first_long(joint, ends[i + 1 :])
            axis = self.spine.neck if joint == body.neck[-1] else self.spine.at(1.0)
            frames[joint] = _frame(bone, axis, self.local(joint, self.chest_left), LEFT)
        frames[body.head] = self._head(frames, (*chain, *body.neck))

    def _first_long(self, joint: int, following: Sequence[int]) -> Array:
        bones = [self.bone(joint, end) for end in following]
        return next((bone for bone in bones if np.linalg.norm(bone) > SHORT), bones[-1])

    def _head(self, frames: dict[int, Array], chain: Sequence[int]) -> Array:
        """As the chest's, where all of the trunk agrees on what is up; else so that it mostly looks ahead."""
        chest = frames[self.body.chest]
        if len(chain) > 2 and max(float(quat.angle(frames[j], chest)) for j in chain) < AGREE:
            return chest
        ahead = _unit(np.cross(self.chest_left + self.hips_left, UP) * [1, 0, 1])
        up = self.local(self.body.head, np.broadcast_to(UP, ahead.shape))
        return _frame(up, UP, self.local(self.body.head, ahead), AHEAD)

    def _arm(self, frames: dict[int, Array], side: str, sign: float) -> None:
        clavicle, shoulder, elbow, wrist = self.body.arms[side]
        chest = quat.mul(self.turned[:, self.body.chest], frames[self.body.chest])
        if clavicle is not None:
            frames[clavicle] = _mean(quat.mul(quat.inv(self.turned[:, clavicle]), chest))
        hinge = self._hinge(shoulder, elbow, wrist, -self.chest_left)
        for start, end in ((shoulder, elbow), (elbow, wrist)):
            frames[start] = _frame(self.bone(start, end), sign * LEFT, self.local(start, hinge), -sign * UP)
        forearm = quat.mul(self.turned[:, elbow], frames[elbow])
        frames[wrist] = self._hand(side, _mean(quat.mul(quat.inv(self.turned[:, wrist]), forearm)), sign)

    def _hand(self, side: str, straight: Array, sign: float) -> Array:
        """The frame of a hand: as its forearm's, but pointing where its fingers are."""
        if side not in self.body.fingers:
            return straight
        return _pointed(straight, sign * LEFT, self.bone(self.body.arms[side][3], self.body.fingers[side]))

    def _leg(self, frames: dict[int, Array], side: str) -> None:
        hip, knee, heel, toe = self.body.legs[side]
        hinge = self._hinge(hip, knee, heel, self.hips_left)
        for start, end in ((hip, knee), (knee, heel)):
            frames[start] = _frame(self.bone(start, end), -UP, self.local(start, hinge), LEFT)
        flat = self._flat(heel, heel if toe is None else toe)
        if toe is not None:
            ahead = self.at[flat, toe] - self.at[flat, heel]
        elif (site := self.ends[side]) is not None and np.linalg.norm(site) > SHORT:
            ahead = quat.rotate(self.turned[flat, heel], np.array(site))
        else:
            ahead = np.cross(self.hips_left[flat], UP)
        level = quat.between(AHEAD, _unit(ahead * [1, 0, 1]))
        for joint in (heel, toe):
            if joint is not None:
                frames[joint] = _mean(quat.mul(quat.inv(self.turned[flat, joint]), level))

    def _hinge(self, start: int, middle: int, end: int, otherwise: Array) -> Array:
        """(S, 3) about what a limb bends, a knee to the body's left; `otherwise` where it hardly bends."""
        axis = np.cross(self.line(start, middle), self.line(middle, end))
        own = self.local(start, axis)
        if np.linalg.norm(own) < FLEXED:
            return otherwise
        return quat.rotate(self.turned[:, start], np.broadcast_to(_unit(own), axis.shape))

    def stands(self, side: str) -> bool:
        """Whether the body stands up while that foot is lowest and slowest."""
        hip, knee, heel, toe = self.body.legs[side]
        flat = self._flat(heel, heel if toe is None else toe)
        leg = sum(
            float(np.median(np.linalg.norm(self.at[:, b] - self.at[:, a], axis=-1)))
            for a, b in ((hip, knee), (knee, heel))
        )
        return bool(np.median(self.at[flat, hip, 1] - self.at[flat, heel, 1]) > UPRIGHT * leg)

    def _flat(self, heel: int, toe: int) -> NDArray[np.integer]:
        """The frames in which the whole foot stands: it is lowest and slowest then."""
        feet = self.at[:, [heel, toe]]
        speed = (
            np.linalg.norm(np.gradient(feet, axis=0), axis=-1).sum(axis=1)
            if len(feet) > 1
            else np.zeros(len(feet))
        )
        height = feet[..., 1].sum(axis=1)
        order = np.argsort(np.argsort(speed)) + np.argsort(np.argsort(height))
        return np.argsort(order)[: max(3, round(STEADY * len(feet)))]


def _told_anew(clip: Clip, body: Body, joints: list[int], frames: dict[int, Array]) -> tuple[Clip, Body]:
    """The clip on those joints alone, each turned from its new rest pose; and the body by its new indices."""
    skeleton = clip.skeleton
    joints = [
        body.hips,
        *sorted((j for j in joints if j != body.hips), key=lambda j: _depth(skeleton, body, j)),
    ]
    new = {old: i for i, old in enumerate(joints)}
    parents = [-1, *(new[_carrier(skeleton.parents, body, old, new)] for old in joints[1:])]
    own = np.stack([frames[j] for j in joints])
    turned = quat.mul(clip.global_rotations[:, joints], own)
    for side, finger in body.fingers.items():
        wrist = body.arms[side][3]
        out = quat.rotate(turned[:, new[wrist]], LEFT if side == "left" else -LEFT)
        hand = clip.positions[:, finger] - clip.positions[:, wrist]
        turned[:, new[wrist]] = quat.mul(quat.between(out, hand), turned[:, new[wrist]])
    places = clip.positions[:, joints]
    arms = quat.rotate(quat.inv(turned[:, parents]), places - places[:, parents])
    arms[:, 0] = 0.0
    offsets = np.median(arms, axis=0)
    moving = np.abs(arms - offsets).max() > MOVES
    moved = body.renumbered(new)
    names = tuple(skeleton.joints[j] for j in joints)
    made = Skeleton(skeleton.name, names, tuple(parents), offsets, roles=moved.roles(names))
    rotations = quat.continuous(local_rotations(made, turned))
    return Clip(clip.name, made, clip.fps, rotations, places[:, 0], arms if moving else None), moved


def _depth(skeleton: Skeleton, body: Body, joint: int) -> int:
    depth = 0
    while joint != body.hips:
        joint = _carrier(skeleton.parents, body, joint, body.joints)
        depth += 1
    return depth


def _carrier(parents: Sequence[int], body: Body, joint: int, among: Collection[int]) -> int:
    """What a part of the body hangs from; of any other joint, the nearest of `among` above it."""
    chain = (body.hips, *body.trunk, *body.neck, body.head)
    if joint in chain:
        return chain[chain.index(joint) - 1]
    for side in SIDES:
        for start, limb in ((body.chest, body.arms[side]), (body.hips, body.legs[side])):
            parts = (start, *(j for j in limb if j is not None))
            if joint in parts[1:]:
                return parts[parts.index(joint) - 1]
    return next((j for j in above(parents, joint)[1:] if j in among), body.hips)


def _with_balls(clip: Clip, body: Body, frames: dict[int, Array]) -> tuple[Clip, Body]:
    """The clip with a ball on every foot, and their frames: where a rig has none, where a body has it."""
    without = [side for side in SIDES if body.legs[side][3] is None]
    if not without:
        return clip, body
    skeleton = clip.skeleton
    names, parents, offsets = list(skeleton.joints), list(skeleton.parents), list(skeleton.offsets)
    legs = dict(body.legs)
    p = clip.positions
    for side in without:
        hip, knee, heel, _ = body.legs[side]
        thigh, shank = (
            float(np.median(np.linalg.norm(p[:, b] - p[:, a], axis=-1)))
            for a, b in ((hip, knee), (knee, heel))
        )
        frames[len(names)] = frames[heel]
        legs[side] = (hip, knee, heel, len(names))
        names.append(f"{names[heel]}_ball")
        parents.append(heel)
        offsets.append(quat.rotate(frames[heel], BALL * (thigh + shank)))
    still = np.broadcast_to(quat.IDENTITY, (len(clip), len(without), 4))
    moved = clip.translations
    if moved is not None:
        tail = np.broadcast_to(np.array(offsets[-len(without) :]), (len(clip), len(without), 3))
        moved = np.concatenate([moved, tail], axis=1)
    grown = replace(skeleton, joints=tuple(names), parents=tuple(parents), offsets=np.array(offsets))
    made = replace(
        clip, skeleton=grown, rotations=np.concatenate([clip.rotations, still], axis=1), translations=moved
    )
    return made, replace(body, legs=legs)


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def _off(a: Array, b: Array) -> float:
    """Degrees between two vectors."""
    return float(np.degrees(np.arccos(np.clip(_unit(a) @ _unit(b), -1.0, 1.0))))


def _frame(first: Array, axis: Array, second: Array, other: Array) -> Array:
    """(4,) the rotation that takes `axis` to `first` and `other`, as near as it can, to `second`."""
    return quat.from_matrix(_axes(first, second) @ _axes(axis, other).T)


def _axes(first: Array, second: Array) -> Array:
    x = _unit(first)
    y = _unit(second - x * (second @ x))
    if np.linalg.norm(y) < 0.5:
        y = _unit(np.eye(3)[int(np.argmin(np.abs(x)))] - x * x[int(np.argmin(np.abs(x)))])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _snapped(frame: Array) -> Array:
    """Whole axes where the frame is within 20 degrees of them."""
    axes = quat.to_matrix(frame)
    whole = np.round(axes)
    if np.all(np.abs(whole).sum(axis=0) == 1) and np.sum(axes * whole, axis=0).min() > np.cos(np.radians(20)):
        return quat.from_matrix(whole)
    return frame


def _pointed(whole: Array, axis: Array, bone: Array) -> Array:
    """A frame turned by the least amount so that its `axis` lies along the bone."""
    return quat.mul(quat.between(quat.rotate(whole, axis), bone), whole)


def _robust(vectors: Array) -> Array:
    """Mean (3,) of vectors (S, 3) without those far off their median."""
    off = np.linalg.norm(vectors - np.median(vectors, axis=0), axis=-1)
    return vectors[off <= 3 * np.median(off) + 1e-9].mean(axis=0)


def _mean(turns: Array) -> Array:
    """Mean rotation (4,) of (S, 4), without those far off it."""
    for _ in range(2):
        _, vectors = np.linalg.eigh(turns.T @ turns)
        mean = vectors[:, -1]
        off = quat.angle(turns, mean)
        turns = turns[off <= 2.5 * np.median(off) + 1e-9]
    return mean
