"""Makes short loops of the walking character, as animated images and BVH files.

They are stimuli for a questionnaire, or pictures for a README.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hobble.channels import channel
from hobble.channels.shown import SampleWalk, channel_display
from hobble.core.errors import HobbleError
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body_mesh
from hobble.models.network import Network
from hobble.report.raster import GRID, BodyRenderer, Camera
from hobble.runtime.export import export_bvh, fitted_skeleton, restore_bone_lengths
from hobble.runtime.loops import RepeatedWalk, make_loop
from hobble.runtime.options import Runtime

FRAME_STEP = 2  # every second frame of the motion becomes an image
QUALITY = 80  # of the WebP images, 0 to 100
# cm: a loop that is nearer than this to the loop of the neutral walk (`loop_distance`) looks the same. In the
# neutral walk all values of channels are 0.
VISIBLE = 0.1


def write_stimuli(
    network: Network, folder: str | Path, runtime: Runtime, size: int = 400
) -> list[dict[str, Any]]:
    """Write <name>.webp and <name>.bvh of each loop of `all_loops` into a folder, and stimuli.json.

    size: pixels on each side of the images. Raises HobbleError for a network without channels.

    Returns the content of stimuli.json, a dict for each loop. `values`: column of the channel -> value.
    `coloured`: whether the values colour the body. `untrained`: the columns of `values` that were never above
    0 in training. `from_plain_cm`: distance from the loop of the neutral walk, see `loop_distance`. `gap_cm`:
    see `RepeatedWalk`.
    """
    if network.skeleton is None or not network.channels:
        raise HobbleError(
            "this network has no channels, so there are no stimuli to make; use a configuration with "
            "`channels`"
        )
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    skeleton = network.skeleton
    neutral, entries = make_loop(network, {}, runtime), []
    for name, channel_name, sample in all_loops(network):
        columns, trained = network.channels[channel_name], trained_columns(network, channel_name)
        renderer = BodyRenderer(
            body_mesh(skeleton), channel_display(channel_name, skeleton, columns, trained).regions
        )
        loop = neutral
        if sample.values:
            loop = make_loop(network, {channel_name: dict(sample.values)}, runtime)
        bvh_skeleton = skeleton
        if "skeleton" not in network.meta:  # then the bone lengths are known only from the motion
            bvh_skeleton = fitted_skeleton(skeleton, loop.positions, loop.rotations)
        export_bvh(folder / f"{name}.bvh", name, bvh_skeleton, loop.positions, loop.rotations)
        colours = None
        if sample.coloured:
            values = np.array([sample.values.get(column, 0.0) for column in columns])
            colours = values / channel(channel_name).highest
        save_loop(folder / f"{name}.webp", draw_frames(renderer, skeleton, loop, colours, size))
        seconds = len(loop.positions) / 60
        entries.append(
            {
                "name": name,
                "channel": channel_name,
                "values": dict(sample.values),
                "coloured": sample.coloured,
                "untrained": [column for column in sample.values if column not in trained],
                "from_plain_cm": round(loop_distance(loop, neutral), 2),
                "seconds": seconds,
                "metres_a_second": round(float(np.linalg.norm(loop.travel)) / 100 / seconds, 3),
                "gap_cm": round(loop.gap, 2),
            }
        )
    write_json(folder / "stimuli.json", {"stimuli": entries})
    return entries


def all_loops(network: Network) -> list[tuple[str, str, SampleWalk]]:
    """(name of the files, channel, walk) of each loop, as `ChannelDisplay.loops` lists them.

    The names of the first channel are used as they are. Names of later channels begin with "<channel>-", and
    their neutral walk is left out, because the first channel has it.
    """
    assert network.skeleton is not None
    out: list[tuple[str, str, SampleWalk]] = []
    for name, columns in network.channels.items():
        for loop in channel_display(name, network.skeleton, columns, network.trained_labels(name)).loops:
            if not out or out[0][1] == name:  # the first channel that has loops
                out.append((loop.name, name, loop))
            elif loop.values:
                out.append((f"{name}-{loop.name}", name, loop))
    return out


def trained_columns(network: Network, name: str) -> set[str]:
    """Columns of a channel that were above 0 somewhere in training: those whose mean is above 0."""
    means = network.x_mean[network.layout.x_channel(name)]
    return {column for column, mean in zip(network.channels[name], means, strict=True) if mean > 0}


def loop_distance(loop: RepeatedWalk, other: RepeatedWalk) -> float:
    """Mean distance (cm, over joints and poses) from each pose of `loop` to the nearest pose of `other`.

    Both loops are moved to the origin and turned to the same direction. The distance of a walk from itself is
    0, even if the two loops start at different moments of it.
    """
    walks = (each.ahead().positions for each in (loop, other))
    poses, other_poses = (places - places[:, :1] * [1, 0, 1] for places in walks)
    return float(np.mean([np.linalg.norm(other_poses - pose, axis=-1).mean(axis=1).min() for pose in poses]))


def loop_warnings(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """Warnings about loops that look like the neutral walk or have values without effect.

    entries: from `write_stimuli`.
    """
    unchanged = [entry for entry in entries if entry["values"] and entry["from_plain_cm"] < VISIBLE]
    partly = [entry for entry in entries if entry["untrained"] and entry not in unchanged]
    out = []
    if unchanged:
        names = ", ".join(entry["name"] for entry in unchanged)
        out.append(
            f"{names}: they look like the neutral walk (less than {VISIBLE} cm from it). Leave them out of a "
            "questionnaire."
        )
    if partly:
        out.append(f"{', '.join(entry['name'] for entry in partly)}: some of their values have no effect.")
    if never := sorted({column for entry in [*unchanged, *partly] for column in entry["untrained"]}):
        out.append(f"Never above 0 in training: {', '.join(never)}. Train on clips with such values.")
    return out


def draw_frames(
    renderer: BodyRenderer, skeleton: Skeleton, loop: RepeatedWalk, values: Array | None, size: int
) -> list[NDArray[np.uint8]]:
    """The pictures of a loop, of every FRAME_STEP-th frame. The character walks along z.

    values: from 0 to 1, drawn as colours, see `BodyRenderer.draw`. size: pixels on each side.

    The camera moves at constant speed. In each repetition it crosses a whole number of cells of the ground's
    grid, so that the ground repeats, too.
    """
    walk, bones = loop.ahead(), body_mesh(skeleton).bones
    turns, places = restore_bone_lengths(skeleton, walk.positions, walk.rotations)
    count, length = len(places), float(np.linalg.norm(walk.travel))
    # The length of the camera's way in a loop, divided by that of the character's.
    camera_factor = max(1, round(length / GRID)) * GRID / max(length, 1e-9)
    out = []
    for f in range(0, count - count % FRAME_STEP, FRAME_STEP):
        moved = np.array([0.0, 0.0, length * f / count * camera_factor])
        camera = Camera(np.array([0.0, 82.0, 0.0]) + moved, size=size)  # about half the body's height
        at = places[f, bones] - walk.travel * f / count + moved
        out.append(renderer.draw(at, turns[f, bones], camera, values))
    return out


def save_loop(path: Path, pictures: list[NDArray[np.uint8]]) -> None:
    """Write an animated WebP that repeats forever."""
    images = [Image.fromarray(picture) for picture in pictures]
    # Whole milliseconds, rounded so that they add up to the true duration.
    durations = [
        round(1000 * FRAME_STEP * (k + 1) / 60) - round(1000 * FRAME_STEP * k / 60)
        for k in range(len(images))
    ]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=durations, loop=0, quality=QUALITY, method=3
    )
