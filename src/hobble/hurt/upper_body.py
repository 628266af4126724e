"""Changes trunk, pelvis, head and arms: adds the curves of impaired people, and holds a hurt arm."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.ik import aim
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian
from hobble.hurt.body_parts import LEFT, RIGHT, SIDES, ancestors
from hobble.hurt.effects import Effects
from hobble.hurt.healthy_clip import HealthyClip
from hobble.hurt.impairment_profiles import HARMONICS

X, Y, Z = np.eye(3)
PELVIS_LEAN = 0.35  # the pelvis tilts forward by this share of the trunk's lean
PELVIS_CALM = 0.7  # the pelvis loses this share of the movement that a stiff back loses
POSTURE_SECONDS = 0.5  # sigma of the Gaussian that gives a joint's mean posture
LOOK_AHEAD = 0.85  # share of the trunk's lean that the head undoes, to look ahead
ARM_STILL = 0.93  # a held arm loses up to this share of its movement
# An arm is held with (strength of the injury) ** HOLD_POWER, so a mildly hurt arm swings nearly as far as a
# healthy one. With 1, a network's character holds its arms too still at severity 5.
HOLD_POWER = 1.6
# How a hurt left arm is held: directions of upper arm and forearm (forward, left, up), relative to the
# heading. For a hurt forearm (`fore`), the forearm lies across the belly, in the mean posture of the clip
# Injured_Jog_LLA by Ferre et al., a jog with a hurt forearm. For a hurt upper arm (`upper`), the arm is
# closer to the body, with the forearm ahead. For a hurt hand (`carry`), the forearm is only carried in front
# of the body.
HELD_ARMS = {
    "upper": ((0.10, 0.16, -0.98), (0.80, -0.58, 0.10)),
    "fore": ((0.28, 0.17, -0.85), (0.26, -0.86, -0.41)),
    "carry": ((0.10, 0.14, -0.98), (0.92, -0.25, 0.30)),
}
CARRY_STRENGTH = 0.75  # factor on the strength with which the arm of a hurt hand is held


def change_body(source: HealthyClip, effects: Effects) -> Array:
    """The changed world rotations (F, J, 4) of the source's frames. The legs only turn with the pelvis."""
    skeleton = source.clip.skeleton
    local = _stiffened(source, effects)
    world = _world(skeleton, local)
    pelvis, chest, head = _turns(source, effects)
    position_in_trunk = _heights_in_trunk(skeleton)
    for j in range(len(skeleton.joints)):
        where, share = position_in_trunk[j]
        if where == "pelvis":
            turn = quat.slerp(pelvis, chest, np.full(len(source), share))
        else:
            turn = quat.slerp(chest, head, np.full(len(source), share))
        world[:, j] = quat.mul(turn, world[:, j])
    for side in (LEFT, RIGHT):
        _hold_arm(source, effects, world, side)
    return world


def _world(skeleton: Skeleton, local: Array) -> Array:
    """World rotations (F, J, 4) of local rotations (F, J, 4)."""
    world = np.empty_like(local)
    for j, parent in enumerate(skeleton.parents):
        world[:, j] = local[:, j] if parent < 0 else quat.mul(world[:, parent], local[:, j])
    return world


def _stiffened(source: HealthyClip, effects: Effects) -> Array:
    """Local rotations with less movement of pelvis, back, neck and arms around their mean posture."""
    skeleton, local = source.clip.skeleton, source.clip.rotations.copy()
    back = _between(skeleton, "chest", "hips")
    neck = _between(skeleton, "head", "chest")
    # A stiff back cannot balance the movement of the pelvis. So the pelvis moves less, else the trunk sways.
    pelvis = 1.0 - PELVIS_CALM * (1.0 - effects.ratio("back"))
    ratios = [([skeleton.role("hips")], pelvis), (back, effects.ratio("back")), (neck, effects.ratio("head"))]
    for side in (LEFT, RIGHT):
        arm = _between(skeleton, f"{SIDES[side]}_wrist", "chest")
        ratios.append((arm[1:], effects.ratio("arm")[:, side]))  # all of the arm but the hand
    for joints, ratio in ratios:
        for j in joints:
            mean = quat.normalize(gaussian(quat.continuous(local[:, j]), POSTURE_SECONDS * source.clip.fps))
            local[:, j] = quat.slerp(mean, local[:, j], ratio)
    return local


def _between(skeleton: Skeleton, role: str, above: str) -> list[int]:
    """The joints from the one with `role` up to the one below the joint with role `above`."""
    path = ancestors(skeleton, skeleton.role(role))
    return path[: path.index(skeleton.role(above))]


def _heights_in_trunk(skeleton: Skeleton) -> list[tuple[str, float]]:
    """How far up the trunk each joint is.

    ("pelvis", share): at this share of the way from the pelvis to the chest. ("head", share): at this share
    of the way from the chest to the head. The joints of a limb have the value of the joint that the limb
    hangs from.
    """
    out: list[tuple[str, float]] = [("pelvis", 0.0)] * len(skeleton.joints)
    back = _between(skeleton, "chest", "hips")[::-1]
    neck = _between(skeleton, "head", "chest")[::-1]
    for j, parent in enumerate(skeleton.parents):
        if j in back:
            out[j] = ("pelvis", (back.index(j) + 1) / len(back))
        elif j in neck:
            out[j] = ("head", (neck.index(j) + 1) / len(neck))
        elif parent >= 0:
            out[j] = ("head", 0.0) if out[parent] == ("pelvis", 1.0) else out[parent]
    return out


def _turns(source: HealthyClip, effects: Effects) -> tuple[Array, Array, Array]:
    """(F, 4) each: world rotations to add to pelvis, chest and head."""
    phase, going = source.phase, np.clip(source.walking, 0.0, 1.0)
    rows = [np.ones(len(source))]
    for h in range(1, HARMONICS + 1):
        rows += [going * np.cos(2 * np.pi * h * phase), going * np.sin(2 * np.pi * h * phase)]
    forward, left, left_up, turn, shoulders = np.einsum("fck,kf->cf", effects.curves, np.stack(rows))
    side, hike = effects.sided["side"], effects.sided["list"] * source.swing
    forward = forward + effects.body["forward"]
    left = left + side[:, LEFT] - side[:, RIGHT]
    left_up = left_up + hike[:, LEFT] - hike[:, RIGHT]
    pelvis = _lean(source, turn, left_up, PELVIS_LEAN * forward)
    chest = _lean(source, shoulders, -left, forward)
    calm = 1 - LOOK_AHEAD
    head = _lean(source, calm * shoulders, -calm * left, calm * forward + effects.body["nod"])
    return pelvis, chest, head


def _lean(source: HealthyClip, turn: Array, roll: Array, forward: Array) -> Array:
    """(F, 4) world rotation that turns to the left, raises the left side (roll) and leans forward.

    All angles are (F,) degrees relative to the heading.
    """
    yaw, roll_, pitch = (
        quat.from_axis_angle(axis, np.radians(angle)) for axis, angle in ((Y, turn), (Z, roll), (X, forward))
    )
    turned = quat.mul(yaw, quat.mul(roll_, pitch))
    return quat.mul(source.heading, quat.mul(turned, quat.inv(source.heading)))


def _hold_arm(source: HealthyClip, effects: Effects, world: Array, side: int) -> None:
    """Hold a hurt arm with a bent elbow, against the body or in front of the chest. Changes `world`."""
    skeleton = source.clip.skeleton
    weights = {name: np.clip(effects.sided[name][:, side], 0.0, 1.0) ** HOLD_POWER for name in HELD_ARMS}
    weights["carry"] = CARRY_STRENGTH * weights["carry"]
    held = ARM_STILL * np.max(list(weights.values()), axis=0)
    if not held.any():
        return
    total = np.sum(list(weights.values()), axis=0)
    # Frames without a held arm need a direction, too.
    weights["carry"] = np.where(total > 1e-9, weights["carry"], 1.0)
    total = np.maximum(total, 1e-9) + (total <= 1e-9)
    sign = np.array([1.0 if side == LEFT else -1.0, 1.0, 1.0])
    shoulder, elbow, wrist = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("shoulder", "elbow", "wrist"))
    for bone, (joint, end) in enumerate(((shoulder, elbow), (elbow, wrist))):
        goal = np.zeros((len(source), 3))
        for name, directions in HELD_ARMS.items():
            ahead, out, up = directions[bone]
            goal += (weights[name] / total)[:, None] * np.array([out, up, ahead]) * sign
        toward = quat.rotate(source.heading, goal)
        bone_now = skeleton.offsets[end]
        full = aim(world[:, joint], np.broadcast_to(bone_now, toward.shape), toward)
        turn = quat.mul(quat.slerp(world[:, joint], full, held), quat.inv(world[:, joint]))
        for j in range(len(skeleton.joints)):
            if joint in ancestors(skeleton, j):
                world[:, j] = quat.mul(turn, world[:, j])
