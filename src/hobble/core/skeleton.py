"""A skeleton: joints, parents, rest offsets, roles, links (the bones that can be hurt); its kinematics."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from hobble.core import quat
from hobble.core.declared import read_declared
from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.core.section import Section, ShortName

SIDE_WORDS = (("Left", "Right"), ("left", "right"), ("LEFT", "RIGHT"))
# The letter of the side: alone, as in L_Leg, leg.r and Bip01 L Leg, or at the start of a name, as in LLeg and
# rLeg.
SIDE_LETTER = re.compile(r"(?<![^_. -])[LRlr](?![^_. -])|^[LRlr](?=[A-Z])")
OTHER_LETTER = str.maketrans("LRlr", "RLrl")


def other_side(name: str) -> str:
    """The name of the joint on the other side of the body; the same name for a joint in the middle.

    >>> other_side("LeftUpLeg"), other_side("LHipJoint"), other_side("Neck1"), other_side("Hand_R")
    ('RightUpLeg', 'RHipJoint', 'Neck1', 'Hand_L')
    """
    for left, right in SIDE_WORDS:
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    return SIDE_LETTER.sub(lambda match: match[0].translate(OTHER_LETTER), name, count=1)


# Every character has a joint for each of these roles.
LIMB_PARTS = ("shoulder", "elbow", "wrist", "hip", "knee", "heel", "toe")
NEEDED_ROLES = ("hips", "head", *(f"{side}_{part}" for side in ("left", "right") for part in LIMB_PARTS))
# A coordinate of a joint from its parent, cm.
Coordinate = Annotated[float, Field(strict=True, ge=-1e5, le=1e5, allow_inf_nan=False)]
Offset = tuple[Coordinate, Coordinate, Coordinate]


class JointEntry(Section):
    """A joint of a skeleton. parent: None for the root. offset: from the parent, in the rest pose, cm."""

    parent: str | None
    offset: Offset


class SkeletonData(Section):
    """A skeleton as plain data. `Skeleton` explains the keys."""

    joints: Annotated[dict[ShortName, JointEntry], Field(min_length=1)]
    roles: dict[str, str]
    end_sites: dict[str, Offset] = Field(default_factory=dict)
    links: tuple[tuple[str, str], ...] = ()
    unseen: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _joints_are_consistent(self) -> Self:
        known: set[str] = set()  # names of the joints listed so far
        for name, joint in self.joints.items():
            if joint.parent is None and known:
                raise ValueError(f"joint {name}: only the first joint may have no parent")
            if joint.parent is not None and joint.parent not in known:
                raise ValueError(f"joint {name}: its parent {joint.parent!r} must be listed before it")
            known.add(name)
        joint_names: dict[str, Any] = {  # key of the file -> names of joints in its value
            "roles": self.roles.values(),
            "end_sites": self.end_sites,
            "links": [joint for link in self.links for joint in link],
            "unseen": self.unseen,
        }
        for key, names in joint_names.items():
            for name in names:
                if name not in known:
                    raise ValueError(f"{key}: there is no joint {name!r}")
        return self


@dataclass(frozen=True)
class Skeleton:
    """The skeleton that a clip moves, with J joints and L links.

    joints: J names, each parent before its children; the first is the root.
    parents: J indices, -1 for the root.
    offsets: (J, 3) from the parent to the joint in the rest pose (every rotation is the identity), cm.
    roles: role ("hips", "left_heel", ...) -> name of the joint; see config/skeletons/README.md.
    links: (upper joint, lower joint) of each bone that can be hurt. Arrays of severities (how badly the bones
    are hurt) have a column for each link.
    unseen: joints that the network predicts, but whose inputs are multiplied by 1e-10, so that the network in
    effect does not see them.
    end_sites: name of a joint without children -> vector (x, y, z) from the joint to the end of its bone, cm.
    """

    name: str
    joints: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array = field(repr=False)
    roles: Mapping[str, str] = field(default_factory=dict, repr=False)
    links: tuple[tuple[str, str], ...] = field(default=(), repr=False)
    unseen: tuple[str, ...] = field(default=(), repr=False)
    end_sites: Mapping[str, tuple[float, float, float]] = field(default_factory=dict, repr=False)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Skeleton:
        """Build from the validated content of config/skeletons/<name>.yaml."""
        joints = tuple(data["joints"])
        parents = tuple(
            -1 if j["parent"] is None else joints.index(j["parent"]) for j in data["joints"].values()
        )
        offsets = np.array([j["offset"] for j in data["joints"].values()], float)
        links = tuple((a, b) for a, b in data.get("links", ()))
        ends = {name: tuple(xyz) for name, xyz in data.get("end_sites", {}).items()}
        unseen = tuple(data.get("unseen", ()))
        return cls(data["name"], joints, parents, offsets, dict(data["roles"]), links, unseen, ends)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for `from_dict`, with offsets rounded to 1e-6 cm."""
        joints = {
            name: {
                "parent": self.joints[p] if p >= 0 else None,
                "offset": [round(float(x), 6) for x in offset],
            }
            for name, p, offset in zip(self.joints, self.parents, self.offsets, strict=True)
        }
        return {
            "name": self.name,
            "joints": joints,
            "roles": dict(self.roles),
            "links": [list(link) for link in self.links],
            "unseen": list(self.unseen),
            "end_sites": {name: list(xyz) for name, xyz in self.end_sites.items()},
        }

    def index(self, joint: str) -> int:
        """Index of a joint by name. For an unknown name, raises KeyError with the names of all joints."""
        try:
            return self.joints.index(joint)
        except ValueError:
            raise KeyError(f"no joint {joint!r} in skeleton {self.name}: {', '.join(self.joints)}") from None

    def role(self, role: str) -> int:
        """Index of the joint with the role `role`."""
        return self.index(self.roles[role])

    def path_up(self, joint: int, below: int = -1) -> list[int]:
        """The joint itself, its parent, and so on: to the root, or to the joint under the joint `below`.

        Empty if `below` is not an ancestor of the joint.
        """
        path = [*path_to_root(self.parents, joint), -1]
        return path[: path.index(below)] if below in path else []

    @property
    def leg_length(self) -> float:
        """Length of the left thigh and shank together, cm.

        Other lengths are divided by it, to compare bodies of any size.
        """
        bones = np.linalg.norm(self.offsets, axis=1)
        knee, heel = self.role("left_knee"), self.role("left_heel")
        length, joint = 0.0, heel
        while joint != self.parents[knee] and joint >= 0:
            length += bones[joint]
            joint = self.parents[joint]
        return float(length)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the links, such as "LeftUpLeg-LeftLeg"."""
        return tuple(f"{a}-{b}" for a, b in self.links)

    @property
    def mirror_joints(self) -> np.ndarray:
        """(J,) index of each joint's counterpart on the other side, found by name.

        A joint without a counterpart has its own index. Raises HobbleError if the joints of two roles such
        as "left_knee" and "right_knee" are not counterparts by name.
        """
        others = [(name, other_side(name)) for name in self.joints]
        swap = np.array([self.index(other if other in self.joints else name) for name, other in others])
        for role, left in self.roles.items():
            right = self.roles.get(role.replace("left_", "right_", 1))
            if right not in (None, left) and self.joints[swap[self.index(left)]] != right:
                raise HobbleError(
                    f"skeleton {self.name} cannot be mirrored: {left} is the {role.replace('_', ' ')} and "
                    f"{right} the right one, but their names do not match. Name the joints of both sides the "
                    "same except for Left and Right, or L and R, as in LeftLeg, L_Leg, Leg.L, LLeg."
                )
        return swap

    @property
    def mirror_links(self) -> np.ndarray:
        """(L,) index of each link's counterpart, the link between the counterparts of its joints.

        Raises HobbleError like `mirror_joints`, and also if a link has no counterpart: its severity would
        stay on the wrong side of the mirrored body.
        """
        swap = self.mirror_joints
        across = [tuple(self.joints[swap[self.index(joint)]] for joint in link) for link in self.links]
        for link, other in zip(self.links, across, strict=True):
            if other not in self.links:
                raise HobbleError(
                    f"skeleton {self.name} cannot be mirrored: its links have {'-'.join(link)} but not "
                    f"{'-'.join(other)}. Add the missing link."
                )
        return np.array([self.links.index(other) for other in across], int)

    def children(self, joint: int) -> list[int]:
        """Indices of the joints whose parent is the joint with index `joint`."""
        return [i for i, p in enumerate(self.parents) if p == joint]


def skeleton_from_data(
    path: str | Path, data: Any, needed: Sequence[str] = (), fix: str | None = None
) -> Skeleton:
    """The skeleton of `Skeleton.to_dict`, or of its JSON text, in the file `path`.

    needed: roles that it must have. Raises InputError, with the advice `fix`, if it is not valid.
    """
    try:
        data = json.loads(data) if isinstance(data, str) else data
    except ValueError as error:
        raise InputError(path, f"its skeleton is not valid JSON: {error}", fix=fix) from None
    entries = read_declared(path, "its skeleton", dict, data, fix)
    keys = {key: value for key, value in entries.items() if key not in ("name", "maps")}
    read = read_declared(path, "its skeleton", SkeletonData, keys, fix)
    if missing := [role for role in needed if role not in read.roles]:
        raise InputError(path, f"its skeleton has no joint for the roles {', '.join(missing)}", fix=fix)
    name = read_declared(path, "its skeleton's name", ShortName, entries.get("name"), fix)  # type: ignore[arg-type]
    return Skeleton.from_dict({**entries, "name": name})


# Paths in a hierarchy. `parents` is the index of each joint's parent, or -1 for the root.


def path_to_root(parents: Sequence[int], joint: int) -> list[int]:
    """The joint and all its ancestors, the root last."""
    chain = [joint]
    while parents[chain[-1]] >= 0:
        chain.append(parents[chain[-1]])
    return chain


def common_ancestor(parents: Sequence[int], joints: Iterable[int]) -> int:
    """The lowest common ancestor of `joints`. A joint counts as its own ancestor here."""
    first, *others = (path_to_root(parents, j) for j in joints)
    return next(j for j in first if all(j in other for other in others))


def path_between(parents: Sequence[int], start: int, end: int) -> list[int]:
    """The joints from `start` to `end`, both included: up to their lowest common ancestor, then down."""
    meet = common_ancestor(parents, (start, end))
    up, down = path_to_root(parents, start), path_to_root(parents, end)
    return up[: up.index(meet) + 1] + down[: down.index(meet)][::-1]


def rest_positions(skeleton: Skeleton) -> Array:
    """(J, 3) joint positions, cm, with every rotation at the identity and the root at the origin."""
    out = np.zeros_like(skeleton.offsets, dtype=float)
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            out[j] = out[p] + skeleton.offsets[j]
    return out


def forward_kinematics(
    skeleton: Skeleton, rotations: Array, root: Array, translations: Array | None = None
) -> tuple[Array, Array]:
    """The joints' world rotations (F, J, 4) and world positions (F, J, 3), cm, in F frames.

    rotations: (F, J, 4) local. root: (F, 3) position of the root, cm. translations: (F, J, 3) positions of
    the joints in the axes of their parents, cm. They replace the rest offsets of all joints but the root.
    """
    global_rotations = np.empty_like(rotations, dtype=float)
    positions = np.empty((*rotations.shape[:-1], 3))
    for j, p in enumerate(skeleton.parents):
        if p < 0:
            global_rotations[..., j, :] = rotations[..., j, :]
            positions[..., j, :] = root
            continue
        offset = skeleton.offsets[j] if translations is None else translations[..., j, :]
        parent = global_rotations[..., p, :]
        global_rotations[..., j, :] = quat.mul(parent, rotations[..., j, :])
        positions[..., j, :] = positions[..., p, :] + quat.rotate(parent, offset)
    return global_rotations, positions


def local_rotations(skeleton: Skeleton, global_rotations: Array) -> Array:
    """Local rotations (..., J, 4), relative to the parent, from world rotations (..., J, 4)."""
    out = np.array(global_rotations, float)
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            out[..., j, :] = quat.mul(quat.inv(global_rotations[..., p, :]), global_rotations[..., j, :])
    return out


# Inverse kinematics: bends a leg or an arm so that its end reaches a point, and turns single bones.


def two_bone_knee(hip: Array, target: Array, pole: Array, upper: float, lower: float) -> tuple[Array, Array]:
    """Positions of knee and ankle, each (..., 3), by the law of cosines. An arm works in the same way.

    hip: (..., 3) position of the hip. target: (..., 3) where the ankle should be. pole: (..., 3) direction in
    which the knee points, of any length; it must not be parallel to the line from hip to target. upper,
    lower: lengths of thigh and shank. If the target is too far away, the leg stretches to 99.9 % of its
    length towards it; if it is too near, the leg folds as far as it can.
    """
    to_target = target - hip
    distance = np.linalg.norm(to_target, axis=-1, keepdims=True)
    along = to_target / np.maximum(distance, 1e-9)
    distance = np.clip(distance, abs(upper - lower) * 1.001 + 1e-6, (upper + lower) * 0.999)
    # Cosine of the angle at the hip, between the thigh and the line from hip to ankle.
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    cosine = np.clip(cosine, -1.0, 1.0)
    # Direction in which the knee leaves this line: the part of `pole` at right angles to it.
    bend = pole - along * np.sum(pole * along, axis=-1, keepdims=True)
    bend = bend / np.maximum(np.linalg.norm(bend, axis=-1, keepdims=True), 1e-9)
    knee = hip + upper * (along * cosine + bend * np.sqrt(1 - cosine**2))
    return knee, hip + along * distance


def aim_bone(rotation: Array, bone: Array, direction: Array) -> Array:
    """Turn a joint, by the smallest possible angle, so that its bone points in a given direction.

    rotation: (..., 4) of the joint in the world. bone: (..., 3) vector from the joint to the end of the bone,
    in the joint's own axes. direction: (..., 3) in the world. Returns the new world rotation (..., 4).
    """
    return quat.mul(quat.between(quat.rotate(rotation, bone), direction), rotation)


def bone_axes(along: Array, side: Array) -> Array:
    """(..., 3, 3) rotation matrix of a bone that points along Y and bends about X.

    along: (..., 3) direction of the bone's Y axis. side: (..., 3) approximate direction of its X axis, of any
    length; it must not be parallel to `along`.
    """
    y = along / np.linalg.norm(along, axis=-1, keepdims=True)
    x = side - y * np.sum(side * y, axis=-1, keepdims=True)
    x = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-9)
    return np.stack([x, y, np.cross(x, y)], axis=-1)
