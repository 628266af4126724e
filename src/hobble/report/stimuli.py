"""Short loops of the character walking as it is told, for a questionnaire or a README: images and BVH
files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hobble.channels import channel
from hobble.channels.shown import Loop as Wanted
from hobble.channels.shown import loops, shown
from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body
from hobble.models.network import Network
from hobble.report.raster import GRID, Camera, Studio
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton, jointed
from hobble.runtime.options import Runtime

SPEED = 2.5  # cm a frame, asked for
SETTLED = 6 * 60  # frames until the gait is what it was told
SHORTEST, LONGEST = 150, 300  # frames of a loop
BLEND = 12  # frames over which the end of a loop passes into its beginning
STRIDE = 2  # frames of the motion to one of the image
QUALITY = 80
FELT = 0.1  # cm; a loop nearer to the plain one shows nothing of what it is told


@dataclass(frozen=True)
class Loop:
    """A walk that goes round: positions (F, J, 3) and rotations (F, J, 4), the way (3,) of one round, and how
    far (cm, mean over joints) its end was from its beginning before they were blended."""

    positions: Array
    rotations: Array
    way: Array
    gap: float


def write_stimuli(
    network: Network, folder: str | Path, runtime: Runtime, size: int = 400
) -> list[dict[str, Any]]:
    """Write <name>.webp and <name>.bvh of each walk of each channel into a folder, and stimuli.json.

    Those of a channel after the first are called <channel>-<name>. Columns that were told nothing in
    training,
    and how far each walk is from the plain one, are listed: see `doubts`. Raises HobbleError for a
    network that
    is told nothing.
    """
    if network.skeleton is None or not network.channels:
        raise HobbleError("this network is told nothing; make the stimuli of one that has `channels`")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    skeleton = network.skeleton
    plain, rows = walk(network, {}, runtime), []
    for name, one, wanted in all_loops(network):
        columns, trained = network.channels[one], told_in_training(network, one)
        studio = Studio(body(skeleton), shown(one, skeleton, columns, trained).regions)
        loop = walk(network, {one: dict(wanted.told)}, runtime) if wanted.told else plain
        own = skeleton
        if "skeleton" not in network.meta:
            own = fitted_skeleton(skeleton, loop.positions, loop.rotations)
        export_bvh(folder / f"{name}.bvh", name, own, loop.positions, loop.rotations)
        colours = None
        if wanted.coloured:
            colours = np.array([wanted.told.get(column, 0.0) for column in columns]) / channel(one).highest
        save_loop(folder / f"{name}.webp", frames(studio, skeleton, loop, colours, size))
        seconds = len(loop.positions) / 60
        rows.append(
            {
                "name": name,
                "channel": one,
                "told": dict(wanted.told),
                "coloured": wanted.coloured,
                "never_told": [column for column in wanted.told if column not in trained],
                "from_plain_cm": round(apart(loop, plain), 2),
                "seconds": seconds,
                "metres_a_second": round(float(np.linalg.norm(loop.way)) / 100 / seconds, 3),
                "gap_cm": round(loop.gap, 2),
            }
        )
    write_json(folder / "stimuli.json", {"stimuli": rows})
    return rows


def all_loops(network: Network) -> list[tuple[str, str, Wanted]]:
    """The name, channel and walk of each loop; what tells nothing is there once."""
    assert network.skeleton is not None
    out: list[tuple[str, str, Wanted]] = []
    for one, columns in network.channels.items():
        for loop in loops(one, network.skeleton, columns, network.trained(one)):
            if not out or out[0][1] == one:
                out.append((loop.name, one, loop))
            elif loop.told:
                out.append((f"{one}-{loop.name}", one, loop))
    return out


def told_in_training(network: Network, name: str) -> set[str]:
    """Columns of a channel that were above 0 somewhere in training, as the mean of the input tells."""
    means = network.x_mean[network.layout.x_channel(name)]
    return {column for column, mean in zip(network.channels[name], means, strict=True) if mean > 0}


def apart(loop: Loop, other: Loop) -> float:
    """Mean distance (cm, over joints and poses) of the poses of a loop from the nearest ones of another.

    Both stand over the origin and go the same way. 0 where they are the same walk, wherever it was cut.
    """
    ours, theirs = _ahead(loop), _ahead(other)
    return float(np.mean([np.linalg.norm(theirs - pose, axis=-1).mean(axis=1).min() for pose in ours]))


def doubts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What whoever shows the loops has to know of them: those that nobody tells apart. rows: of the above."""
    same = [row for row in rows if row["told"] and row["from_plain_cm"] < FELT]
    part = [row for row in rows if row["never_told"] and row not in same]
    out = []
    if same:
        names = ", ".join(row["name"] for row in same)
        out.append(
            f"{names}: no different from the plain walk (less than {FELT} cm); not for a questionnaire."
        )
    if part:
        out.append(f"{', '.join(row['name'] for row in part)}: not all that is told there shows.")
    if never := sorted({column for row in [*same, *part] for column in row["never_told"]}):
        out.append(f"Never told in training: {', '.join(never)}. Train on clips in which they are.")
    return out


def walk(network: Network, told: Mapping[str, Mapping[str, float]], runtime: Runtime) -> Loop:
    """The character walking straight on, cut where a later moment is most like an earlier one."""
    animation = ProceduralAnimation(network, **dict(runtime))
    ahead = np.array([0.0, SPEED])
    poses = [animation.next_pose(ahead, None, "walk", **told) for _ in range(SETTLED + 60 + LONGEST + BLEND)]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    first, last, gap = cut(positions)
    kept, turned = positions[first:last].copy(), rotations[first:last].copy()
    way = positions[last, 0] - positions[first, 0]
    way[1] = 0.0
    for k in range(BLEND):
        share = (k + 1) / (BLEND + 1)
        here, before = last - BLEND + k, first - BLEND + k
        kept[here - first] = (1 - share) * positions[here] + share * (positions[before] + way)
        turned[here - first] = _mixed(rotations[here], rotations[before], share)
    return Loop(kept, turned, way, gap)


def cut(positions: Array) -> tuple[int, int, float]:
    """First frame of a loop, the frame after its last, and the mean distance (cm) of joints between the two.

    Over all first frames of a second from SETTLED on, and all lengths allowed; velocities count too.
    """
    local = positions - positions[:, :1] * np.array([1.0, 0.0, 1.0])
    speed = np.gradient(local, axis=0)
    best = (SETTLED, SETTLED + SHORTEST, np.inf)
    for first in range(SETTLED, SETTLED + 60, 2):
        later = np.arange(first + SHORTEST, min(first + LONGEST, len(positions) - BLEND))
        apart = np.linalg.norm(local[later] - local[first], axis=-1).mean(axis=1)
        apart += 3 * np.linalg.norm(speed[later] - speed[first], axis=-1).mean(axis=1)
        if apart.min() < best[2]:
            best = (first, int(later[apart.argmin()]), float(apart.min()))
    first, last, _ = best
    return first, last, float(np.linalg.norm(local[last] - local[first], axis=-1).mean())


def frames(
    studio: Studio, skeleton: Skeleton, loop: Loop, told: Array | None, size: int
) -> list[NDArray[np.uint8]]:
    """The pictures of a loop. The camera goes along evenly, and the grid under it by whole meshes a round."""
    count, keep = len(loop.positions), body(skeleton).bones
    world, places = jointed(skeleton, loop.positions, loop.rotations)
    start, yaw = loop.positions[0, 0], np.arctan2(loop.way[0], loop.way[2])
    middle = loop.positions[:, 0].mean(axis=0) - loop.way * (count - 1) / count / 2 - start
    length = float(np.linalg.norm(loop.way))
    even = max(1, round(length / GRID)) * GRID / max(length, 1e-9)
    turn = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
    turns = quat.mul(quat.yaw(-yaw), world[:, keep])
    out = []
    for f in range(0, count - count % STRIDE, STRIDE):
        gone = loop.way * f / count
        points = (places[f, keep] - start - gone - middle * [1, 0, 1]) @ turn.T
        points[:, 1] = places[f, keep, 1]
        travelled = np.array([0.0, 0.0, length * f / count * even])
        camera = Camera(np.array([0.0, 82.0, 0.0]) + travelled, size=size)
        out.append(studio.draw(points + travelled, turns[f], camera, told))
    return out


def save_loop(path: Path, pictures: list[NDArray[np.uint8]]) -> None:
    """Write an animated WebP that goes round for ever."""
    images = [Image.fromarray(picture) for picture in pictures]
    times = [round(1000 * STRIDE * (k + 1) / 60) - round(1000 * STRIDE * k / 60) for k in range(len(images))]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=times, loop=0, quality=QUALITY, method=3
    )


def _ahead(loop: Loop) -> Array:
    """Positions (F, J, 3) of a loop over the origin, turned so that its way is along z."""
    yaw = np.arctan2(loop.way[0], loop.way[2])
    turn = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
    return (loop.positions - loop.positions[:, :1] * [1, 0, 1]) @ turn.T


def _mixed(a: Array, b: Array, share: float) -> Array:
    """Rotations on the way from a to b (J, 4), normalised."""
    b = np.where((a * b).sum(-1, keepdims=True) < 0, -b, b)
    mixed = (1 - share) * a + share * b
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
