"""How the figure moves in each gait at each speed: timing, feet, pelvis, trunk and arms.

The values for running are those of healthy adults: Novacheck (1998). The values for walking at 1.3 m/s began
as those of Perry & Burnfield, Gait Analysis, and Winter, The Biomechanics and Motor Control of Human Gait.
Many were then moved towards the means of four captured people (`benchmarks/healthy_walks.py`).
"""

from types import SimpleNamespace

import numpy as np

from hobble.core.quat import Array
from hobble.synthetic.plan import GAITS, PlannedPath

LEFT, RIGHT = 0, 1  # sides of the body, also as indices

REFERENCE_SPEED = (0.0, 1.3, 2.8, 0.8)  # m/s, for each gait of GAITS
# name -> for each gait of GAITS: (value at the gait's reference speed, change per m/s). The values are angles
# in degrees, lengths in cm, and shares. An amplitude is half the range of a movement in a cycle.
VALUES_BY_GAIT: dict[str, tuple[tuple[float, float], ...]] = {
    "duty": ((0.64, 0), (0.57, -0.06), (0.365, -0.05), (0.64, -0.06)),  # share of the cycle on the ground
    "land_pitch": ((0, 0), (27, 6), (15, 2), (-24, 0)),  # pitch of the foot as it lands, + toe up
    "off_pitch": ((-15, 0), (-60, -12), (-49, -1), (-58, -8)),  # pitch of the foot as it leaves the ground
    "rest_pitch": ((0, 0), (-3.5, 0), (0, 0), (-24, 0)),  # pitch of the foot while it stands
    "flat": ((0.15, 0), (0.187, 0), (0.30, 0), (0.15, 0)),  # share of stance until the toe is down
    # share of stance until the heel leaves the ground
    "heel_off": ((0.6, 0), (0.3, -0.03), (0.30, 0), (0.48, 0)),
    # exponent of the heel's rise over time: slow at first, then fast
    "roll": ((2.8, 0), (4.4, 0), (2.6, 0), (1.9, 0)),
    # greatest height of the swinging foot above the line from its last place on the ground to its next
    "lift": ((2, 0), (7.3, 1), (4, 3), (4, 0)),
    "circle": ((0, 0), (3.5, 0), (0, 0), (0, 0)),  # greatest distance outward from this line
    "clearance": ((1, 0), (2.5, 0), (3, 0), (2, 0)),  # least height of the sole above the ground in mid-swing
    "behind": ((4, 0), (13.6, 5.5), (7.5, 3), (10, 5)),  # distance of an ankle behind the body in mid-stance
    "width": ((9.5, 0), (2.5, 0), (3.5, 0), (4.5, 0)),  # distance of an ankle from the path, sideways
    "toe_out": ((8, 0), (6, 0), (3, 0), (10, 0)),  # angle by which the foot points outward
    # part of a knee's direction outward, where the part forward is 1
    "knee_out": ((0.06, 0), (-0.05, 0), (0.06, 0), (0.06, 0)),
    "height": ((94.6, 0), (94.2, -1.0), (94.5, -0.8), (66, 0)),  # height of the hips above the ground
    # amplitude of the hips' way forward and back; they are slowest in mid-stance
    "surge": ((0, 0), (1.72, 0.2), (1.2, 0), (0.7, 0)),
    # amplitude of the hips' height; positive if they are highest in mid-stance, negative if lowest
    "bob": ((0, 0), (1.6, 1.2), (-2.0, 0.3), (0.8, 0)),
    "sway": ((1.6, 0), (4.2, -0.8), (0.8, 0), (2.5, 0)),  # amplitude of the hips, sideways
    "pelvis_yaw": ((0.3, 0), (6.6, 2), (6, 1), (5, 0)),  # amplitude of the turn about the vertical axis
    "pelvis_list": ((1.0, 0), (5.3, 1), (4, 0), (3, 0)),  # amplitude of the sideways tilt
    # phase in which the left side is highest
    "list_peak": ((0.75, 0), (0.94, 0), (0.75, 0), (0.75, 0)),
    "pelvis_tilt": ((3, 0), (3, 1), (6, 1), (34, 0)),  # mean forward tilt
    "nod": ((0.1, 0), (2.4, 0.6), (3, 0), (1.5, 0)),  # amplitude of the head, forward
    "lean": ((1, 0), (-1.5, 2), (10, 2), (79, 0)),  # lean of the trunk, forward
    "bow": ((0.8, 0), (2.75, 0), (0.8, 0), (0.8, 0)),  # amplitude of this lean
    "chest_yaw": ((0.3, 0), (1.5, 2), (9, 2), (4, 0)),  # amplitude of the turn about the vertical axis
    "arm_swing": ((0.8, 0), (15.8, 12), (27, 4), (9, 0)),  # amplitude of the upper arm, forward and backward
    "arm_mean": ((1, 0), (-7, 0), (-8, 0), (14, 0)),  # mean angle of the upper arm, + forward
    "elbow": ((14, 0), (35.3, 8), (82, 2), (48, 0)),  # mean bend of the elbow
    "elbow_swing": ((0.5, 0), (13.2, 5), (14, 0), (7, 0)),  # amplitude of the bend of the elbow
    "abduction": ((9, 0), (9, 0), (13, 0), (14, 0)),  # angle of the upper arm, away from the body
}
# The names in VALUES_BY_GAIT whose curves have a value for each side of the body.
SIDED = (
    "duty", "land_pitch", "off_pitch", "heel_off", "lift", "clearance", "toe_out", "arm_swing", "arm_mean",
    "elbow", "elbow_swing", "abduction",
)  # fmt: skip
SPIN_CADENCE = 0.6  # share by which cadence rises if the figure turns in place by a radian a second or more
SIDE_SIGN = (1.0, -1.0)  # sign of X on the left and on the right side: +X is the figure's left


class Style(SimpleNamespace):
    """How the figure moves in each of F frames: a curve for each name in VALUES_BY_GAIT, and `frequency`.

    Arrays are (F,). For names in SIDED they are (F, 2), left and right. frequency: (F,) cycles a second. The
    left foot lands half a cycle after the right foot.
    """


def healthy_style(path: PlannedPath) -> Style:
    """The style of a healthy figure along a path.

    In each frame it is the mean of the gaits' values at the current speed, weighted by the gaits' shares.
    """
    speed = path.speed / 100
    values = {}
    for name, row in VALUES_BY_GAIT.items():
        base = np.array([value for value, _ in row])
        slope = np.array([change for _, change in row])
        values_of_gaits = base + slope * (speed[:, None] - np.array(REFERENCE_SPEED))  # (F, 4)
        mixed = np.sum(path.gait * values_of_gaits, axis=1)
        values[name] = np.repeat(mixed[:, None], 2, axis=1) if name in SIDED else mixed
    # Far from the reference speed, the straight lines of VALUES_BY_GAIT leave the range of possible values.
    values["duty"] = np.clip(values["duty"], 0.28, 0.82)
    values["heel_off"] = np.clip(values["heel_off"], 0.3, 0.75)
    style = Style(**values, frequency=np.sum(path.gait * _cadences(speed), axis=1))
    return _adapt_to_direction(style, path)


def _cadences(speed: Array) -> Array:
    """(F, 4) cycles a second of each gait. In a walk they grow with the square root of speed (F,), m/s."""
    stand = np.full_like(speed, 1 / 1.5)
    walk = np.sqrt(np.maximum(speed, 0.5) / 1.3)
    jog = 1.41 + 0.08 * (np.clip(speed, 1.5, 5.0) - 2.8)
    crouch = 0.80 * np.sqrt(np.maximum(speed, 0.5) / 0.8)
    assert len(GAITS) == 4
    return np.stack([stand, walk, jog, crouch], axis=1)


def _adapt_to_direction(style: Style, path: PlannedPath) -> Style:
    """The style, changed where the figure walks backward or sideways, or turns in place.

    Steps backward and sideways are quicker. The toe lands first, the heel rises less, but the foot more, and
    the arms swing less.
    """
    speed = np.maximum(path.speed, 1e-6)
    moving = np.clip(path.speed / 30, 0, 1)  # 0 for a standing figure, 1 from 30 cm/s on
    # Cosine of the angle from the facing direction to the direction of travel; 1 for a standing figure.
    ahead = np.where(moving > 0, path.velocity[:, 1] / speed, 1.0) * moving + (1 - moving)
    forward, back, side = np.maximum(ahead, 0), np.maximum(-ahead, 0), 1 - np.abs(ahead)
    forward, back, side = forward[:, None], back[:, None], side[:, None]
    stride = path.speed / style.frequency
    # Sine of this angle, without its sign; 0 for a standing figure.
    sideways = np.abs(path.velocity[:, 0]) / speed * moving
    # A figure that turns in place takes quick steps of some 40 degrees.
    spin = np.clip(np.abs(np.gradient(path.facing)) * path.fps, 0, 1) * np.clip(1 - path.speed / 60, 0, 1)
    changed = {
        "land_pitch": style.land_pitch * forward - 16 * back - 8 * side,
        "off_pitch": style.off_pitch * forward + 8 * back - 16 * side,
        # In steps to the side, the distance between the feet varies by half a stride. The extra width keeps
        # them from crossing.
        "width": style.width + (0.7 + 0.25 * stride / (1 + 0.6 * sideways)) * sideways,
        "behind": 4 + (style.behind - 4) * ahead,
        "lift": style.lift + 0.8 * back + 0.8 * side,
        "circle": style.circle * np.maximum(ahead, 0),
        "frequency": style.frequency * (1 + 0.6 * sideways + 0.15 * back[:, 0] + SPIN_CADENCE * spin),
        "lean": style.lean * (1 - 0.6 * back[:, 0]),
        "surge": style.surge * np.abs(ahead),
        "pelvis_yaw": style.pelvis_yaw * ahead,
        "arm_swing": style.arm_swing * (0.25 + 0.75 * forward),
        "height": style.height - 1.5 * sideways - 1.0 * back[:, 0],
    }
    return Style(**{**vars(style), **changed})
