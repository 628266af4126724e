"""Fits the ground under one gait cycle to the soles of the feet, where they are on the ground.

First, as in Holden et al. (2017), a surface of radial basis functions is fitted to the residual: the heights
of feet in contact above the ground. This surface is added to the ground. Then, where a foot is still too far
below the ground, a pit is dug: the ground is lowered to a cone around the foot.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.core.smooth import true_runs
from hobble.terrain import FitOptions
from hobble.terrain.patches import FootPoints, Patches, best_patches

Mask = NDArray[np.bool_]

FOOT_ROLES = ("left_heel", "left_toe", "right_heel", "right_toe")  # roles of joints of a `Skeleton`
SOLE_CM = 4.0  # height of a toe joint above its sole where nothing tells it
IS_HEEL = np.array([True, False, True, False])  # whether each of FOOT_ROLES is a heel
OTHER_OF_FOOT = [1, 0, 3, 2]  # for each of FOOT_ROLES, the index of the other joint of the same foot


@dataclass(frozen=True)
class Feet:
    """The four contact joints over F frames, in the order of FOOT_ROLES.

    soles: (F, 4, 3) positions of the soles below the joints, cm. contacts: (F, 4) whether each joint is in
    contact with the ground. heel_height, toe_height: height of the joints above their soles, cm.
    """

    soles: Array = field(repr=False)
    contacts: Mask = field(repr=False)
    heel_height: float
    toe_height: float


def find_soles(clip: Clip, contacts: Mask, frames: np.ndarray, flat: bool, options: FitOptions) -> Feet:
    """The soles of a clip: the contact joints, lowered by `heel_height` and `toe_height` of the options.

    contacts: (F, 4). frames: (N,) the frames from which "auto" is computed. flat: whether the ground is flat,
    and then at height 0.

    On flat ground "auto" is the median height of the joints in contact. If this puts a sole more than
    `deepest` cm below the ground, the height is reduced by just enough to prevent that; but if more than
    `deepest` cm would be needed, it stays the median. On other ground, or without contacts, the toe joint is
    SOLE_CM above its sole, and the heel joint is higher than the toe joint by as much as in the rest pose.
    """
    joints = clip.positions[:, [clip.skeleton.role(role) for role in FOOT_ROLES]].copy()
    above_sole: list[float] = []
    for setting, columns in ((options.heel_height, IS_HEEL), (options.toe_height, ~IS_HEEL)):
        heights, down = joints[frames][:, columns, 1], contacts[frames][:, columns]
        if setting != "auto":
            above_sole.append(float(setting))
        elif flat and down.any():
            above_sole.append(_flat_height(heights, down, options.deepest))
        else:
            above_sole.append(SOLE_CM + (heel_above_toe(clip.skeleton) if columns is IS_HEEL else 0.0))
    joints[..., 1] -= np.where(IS_HEEL, *above_sole)
    return Feet(joints, contacts, *above_sole)


def is_above_other_joint(feet: Feet, least: float) -> Mask:
    """(F, 4) whether the other joint of the same foot is in contact and more than `least` cm lower."""
    height = feet.soles[..., 1]
    return (height - height[:, OTHER_OF_FOOT] > least) & feet.contacts[:, OTHER_OF_FOOT]


def _flat_height(heights: Array, down: Array, deepest: float | None) -> float:
    """The value of "auto" on flat ground, cm; see `find_soles`.

    heights: (N, 2) of the heel or toe joints, cm. down: (N, 2) whether they are in contact.
    """
    median = float(np.median(heights[down]))
    highest = float(heights.min()) + (deepest or 0.0)  # a larger value puts the lowest sole below -deepest
    return highest if deepest is not None and median - deepest <= highest < median else median


def heel_above_toe(skeleton: Skeleton) -> float:
    """Height of the heel joint above the toe joint in the rest pose, cm, mean of both sides."""
    heights = rest_positions(skeleton)[[skeleton.role(role) for role in FOOT_ROLES], 1]
    return float(heights[IS_HEEL].mean() - heights[~IS_HEEL].mean())


SMOOTHING = 0.1  # regularisation of the radial basis functions, as in Holden et al. (2017)
WALL_STEEPNESS = 2.0  # least steepness of the walls of a pit, cm per cm
# A surface that leaves too large a residual is fitted again with a quarter of the smoothing, at most this
# many times.
MAX_REFITS = 8


def gather_stances(soles: Array, contacts: Mask, longest: int) -> Array:
    """Average the sole of each joint over consecutive frames in contact.

    soles: (T, 4, 3). contacts: (T, 4) bool. longest: at most this many frames become one point; longer
    contacts are cut into several. Returns points (N, 4): x, z and height of the sole, cm, and the number of
    frames of each point, which is its weight.
    """
    points = [
        [*soles[part, joint].mean(axis=0)[[0, 2, 1]], len(soles[part, joint])]
        for joint in range(4)
        for start, end in true_runs(contacts[:, joint]).tolist()
        for part in (slice(f, min(f + longest, end)) for f in range(start, end, longest))
    ]
    return np.array(points).reshape(-1, 4)


@dataclass(frozen=True)
class Surface:
    """A surface: the weighted sum of r / spread over N places, where r is the distance from the place.

    places: (N, 2) x and z, cm. weights: (N,). spread: mean distance between the places, cm.
    """

    places: Array = field(repr=False)
    weights: Array = field(repr=False)
    spread: float

    def heights_at(self, points: Array) -> Array:
        """Heights (M,) at points (M, 2)."""
        return distances(points, self.places) @ (self.weights / self.spread)


def fit_surfaces(
    points: Array, residual: Array, most: float | None = None, standing: int | None = None
) -> list[Surface]:
    """One surface for each row of `residual` (K, N), the heights that it should have at N points, cm.

    points: (N, 4) from `gather_stances`. A point with count m has SMOOTHING / m on
    the diagonal of the system of equations, and the weight m in the mean distance between points. So the
    surface is exactly that of m points at one place.

    most: largest mean difference, cm, that may be left between a surface and its residual; None: no limit. A
    surface that leaves more is fitted again with less smoothing. This happens, for example, if feet stand
    half a metre beside a beam. standing: the mean is taken over the first `standing` points; None: all.
    """
    places, count = points[:, :2], points[:, 3]
    apart = distances(places, places)
    spread = float(count @ apart @ count / count.sum() ** 2)
    if spread < 1e-6:  # all points are at one place, so no surface can be fitted
        return [Surface(places[:1], np.zeros(1), 1.0)] * len(residual)
    diagonal, weights = SMOOTHING / count, np.zeros_like(residual)
    share = count[:standing] / count[:standing].sum()
    refit = np.arange(len(residual))  # indices of the surfaces that are still to be fitted
    for _ in range(1 + MAX_REFITS):
        weights[refit] = np.linalg.solve(apart / spread - np.diag(diagonal), residual[refit].T).T
        if most is None:
            break
        # The system of equations is surface - diagonal * weights = residual, so diagonal * weights is left.
        refit = refit[np.sum(np.abs(weights[refit] * diagonal)[:, :standing] * share, axis=1) > most]
        if not len(refit):
            break
        diagonal = diagonal / 4
    return [Surface(places, w, spread) for w in weights]


@dataclass(frozen=True)
class Pits:
    """Cones with the tip at the bottom, down to which the ground is lowered.

    places: (N, 2) x and z of the tips, cm. heights: (N,) of the tips, cm. steepness: (N,) cm per cm.
    """

    places: Array = field(repr=False)
    heights: Array = field(repr=False)
    steepness: Array = field(repr=False)

    def lower(self, ground: Array, points: Array) -> Array:
        """(M,) at points (M, 2): the lowest of the heights `ground` (M,) and the cones."""
        cones = self.heights + self.steepness * distances(points, self.places)
        return np.minimum(ground, cones.min(axis=1, initial=np.inf))


def distances(a: Array, b: Array) -> Array:
    """Distances (M, N) between points a (M, 2) and b (N, 2)."""
    x, z = a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]
    return np.sqrt(x * x + z * z)


# Fits the ground under one cycle: finds the patches that suit it best, and makes them meet the feet.


STANCE_FRAMES = 8  # at most this many frames of a foot in contact are averaged to one point
COVERED_FRAMES = 4  # the same for a foot that is below the ground
# cm: at these distances to the sides of a path on a beam, the ground must be far below the beam.
BEAM_SIDE_CM = (35.0, 50.0)
# cm: points beside the path are left out if another part of the path, and so the beam, is closer than this.
PATH_CLEARANCE_CM = 25.0


@dataclass(frozen=True)
class CycleGround:
    """The ground of K fits of one cycle.

    patches: all patches; None for flat ground. chosen, error: (K,) indices of the fitted patches and their
    errors, best first. centre: (2,) x and z of the middle of the patches, cm. level: (K,) height that is
    added to each patch, cm. surfaces: for each fit, the surface that is added so that the ground meets
    the feet; empty if none is added. pits: for each fit, the pits in the ground; empty if there are none.
    """

    patches: Patches | None = field(repr=False)
    chosen: np.ndarray
    error: Array
    centre: Array = field(repr=False)
    level: Array = field(repr=False)
    surfaces: Sequence[Surface] = field(default=(), repr=False)
    pits: Sequence[Pits] = field(default=(), repr=False)

    def heights_at(self, points: Array) -> Array:
        """Heights (K, M), cm, at world points (M, 2), x and z."""
        heights = np.tile(self.level[:, None], len(points))
        if self.patches is not None:
            heights += self.patches.heights_at(self.chosen, self.patches.cells(points, self.centre))
        for k, surface in enumerate(self.surfaces):
            heights[k] += surface.heights_at(points)
        for k, pit in enumerate(self.pits):
            heights[k] = pit.lower(heights[k], points)
        return heights

    def height_above_soles(self, soles: Array) -> Array:
        """(K, ...) height of the ground above each sole (..., 3), cm; negative if the ground is lower."""
        heights = self.heights_at(soles[..., [0, 2]].reshape(-1, 2))
        return heights.reshape(-1, *soles.shape[:-1]) - soles[..., 1]


def fit_cycle(
    patches: Patches, soles: Array, contacts: Mask, samples: Array, kind: str, options: FitOptions
) -> CycleGround:
    """Fit the ground under one cycle and the frames around it, T frames together.

    soles: (T, 4, 3) positions of the soles at heels and toes, cm. contacts: (T, 4) bool, at least one true.
    samples: (3, T, 2) x and z of points to the left of the path, on it and to its right. kind: "rocky",
    "jumpy" or "beam"; "jumpy" and "beam" add terms to the error.
    """
    where, height = soles[..., [0, 2]], soles[..., 1]
    centre, level = where[contacts].mean(axis=0), height[contacts].mean()
    cells = patches.cells(where.reshape(-1, 2), centre).reshape(where.shape)
    foot_points = np.concatenate([cells, (height - level)[..., None]], axis=-1)
    beam_sides = beam_side_points(patches, samples, centre) if kind == "beam" else np.zeros((0, 4))
    footing = FootPoints(foot_points[contacts], foot_points[~contacts], kind == "jumpy", beam_sides)
    chosen, error = best_patches(patches, footing, options.fits)
    # Mean height of each patch under the feet in contact, subtracted to make the patch level with the feet.
    patch_level = patches.heights_at(chosen, cells[contacts]).mean(axis=1, dtype=float)
    uncorrected = CycleGround(patches, chosen, error, centre, level - patch_level)
    return meet_feet(uncorrected, soles, contacts, options)


def flat_ground(soles: Array, contacts: Mask, options: FitOptions) -> CycleGround:
    """Flat ground, with one fit.

    soles, contacts: see `fit_cycle`. With `flat_level: feet` its height is the mean height of the soles in
    contact, as in Holden et al. (2017). They compute contacts from velocities, and the last frame has no
    velocity. So for this mean, as in their work, the last frame gets the contacts of the frame before it.

    If the feet in contact are on average more than `deepest` cm from it (because the floor or the capture is
    uneven), a surface is added and pits are dug where a foot is still too low. Otherwise only pits are dug,
    under feet that are more than `deepest` below the ground.
    """
    deepest = options.deepest
    heights = soles[..., 1]
    by_velocity = np.concatenate([contacts[:-1], contacts[-2:-1]])
    counted = by_velocity if by_velocity.any() else contacts
    height = heights[counted].mean() if options.flat_level == "feet" else 0.0
    uncorrected = CycleGround(None, np.array([-1]), np.zeros(1), np.zeros(2), np.array([height]))
    if deepest is None:
        return uncorrected
    if np.abs(heights[contacts] - height).mean() > deepest:
        return meet_feet(uncorrected, soles, contacts, options)
    return _with_pits(uncorrected, soles, gather_stances(soles, contacts, STANCE_FRAMES), deepest)


def meet_feet(uncorrected: CycleGround, soles: Array, contacts: Mask, options: FitOptions) -> CycleGround:
    """Correct the ground so that it meets the feet in contact.

    A smooth surface is fitted to the residual, the heights of feet in contact above the ground. At most
    deepest / 2 of it is left on average. If feet are then more than deepest / 2 below the ground, they are
    added to the points and the surface is fitted again. Pits are dug for feet that are still more than
    `deepest` below the ground. If `deepest` is None, one surface is fitted, without a limit.
    """
    standing = gather_stances(soles, contacts, STANCE_FRAMES)
    residual = standing[:, 2] - uncorrected.heights_at(standing[:, :2])
    deepest = options.deepest
    if deepest is None:
        return replace(uncorrected, surfaces=fit_surfaces(standing, residual))
    most = deepest / 2
    ground = replace(uncorrected, surfaces=fit_surfaces(standing, residual, most))
    surfaces = list(ground.surfaces)
    for k, covered in enumerate(ground.height_above_soles(soles) > most):
        if covered.any():
            points = np.concatenate([standing, gather_stances(soles, covered & ~contacts, COVERED_FRAMES)])
            residual = (points[:, 2] - uncorrected.heights_at(points[:, :2])[k])[None]
            (surfaces[k],) = fit_surfaces(points, residual, most, len(standing))
    return _with_pits(replace(uncorrected, surfaces=surfaces), soles, standing, deepest)


def _with_pits(ground: CycleGround, soles: Array, standing: Array, deepest: float) -> CycleGround:
    """The ground of each fit with pits for the feet that are more than `deepest` below it.

    In a pit the ground is lowered until the foot is only deepest / 2 below it. standing: (M, 4) points of
    standing feet, from `gather_stances`. The walls of a pit are so steep that the ground under standing feet
    nearby is not lowered, for example on the next step of stairs.
    """
    pits = []
    for below in ground.height_above_soles(soles) > deepest:
        places, heights = soles[below][:, [0, 2]], soles[below][:, 1] + deepest / 2
        apart = np.maximum(distances(places, standing[:, :2]), 1e-3)
        needed_steepness = ((standing[:, 2] - heights[:, None]) / apart).max(axis=1)
        pits.append(Pits(places, heights, np.maximum(needed_steepness, WALL_STEEPNESS)))
    return replace(ground, pits=pits)


def beam_side_points(patches: Patches, samples: Array, centre: Array) -> Array:
    """(N, 4) points beside a path on a beam, at which the ground must be far below the beam.

    Columns: u and v of the point, then u and v of the path beside it, in cells from the middle of the patch.
    samples: see `fit_cycle`. centre: (2,) x and z of the middle of the patch, cm.
    """
    path = samples[1]
    sides = samples[0] - path
    sides = sides / np.linalg.norm(sides, axis=-1, keepdims=True)
    beside = np.concatenate([path + sign * d * sides for d in BEAM_SIDE_CM for sign in (1, -1)])
    on_path = np.tile(path, (2 * len(BEAM_SIDE_CM), 1))
    free = distances(beside, path).min(axis=1) > PATH_CLEARANCE_CM
    return np.concatenate([patches.cells(beside[free], centre), patches.cells(on_path[free], centre)], axis=1)
