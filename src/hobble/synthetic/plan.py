"""The plan of a clip: the segments of its recipe, the path that they make over time, and the ground.

A recipe is a sequence of segments, each with a gait, a velocity, a turn and a length.

The plan of a clip is its recipe, repeated, stretched and varied at random to fill the clip.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array

STAND, WALK, JOG, CROUCH = "stand", "walk", "jog", "crouch"


@dataclass(frozen=True)
class Segment:
    """One segment of a recipe or a plan.

    speed: cm/s. turn: degrees by which the facing direction turns in the segment, positive to the left.
    seconds: length of the segment. heading: degrees from the facing direction to the direction of travel,
    positive to the left.
    """

    gait: str
    speed: float = 0.0
    turn: float = 0.0
    seconds: float = 2.5
    heading: float = 0.0


_walk, _jog, _crouch = (partial(Segment, gait) for gait in (WALK, JOG, CROUCH))


def _stand(seconds: float = 2.0) -> Segment:
    return Segment(STAND, seconds=seconds)


# Arguments of each segment: speed, turn, seconds, heading; see `Segment`. The inner tuples only keep several
# segments on one line.
RECIPES: dict[str, tuple[Segment, ...]] = {
    "walk-straight": (
        *(_walk(130, 0, 4), _walk(150, 8, 2.5), _walk(55, 0, 2.5), _walk(105, -8, 2.5), _walk(80, 0, 2.5)),
    ),
    "walk": (
        *(_walk(130, 0, 3), _walk(150, 90, 3), _walk(105, -100, 3), _walk(70, 20, 2.6), _walk(180, 0, 2.6)),
        *(_walk(120, 90, 1.2), _walk(130, 0, 1.4), _walk(95, -180, 2), _walk(60, 0, 2.4), _walk(130, 0, 1.4)),
        *(_walk(130, 170, 3.4), _walk(170, -140, 3.4), _walk(90, 175, 1.7), _walk(135, 0, 2)),
        *(_walk(115, -90, 1.4), _walk(100, 0, 1.4)),
    ),
    "slow": (_walk(32, 0, 4), _walk(50, 40, 3), _walk(20, 0, 3), _walk(42, -40, 3), _walk(26, 0, 3)),
    "jog": (
        *(_jog(250, 0, 2), _jog(330, 20, 2), _jog(420, -20, 2.2), _jog(280, 90, 1.3), _jog(300, 0, 1.2)),
        *(_jog(260, -170, 2), _jog(215, 0, 1.6), _jog(300, 140, 2.4), _jog(370, 0, 1.6), _jog(400, -60, 2.4)),
        *(_jog(240, 100, 1.4), _jog(290, 0, 1.4)),
    ),
    "crouch": (
        *(_crouch(70, 0, 3), _crouch(90, 90, 2.4), _crouch(90, -90, 2.4), _crouch(0, 0, 1.8)),
        *(_crouch(110, 0, 3), _walk(120, 0, 2.2), _crouch(80, 0, 2.6)),
    ),
    "sidesteps": (
        *(_walk(110, 0, 1.8), _walk(62, 0, 2.6, 90), _walk(62, 0, 2.6, -90), _walk(110, 0, 1.6)),
        *(_walk(90, 0, 2.2, 45), _walk(90, 0, 2.2, -45), _stand(1.6), _walk(65, 0, 1.6)),
        *(_walk(65, 0, 2.6, 180), _walk(70, 30, 2, 180), _walk(70, -30, 2, 180), _walk(65, 0, 2, 140)),
        *(_walk(65, 0, 2, -140), _walk(110, 0, 2.6, 165), _walk(110, 0, 2.4, -165), _walk(100, 0, 2.2, 90)),
        *(_walk(100, 0, 2.2, -90), _walk(125, 0, 1.8, 30), _walk(125, 0, 1.8, -30)),
    ),
    "stop-and-go": (
        *(_stand(3.6), _walk(130, 0, 2), _stand(3.2), _walk(8, 90, 1.7), _walk(80, 0, 1.8)),
        *(_stand(3.0), _walk(8, 180, 3.0), _walk(8, -90, 1.7), _jog(235, 0, 2.4), _stand(3)),
    ),
    "walk-jog-walk": (
        *(_walk(130, 0, 2.2), _jog(270, 0, 2.5), _walk(140, 60, 2), _jog(340, -60, 2.5)),
        *(_walk(90, 0, 2.2), _jog(230, 0, 2)),
    ),
    "slopes": (_walk(125, 0, 4), _walk(110, 60, 3), _jog(240, 0, 2.5), _walk(125, -60, 3), _walk(90, 0, 2)),
    "steps": (_walk(85, 0, 4), _walk(70, 12, 3), _walk(100, -12, 3), _stand(1.8)),
    "stairs": (_walk(52, 0, 6), _walk(40, 8, 5), _walk(60, -8, 4), _walk(34, 0, 4)),
    "uneven": (_walk(115, 0, 3), _walk(95, 70, 3), _walk(125, -70, 3), _walk(70, 0, 2.5)),
}
# recipe -> kind of ground, see `hobble.synthetic.plan`; all other recipes are on flat ground
GROUND = {kind: kind for kind in ("slopes", "steps", "stairs", "uneven")}


def plan(recipe: str, frames: float, fps: float, seed: int, clip: str) -> list[Segment]:
    """The plan of a clip of `frames` frames: segments that last at least as long as the clip.

    The recipe is repeated as often as fits best. Then the segments are stretched or shortened to fill the
    clip, but to no less than three quarters of their length. Every other repetition is mirrored. Each segment
    is varied a little at random; equal arguments give an equal plan.

    Raises HobbleError for an unknown recipe.
    """
    if recipe not in RECIPES:
        raise HobbleError(
            f"clip {clip}: there is no recipe {recipe!r}. Name one of these: {', '.join(RECIPES)}."
        )
    rng = rng_of(seed, clip, "plan")
    segments = RECIPES[recipe]
    mirror = 1.0 if rng.random() < 0.5 else -1.0  # factor of turns and headings
    seconds = frames / fps
    once = sum(segment.seconds for segment in segments)
    repetitions = max(1, round(seconds / once))
    stretch = max(0.75, seconds / (repetitions * once))
    out: list[Segment] = []
    while sum(s.seconds for s in out) < seconds:
        out += [_vary(segment, mirror, stretch, rng) for segment in segments]
        mirror = -mirror
    return out


def _vary(segment: Segment, mirror: float, stretch: float, rng: np.random.Generator) -> Segment:
    """The segment with speed, turn and length changed by random factors. mirror: -1 to mirror it, else 1."""
    speed_factor, turn_factor, time_factor = rng.uniform([0.93, 0.9, 0.95], [1.07, 1.1, 1.05])
    return replace(
        segment,
        speed=segment.speed * speed_factor,
        turn=segment.turn * turn_factor * mirror,
        seconds=segment.seconds * time_factor * stretch,
        heading=segment.heading * mirror,
    )


def rng_of(seed: int, clip: str, purpose: str) -> np.random.Generator:
    """The random generator of one clip for one purpose. It is the same on every machine and in every run."""
    return np.random.default_rng([seed, zlib.crc32(clip.encode()), zlib.crc32(purpose.encode())])


# Turns the segments of a plan into curves over time: the body's position, facing, velocity and gait.


GAITS = (STAND, WALK, JOG, CROUCH)
BLEND_SIGMA = 0.30  # seconds: sigma of the Gaussian that blends segments; a change takes about a second


@dataclass(frozen=True)
class PlannedPath:
    """A path of F frames at `fps`.

    The clip is frames `first` to F - `first` - 1. The frames before and after the clip are padding, in which
    its first steps can begin and its last steps can end.

    position: (F, 2) x and z in cm. facing: (F,) radians from +Z, positive to the left. velocity: (F, 2) cm/s
    to the left and forward, relative to the facing. gait: (F, 4) share of each gait of GAITS; they sum to 1.
    """

    fps: float
    first: int
    position: Array
    facing: Array
    velocity: Array
    gait: Array

    def __len__(self) -> int:
        return len(self.facing)

    @property
    def speed(self) -> Array:
        """(F,) speed over the ground, cm/s."""
        return np.linalg.norm(self.velocity, axis=1)


def plan_path(segments: Sequence[Segment], frames: int, fps: float) -> PlannedPath:
    """The path of a plan (a list of segments) for a clip of `frames` frames, with padding at both ends."""
    from scipy.ndimage import gaussian_filter1d  # here, because planning need not load SciPy

    first = round(4 * fps)  # four seconds of padding on each side
    total = frames + 2 * first
    segment = _segment_of_frame(segments, frames, fps)
    segment = np.pad(segment, (first, total - first - len(segment)), mode="edge")
    heading = np.radians([s.heading for s in segments])
    speed = np.array([s.speed for s in segments])
    planned_velocity = np.stack([speed * np.sin(heading), speed * np.cos(heading)], axis=1)[segment]
    turn_rate = np.array([np.radians(s.turn) / s.seconds for s in segments])[segment]  # radians a second
    gait = np.eye(len(GAITS))[[GAITS.index(s.gait) for s in segments]][segment]
    sigma = BLEND_SIGMA * fps
    velocity = gaussian_filter1d(planned_velocity, sigma, axis=0, mode="nearest")
    turn_rate = gaussian_filter1d(turn_rate, sigma * 0.8, mode="nearest")
    facing = np.cumsum(turn_rate) / fps
    facing -= facing[first]
    sin, cos = np.sin(facing), np.cos(facing)
    world_velocity = np.stack(
        [velocity[:, 0] * cos + velocity[:, 1] * sin, velocity[:, 1] * cos - velocity[:, 0] * sin], 1
    )
    position = np.cumsum(world_velocity, axis=0) / fps
    return PlannedPath(
        fps,
        first,
        position - position[first],
        facing,
        velocity,
        gaussian_filter1d(gait, sigma, axis=0, mode="nearest"),
    )


def _segment_of_frame(segments: Sequence[Segment], frames: int, fps: float) -> np.ndarray:
    """(frames,) index of the segment of each frame."""
    ends = np.cumsum([s.seconds for s in segments])
    segment = np.searchsorted(ends, np.arange(frames) / fps, side="right")
    return np.minimum(segment, len(segments) - 1)


def gait_keys(segments: Sequence[Segment], frames: int, fps: float) -> list[tuple[int, str]]:
    """The gait labels as keys (frame, label). Frames count from 0. Labels fade linearly from key to key.

    A fade from one gait to another takes about a second, like the change of the motion.
    """
    labels = [segments[i].gait for i in _segment_of_frame(segments, frames, fps)]
    half_fade = round(1.6 * BLEND_SIGMA * fps)  # frames
    keys = [(0, labels[0])]
    for i in (i for i in range(1, frames) if labels[i] != labels[i - 1]):
        start = max(i - half_fade, keys[-1][0] + 1)
        end = min(max(i + half_fade, start + 1), frames - 1)
        if start < end:
            keys += [(start, labels[i - 1]), (end, labels[i])]
    return keys


# The ground for which a walk is planned: flat, slopes, steps (stairs) or uneven.


Ground = Callable[[Array, Array], Array]  # a function from x and z to the height of the ground, all in cm


def make_ground(kind: str, rng: np.random.Generator) -> Ground:
    """The ground of one clip. kind: "flat", or a key of WAVES or STEPS.

    Slopes, steps and stairs go up and down along Z, which the figure faces at the start of the clip.
    """
    if kind in WAVES:
        return _make_waves(rng, *WAVES[kind])
    return _make_steps(rng, *STEPS[kind]) if kind in STEPS else flat


def flat(x: Array, z: Array) -> Array:
    """Height 0 everywhere."""
    return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(z)))


# Kind of ground -> lengths, steepness and across of `_make_waves`. slopes: long hills, up to about 12 degrees
# steep along Z and less steep along X. uneven: bumps and hollows of a few centimetres, in all directions.
WAVES: dict[str, tuple[tuple[float, ...], tuple[float, ...], float]] = {
    "slopes": ((480, 640, 900), (0.07, 0.07, 0.07), 0.35),
    "uneven": ((110, 150, 190, 260, 340, 600), (0.05, 0.06, 0.06, 0.06, 0.06, 0.05), 1.5),
}


def _make_waves(
    rng: np.random.Generator, lengths: tuple[float, ...], steepness: tuple[float, ...], across: float
) -> Ground:
    """A sum of sine waves, each with a random start.

    lengths: wavelengths, cm, varied by up to 10 %. steepness: greatest slope of each wave, cm per cm. across:
    greatest angle between the Z axis and the direction of a wave, radians.
    """
    angles = rng.uniform(-across, across, len(lengths))
    wave_numbers = 2 * np.pi / (np.array(lengths) * rng.uniform(0.9, 1.1, len(lengths)))
    starts = rng.uniform(0, 2 * np.pi, len(lengths))
    heights = np.array(steepness) / wave_numbers

    def ground(x: Array, z: Array) -> Array:
        along = np.multiply.outer(np.asarray(x), np.sin(angles)) + np.multiply.outer(
            np.asarray(z), np.cos(angles)
        )
        return np.sin(along * wave_numbers + starts) @ heights

    return ground


# Kind of ground -> arguments of `_make_steps`. steps: wide ones, with room for both feet. stairs: as in
# houses, with landings between the flights.
STEPS: dict[str, tuple[tuple[float, float], ...]] = {
    "steps": ((62, 130), (7, 16), (1, 5), (0, 0)),
    "stairs": ((28, 35), (13, 18), (3, 8), (130, 230)),
}


def _make_steps(
    rng: np.random.Generator,
    depths: tuple[float, float],
    rises: tuple[float, float],
    flights: tuple[float, float],
    landings: tuple[float, float],
) -> Ground:
    """Steps along Z, in flights that go up and down in turn.

    The ranges are random, in cm: depth and rise of a step, and by how much deeper the ground is between two
    flights. flights: least number of steps of a flight, and the number that it stays below.
    """
    count = 400  # steps; they reach more than 60 m in front of the start and behind it
    widths = rng.uniform(*depths, count)
    # 1 for a step up, -1 for a step down.
    ups = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    directions = np.repeat(ups, rng.integers(int(flights[0]), int(flights[1]), count))[:count]
    levels = np.concatenate([[0.0], np.cumsum(directions * rng.uniform(*rises, count))])
    levels -= levels[count // 2]  # height 0 at the start
    turns = np.diff(directions, prepend=directions[0]) != 0
    edges = np.cumsum(widths + turns * rng.uniform(*landings, count))
    edges -= edges[count // 2]

    def ground(x: Array, z: Array) -> Array:
        z = np.asarray(z) + 0 * np.asarray(x)  # in the common shape of x and z
        return levels[np.searchsorted(edges, z)]

    return ground
