"""Identifies the rig of a BVH file, maps it to the target skeleton, and finds its unit and its body.

A rig is the skeleton in a BVH file. A known skeleton is one that has a file in `config/skeletons`. The target
is the known skeleton to which clips are retargeted. A role is the body part of a joint, such as "left_knee".
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, path_between, path_to_root, rest_positions
from hobble.motion.axes import body_axes, unit
from hobble.motion.body import ARM, LEG, SIDES, Body, body_by_roles, with_fingers
from hobble.motion.limbs import Doubt, find_body
from hobble.motion.skeleton_file import KnownSkeleton, load_skeleton

# Centimetres: cm, inch, m, mm, the unit of CMU files (an inch / 0.45), and foot.
UNITS = (1.0, 2.54, 100.0, 0.1, 5.6444, 30.48)
LENGTH_OF_LEG = 80.0  # cm: length of thigh plus shank of an average adult
LEG_RANGE = (35.0, 125.0)  # cm: length of thigh plus shank, from small children to giants
# A rig is taken for a known skeleton only if at least this share of the rig's joint names occur in that
# skeleton.
LEAST_SHARED_NAMES = 0.75
# Role at the end of a bone, without the side -> degrees. Two rest poses count as equal if no bone's direction
# differs by more than this.
MOST_APART = {"elbow": 20.0, "wrist": 25.0, "knee": 35.0, "heel": 35.0, "toe": 35.0}
# Roles that a rig must have if the known skeleton has them.
MANDATORY = ("hips", "head", *(f"{side}_{part}" for side in SIDES for part in ("shoulder", *LEG)))
# Share of its length by which a bone may vary from the 3rd to the 97th percentile of a clip. In 172 real
# clips, the lengths do not vary.
STRETCH = 0.06


@dataclass(frozen=True)
class RigMatch:
    """Which known skeleton a clip's rig is, and how it maps to the target.

    rig: name of the known skeleton, or UNKNOWN_RIG of `hobble.motion.make`. roles: role -> name of the
    clip's joint. followed_joints: name of a target joint -> name of the clip's joint that it follows.
    has_known_rest_pose: whether the clip's rest pose equals that of the known skeleton (as
    `has_equal_rest_pose` compares them); False if the rig has other joints between hips and head.
    """

    rig: str
    roles: Mapping[str, str]
    followed_joints: Mapping[str, str] = field(default_factory=dict)
    has_known_rest_pose: bool = False

    @property
    def is_usable(self) -> bool:
        """Whether the rig is used as it is: it has a known rest pose, and a map leads to the target."""
        return self.has_known_rest_pose and bool(self.followed_joints)


def nearest_skeleton(names: Collection[str], target: KnownSkeleton, folder: str | Path) -> KnownSkeleton:
    """The skeleton in `folder` that has the most of these joint names; the target if none has more."""
    files = (file for file in sorted(Path(folder).glob("*.yaml")) if file.stem != target.skeleton.name)
    known = [target, *map(load_skeleton, files)]
    return max(known, key=lambda each: len(set(names) & set(each.skeleton.joints)))


def below_hips(clip: Clip, target: KnownSkeleton, folder: str | Path) -> tuple[Clip, list[str]]:
    """The clip with its hips as the root, and a note: some programs export joints above the hips.

    The motion of the joints above is added to that of the hips; other joints that are not below them are left
    out. folder: the folder of the skeleton files. The name of the hips is taken from the known skeleton that
    has the most of the clip's joint names. A clip without a joint of this name is returned as it is.
    """
    rig = clip.skeleton
    if rig.joints[0] == target.skeleton.roles["hips"]:
        return clip, []
    name = nearest_skeleton(rig.joints, target, folder).skeleton.roles["hips"]
    if name not in rig.joints[1:]:
        return clip, []
    hips = rig.index(name)
    joints = [j for j in range(len(rig.joints)) if hips in path_to_root(rig.parents, j)]
    names = tuple(rig.joints[j] for j in joints)
    rotations, moved = clip.rotations[:, joints], clip.translations
    rotations[:, 0] = clip.global_rotations[:, hips]
    if moved is not None:
        moved = moved[:, joints]
        moved[:, 0] = 0.0
        moved = moved if np.ptp(moved, axis=0).max() > 1e-3 * np.abs(rig.offsets).max() else None
    parents = tuple(-1 if j == hips else joints.index(rig.parents[j]) for j in joints)
    ends = {joint: site for joint, site in rig.end_sites.items() if joint in names}
    own = replace(rig, joints=names, parents=parents, offsets=rig.offsets[joints], end_sites=ends)
    rotations, root = quat.continuous(rotations), clip.positions[:, hips]
    below = replace(clip, skeleton=own, rotations=rotations, root=root, translations=moved)
    above = ", ".join(rig.joints[j] for j in path_to_root(rig.parents, hips)[:0:-1])
    return below, [f"The joints above {name} ({above:.100}) were left out; their motion was added to it."]


def match_rig(rig: Skeleton, target: KnownSkeleton, folder: str | Path) -> RigMatch | None:
    """Find which known skeleton a clip's rig is, and how it maps to the target.

    rig: the clip's skeleton. folder: the folder of the skeleton files. The known skeleton that shares most
    joint names with the rig is tried. Returns None if it shares too few, if the rig lacks one of its
    mandatory joints, or if the hierarchies differ. The match has roles but no `followed_joints` if no map
    leads to the target, or if the rig has other joints between hips and head than the known skeleton.
    """
    has_joints_of_target = set(rig.joints) == set(target.skeleton.joints)
    known = target if has_joints_of_target else nearest_skeleton(rig.joints, target, folder)
    skeleton, shared = known.skeleton, set(rig.joints) & set(known.skeleton.joints)
    if len(shared) < LEAST_SHARED_NAMES * len(rig.joints):
        return None
    needed = {skeleton.roles[role] for role in MANDATORY if role in skeleton.roles}
    if not needed <= shared or _common_parents(rig, shared) != _common_parents(skeleton, shared):
        return None
    roles = {role: joint for role, joint in skeleton.roles.items() if joint in shared}
    if _trunk_joints(rig, roles) != _trunk_joints(skeleton, skeleton.roles):
        # With other joints in the spine, a name such as Neck may mean another joint than in the file of the
        # known skeleton.
        return RigMatch(skeleton.name, roles)
    followed = {a: b for a, b in joint_pairs(known, target).items() if b in shared}
    alike = has_equal_rest_pose(replace(rig, roles=roles), skeleton)
    return RigMatch(skeleton.name, roles, followed, alike)


def has_equal_rest_pose(rig: Skeleton, known: Skeleton) -> bool:
    """Whether the limb bones of two rest poses have equal directions, to within MOST_APART.

    Directions are measured in the body's own axes, so turned or mirrored bodies count as equal. A rig
    without toe joints (the balls of the feet) never counts as equal, so that it gets a new rest pose. Then
    toe joints are added.
    """
    if "left_toe" not in rig.roles:
        return False
    of_rig, of_known = _bone_directions(rig), _bone_directions(known)
    most = {end: np.radians(MOST_APART[end.partition("_")[2]]) for end in of_known if end in of_rig}
    return all(of_rig[end] @ of_known[end] >= np.cos(angle) for end, angle in most.items())


def _bone_directions(skeleton: Skeleton) -> dict[str, Array]:
    """Role at the end of each limb bone -> its unit direction (3,) along the body's left, up, forward."""
    rest = rest_positions(skeleton)
    # Orthonormal axes. The third is not the cross product of the others: the body may be mirrored.
    columns, scale = np.linalg.qr(np.stack(body_axes(skeleton, rest), axis=1))
    axes = (columns * np.sign(np.diag(scale))).T
    out = {}
    for side in SIDES:
        for limb in (ARM, LEG):
            for start, end in pairwise(f"{side}_{part}" for part in limb):
                if start in skeleton.roles and end in skeleton.roles:
                    out[end] = unit(axes @ (rest[skeleton.role(end)] - rest[skeleton.role(start)]))
    return out


def _trunk_joints(skeleton: Skeleton, roles: Mapping[str, str]) -> list[str]:
    """The names of the joints from the hips to the head."""
    ends = (skeleton.index(roles[role]) for role in ("hips", "head"))
    return [skeleton.joints[j] for j in path_between(skeleton.parents, *ends)]


def _common_parents(skeleton: Skeleton, shared: Collection[str]) -> dict[str, str | None]:
    """For each of the joints in `shared`, the nearest joint above it in `skeleton` that is one, too."""
    above: dict[str, str | None] = {}
    for name, p in zip(skeleton.joints, skeleton.parents, strict=True):
        up = None if p < 0 else skeleton.joints[p]
        above[name] = up if up is None or up in shared else above[up]
    return {name: up for name, up in above.items() if name in shared}


def joint_pairs(source: KnownSkeleton, target: KnownSkeleton) -> dict[str, str]:
    """Name of a target joint -> name of the source joint that it follows.

    The pairs come from a map of one skeleton to the other, or from maps of both to a third skeleton. Without
    such maps, the result is empty.
    """
    from_source, from_target = (
        {known.skeleton.name: {name: name for name in known.skeleton.joints}, **known.maps}
        for known in (source, target)
    )
    for hub, pairs in from_source.items():
        if hub in from_target:
            # If several joints map to the same joint of the hub, the first of them in the map counts.
            to_source = {b: a for a, b in reversed(list(pairs.items()))}
            return {a: to_source[b] for a, b in from_target[hub].items() if b in to_source}
    return {}


def leg_lengths(skeleton: Skeleton) -> Array:
    """(2,) length of thigh and shank together, left and right, in the skeleton's unit."""
    bones = [[skeleton.role(f"{side}_{end}") for end in ("knee", "heel")] for side in SIDES]
    return np.asarray(np.linalg.norm(skeleton.offsets[bones], axis=-1).sum(axis=-1))


def leg_length(skeleton: Skeleton) -> float:
    """Length of thigh and shank together, mean of both sides, in the skeleton's unit."""
    return float(leg_lengths(skeleton).mean())


def likely_unit(leg: float) -> float | None:
    """The likely unit of a file, in centimetres.

    leg: length of thigh plus shank in the file's unit, more than 0. The unit is the one that brings this
    length nearest to LENGTH_OF_LEG. None if it is not within LEG_RANGE even then.
    """
    nearest = min(UNITS, key=lambda unit: abs(np.log(leg * unit / LENGTH_OF_LEG)))
    return nearest if LEG_RANGE[0] <= leg * nearest <= LEG_RANGE[1] else None


def body_in_file(path: Path, raw: Clip, known: RigMatch | None, handedness: str) -> tuple[Body, list[str]]:
    """The body of a file's rig, and sentences on how it was found.

    raw: the file's motion, in any unit and along any axes. known: the match of the rig to the skeleton file
    that describes it, or None if there is no such file. handedness: the option, "auto", "right" or "left".

    Raises InputError if a bone of a limb changes its length, if the parts of the body are in doubt, if there
    are two figures, or if neither the names of joints nor `handedness` tell left from right.
    """
    rig = raw.skeleton
    if known is not None:
        rig = replace(rig, roles=known.roles)
        _check_bones(path, rig, raw.positions, known.rig)
        return body_by_roles(rig), []
    try:
        body, sided = find_body(rig.joints, rig.parents, raw.positions)
    except Doubt as doubt:
        problem = f"it is in doubt which joints are which parts of a body: {doubt}"
        draft = f"`hobble rig {path.name} --to config/skeletons/<name>.yaml`"
        fix = f"Hands, animals and mechanisms cannot be used. For a person, {draft} drafts a file to correct."
        raise InputError(path, problem, fix=fix) from None
    notes = []
    if not sided:
        unsided = "its joint names do not tell left from right"
        if handedness == "auto":
            fix = "Set motion.handedness (option --handedness) to right, as most BVH files are, or to left."
            raise InputError(path, f"{unsided}, and a mirror image moves like a person, too", fix=fix)
        notes.append(f"{unsided.capitalize()}, so motion.handedness: {handedness} was used.")
        if handedness == "left":
            arms, legs = ({a: limbs[b] for a, b in (SIDES, SIDES[::-1])} for limbs in (body.arms, body.legs))
            body = replace(body, arms=arms, legs=legs)
    return with_fingers(body, rig), notes


def _check_bones(path: Path, rig: Skeleton, positions: Array, name: str) -> None:
    """Raise InputError if a bone of a limb changes its length, because then a role has the wrong joint.

    positions: (F, J, 3) of the joints. name: of the skeleton file that tells the roles.
    """
    for side in SIDES:
        for start, end in (*pairwise(ARM), *pairwise(LEG[:3])):
            roles = [f"{side}_{start}", f"{side}_{end}"]
            if not set(roles) <= set(rig.roles):
                continue
            a, b = (rig.role(role) for role in roles)
            lengths = np.linalg.norm(positions[:, b] - positions[:, a], axis=-1)
            low, median, high = np.percentile(lengths, [3, 50, 97])
            if high - low > STRETCH * median:
                ends = f"{rig.joints[a]} ({roles[0]}) and {rig.joints[b]} ({roles[1]})"
                problem = f"{ends} are {low:.3g} to {high:.3g} units apart, so a joint between them bends"
                fix = f"Correct the roles in the skeleton file {name}.yaml."
                raise InputError(path, problem, fix=fix)
