"""Short loops of the walking character, for a questionnaire or a README, as animated images and BVH files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hobble.channels import channel
from hobble.channels.shown import SampleWalk, loops, shown
from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body
from hobble.models.network import Network
from hobble.report.raster import GRID, BodyRenderer, Camera
from hobble.report.straight_walk import walk_straight
from hobble.runtime.export import export_bvh, fitted_skeleton, jointed
from hobble.runtime.options import Runtime

SETTLED = 6 * 60  # frames until the gait has settled
SHORTEST, LONGEST = 150, 300  # frames: least and greatest length of a loop
BLEND = 12  # frames over which the end of a loop is blended into its start
FRAME_STEP = 2  # every second frame of the motion becomes an image
QUALITY = 80  # of the WebP images, 0 to 100
VISIBLE = 0.1  # cm: a loop whose distance from the neutral loop (`apart`) is smaller looks the same


@dataclass(frozen=True)
class RepeatedWalk:
    """A walk that can be repeated.

    positions: (F, J, 3), cm. rotations: (F, J, 4). travel: (3,) cm from the start of one repetition to the
    start of the next. gap: mean distance between the joints of the last and the first pose before blending,
    cm.
    """

    positions: Array
    rotations: Array
    travel: Array
    gap: float


def write_stimuli(
    network: Network, folder: str | Path, runtime: Runtime, size: int = 400
) -> list[dict[str, Any]]:
    """Write <name>.webp and <name>.bvh of each sample walk of each channel into a folder, and stimuli.json.

    The sample walks are those of `all_loops`. The files of the second channel and later ones are called
    <channel>-<name>. stimuli.json has an entry for each walk. This also lists the walk's columns that were
    never above 0 in training, and its distance from the neutral walk. Returns the entries. size: pixels on
    each side. Raises HobbleError for a network without channels.
    """
    if network.skeleton is None or not network.channels:
        raise HobbleError(
            "this network has no channels, so there are no stimuli to make; use a configuration with "
            "`channels`"
        )
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    skeleton = network.skeleton
    neutral, rows = walk(network, {}, runtime), []
    for name, channel_name, sample in all_loops(network):
        columns, trained = network.channels[channel_name], trained_columns(network, channel_name)
        renderer = BodyRenderer(body(skeleton), shown(channel_name, skeleton, columns, trained).regions)
        loop = walk(network, {channel_name: dict(sample.values)}, runtime) if sample.values else neutral
        bvh_skeleton = skeleton
        if "skeleton" not in network.meta:
            bvh_skeleton = fitted_skeleton(skeleton, loop.positions, loop.rotations)
        export_bvh(folder / f"{name}.bvh", name, bvh_skeleton, loop.positions, loop.rotations)
        colours = None
        if sample.coloured:
            values = np.array([sample.values.get(column, 0.0) for column in columns])
            colours = values / channel(channel_name).highest
        save_loop(folder / f"{name}.webp", frames(renderer, skeleton, loop, colours, size))
        seconds = len(loop.positions) / 60
        rows.append(
            {
                "name": name,
                "channel": channel_name,
                "values": dict(sample.values),
                "coloured": sample.coloured,
                "untrained": [column for column in sample.values if column not in trained],
                "from_plain_cm": round(apart(loop, neutral), 2),
                "seconds": seconds,
                "metres_a_second": round(float(np.linalg.norm(loop.travel)) / 100 / seconds, 3),
                "gap_cm": round(loop.gap, 2),
            }
        )
    write_json(folder / "stimuli.json", {"stimuli": rows})
    return rows


def all_loops(network: Network) -> list[tuple[str, str, SampleWalk]]:
    """(name of its files, channel, walk) of each loop. The neutral walk is listed once."""
    assert network.skeleton is not None
    out: list[tuple[str, str, SampleWalk]] = []
    for name, columns in network.channels.items():
        for loop in loops(name, network.skeleton, columns, network.trained(name)):
            if not out or out[0][1] == name:
                out.append((loop.name, name, loop))
            elif loop.values:
                out.append((f"{name}-{loop.name}", name, loop))
    return out


def trained_columns(network: Network, name: str) -> set[str]:
    """Columns of a channel that were above 0 somewhere in training, judged by the mean of their input."""
    means = network.x_mean[network.layout.x_channel(name)]
    return {column for column, mean in zip(network.channels[name], means, strict=True) if mean > 0}


def apart(loop: RepeatedWalk, other: RepeatedWalk) -> float:
    """Mean distance (cm, over joints and poses) from each pose of `loop` to the nearest pose of `other`.

    Both are moved to the origin and turned to the same direction. The distance of a walk from itself is 0,
    even if it starts at another moment.
    """
    ours, theirs = _ahead(loop), _ahead(other)
    return float(np.mean([np.linalg.norm(theirs - pose, axis=-1).mean(axis=1).min() for pose in ours]))


def doubts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings about loops that look like the neutral walk or have values without effect.

    rows: from `write_stimuli`.
    """
    unchanged = [row for row in rows if row["values"] and row["from_plain_cm"] < VISIBLE]
    partly = [row for row in rows if row["untrained"] and row not in unchanged]
    out = []
    if unchanged:
        names = ", ".join(row["name"] for row in unchanged)
        out.append(
            f"{names}: they look like the neutral walk (less than {VISIBLE} cm from it). Leave them out of a "
            "questionnaire."
        )
    if partly:
        out.append(f"{', '.join(row['name'] for row in partly)}: some of their values have no effect.")
    if never := sorted({column for row in [*unchanged, *partly] for column in row["untrained"]}):
        out.append(f"Never above 0 in training: {', '.join(never)}. Train on clips with such values.")
    return out


def walk(network: Network, values: Mapping[str, Mapping[str, float]], runtime: Runtime) -> RepeatedWalk:
    """A loop of the character walking straight on, cut between the two most similar poses.

    values: channel -> column -> value.
    """
    count = SETTLED + 60 + LONGEST + BLEND
    poses = [pose for _, pose in walk_straight(network, runtime, count, values)]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    first, last, gap = cut(positions)
    kept, turned = positions[first:last].copy(), rotations[first:last].copy()
    travel = positions[last, 0] - positions[first, 0]
    travel[1] = 0.0
    for k in range(BLEND):
        share = (k + 1) / (BLEND + 1)
        here, before = last - BLEND + k, first - BLEND + k
        kept[here - first] = (1 - share) * positions[here] + share * (positions[before] + travel)
        turned[here - first] = _mixed(rotations[here], rotations[before], share)
    return RepeatedWalk(kept, turned, travel, gap)


def cut(positions: Array) -> tuple[int, int, float]:
    """Where to cut a walk into a loop: at two frames whose poses and velocities are as similar as possible.

    Returns the first frame of the loop, the frame after its last, and the mean distance (cm) of joints
    between these two frames. First frames within a second after SETTLED and all allowed lengths are tried.
    """
    local = positions - positions[:, :1] * np.array([1.0, 0.0, 1.0])
    speed = np.gradient(local, axis=0)
    best = (SETTLED, SETTLED + SHORTEST, np.inf)
    for first in range(SETTLED, SETTLED + 60, 2):
        later = np.arange(first + SHORTEST, min(first + LONGEST, len(positions) - BLEND))
        unlike = np.linalg.norm(local[later] - local[first], axis=-1).mean(axis=1)
        unlike += 3 * np.linalg.norm(speed[later] - speed[first], axis=-1).mean(axis=1)
        if unlike.min() < best[2]:
            best = (first, int(later[unlike.argmin()]), float(unlike.min()))
    first, last, _ = best
    return first, last, float(np.linalg.norm(local[last] - local[first], axis=-1).mean())


def frames(
    renderer: BodyRenderer, skeleton: Skeleton, loop: RepeatedWalk, values: Array | None, size: int
) -> list[NDArray[np.uint8]]:
    """The pictures of a loop.

    values: (columns,) from 0 to 1, drawn as colours. The camera moves at constant speed. In each
    repetition it crosses a whole number of cells of the ground's grid, so that the ground repeats, too.
    """
    count, keep = len(loop.positions), body(skeleton).bones
    world, places = jointed(skeleton, loop.positions, loop.rotations)
    start, yaw = loop.positions[0, 0], np.arctan2(loop.travel[0], loop.travel[2])
    middle = loop.positions[:, 0].mean(axis=0) - loop.travel * (count - 1) / count / 2 - start
    length = float(np.linalg.norm(loop.travel))
    even = max(1, round(length / GRID)) * GRID / max(length, 1e-9)
    turn = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
    turns = quat.mul(quat.yaw(-yaw), world[:, keep])
    out = []
    for f in range(0, count - count % FRAME_STEP, FRAME_STEP):
        gone = loop.travel * f / count
        points = (places[f, keep] - start - gone - middle * [1, 0, 1]) @ turn.T
        points[:, 1] = places[f, keep, 1]
        travelled = np.array([0.0, 0.0, length * f / count * even])
        camera = Camera(np.array([0.0, 82.0, 0.0]) + travelled, size=size)
        out.append(renderer.draw(points + travelled, turns[f], camera, values))
    return out


def save_loop(path: Path, pictures: list[NDArray[np.uint8]]) -> None:
    """Write an animated WebP that repeats forever."""
    images = [Image.fromarray(picture) for picture in pictures]
    times = [
        round(1000 * FRAME_STEP * (k + 1) / 60) - round(1000 * FRAME_STEP * k / 60)
        for k in range(len(images))
    ]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=times, loop=0, quality=QUALITY, method=3
    )


def _ahead(loop: RepeatedWalk) -> Array:
    """Positions (F, J, 3) of a loop, with the root over the origin and the direction of travel along z."""
    yaw = np.arctan2(loop.travel[0], loop.travel[2])
    turn = np.array([[np.cos(yaw), 0, -np.sin(yaw)], [0, 1, 0], [np.sin(yaw), 0, np.cos(yaw)]])
    return (loop.positions - loop.positions[:, :1] * [1, 0, 1]) @ turn.T


def _mixed(a: Array, b: Array, share: float) -> Array:
    """Rotations (J, 4) interpolated between a and b, normalised. share: 0 is a, 1 is b."""
    b = np.where((a * b).sum(-1, keepdims=True) < 0, -b, b)
    mixed = (1 - share) * a + share * b
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
