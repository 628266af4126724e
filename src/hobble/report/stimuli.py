"""Makes short loops of the walking character, as animated images and BVH files.

They are stimuli for a questionnaire, or pictures for a README.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import SampleWalk, channel_display
from hobble.core.errors import HobbleError
from hobble.core.files import write_bytes, write_json
from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.report.raster import GRID, BodyRenderer, Camera, Picture, webp
from hobble.runtime import Runtime
from hobble.runtime.generated import RepeatedWalk, export_bvh, make_loop, skeleton_in_motion

QUALITY, EFFORT = 80, 3  # of the WebP images, see `webp`
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
        columns, trained = network.channels[channel_name], network.trained_labels(channel_name)
        regions = channel_display(channel_name, skeleton, columns, trained).regions
        loop = neutral
        if sample.values:
            loop = make_loop(network, {channel_name: dict(sample.values)}, runtime)
        motion = loop.positions, loop.rotations
        export_bvh(folder / f"{name}.bvh", name, skeleton_in_motion(network, *motion), *motion)
        colours = None
        if sample.coloured:
            values = np.array([sample.values.get(column, 0.0) for column in columns])
            colours = values / channel(channel_name).highest
        pictures = draw_loop(BodyRenderer(skeleton, regions), loop, colours, size)
        write_bytes(folder / f"{name}.webp", webp(pictures, 0, QUALITY, EFFORT))
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

    The names of the first channel are used as they are. Names of later channels begin with "<channel>-", or
    are just "guarding" where channel and column have the same name. Their neutral walk is left out, because
    the first channel has it.
    """
    assert network.skeleton is not None
    out: list[tuple[str, str, SampleWalk]] = []
    for name, columns in network.channels.items():
        for loop in channel_display(name, network.skeleton, columns, network.trained_labels(name)).loops:
            if not out or out[0][1] == name:  # the first channel that has loops
                out.append((loop.name, name, loop))
            elif loop.values:
                out.append((name if loop.name == name else f"{name}-{loop.name}", name, loop))
    return out


def loop_distance(loop: RepeatedWalk, other: RepeatedWalk) -> float:
    """Mean distance (cm, over joints and poses) from each pose of `loop` to the nearest pose of `other`.

    Both loops are moved to the origin and turned to the same direction. The distance of a walk from itself is
    0, even if the two loops start at different moments of it.
    """
    walks = (each.ahead().positions for each in (loop, other))
    poses, other_poses = (places - places[:, :1] * [1, 0, 1] for places in walks)
    return float(np.mean([np.linalg.norm(other_poses - pose, axis=-1).mean(axis=1).min() for pose in poses]))


def film_warnings(films: Iterable[tuple[str, float, Sequence[str]]]) -> Iterator[str]:
    """Warnings about films that look like the neutral walk or have values without effect.

    films: of each, its name, its distance from the neutral walk in cm, and the columns above 0 in it that
    were never above 0 in training.
    """
    films = list(films)
    same = ", ".join(name for name, distance, _ in films if distance < VISIBLE)
    never = ", ".join(sorted({column for *_, untrained in films for column in untrained}))
    if same:
        yield f"{same}: they look like the neutral walk (less than {VISIBLE} cm from it). Leave them out."
    if never:
        yield f"Never above 0 in training: {never}. Train on clips with such values."


def draw_loop(renderer: BodyRenderer, loop: RepeatedWalk, values: Array | None, size: int) -> list[Picture]:
    """The pictures of a loop. The character walks along z. values, size: see `BodyRenderer.draw`, `Camera`.

    The camera moves at constant speed. In each repetition it crosses a whole number of cells of the ground's
    grid, so that the ground repeats, too.
    """
    walk = loop.ahead()
    count, length = len(walk.positions), float(np.linalg.norm(walk.travel))
    # The camera's way in a frame, and how far it falls behind the character.
    step = np.array([0.0, 0.0, max(1, round(length / GRID)) * GRID / count])
    behind = np.arange(count)[:, None, None] * (step - walk.travel / count)
    return renderer.film(
        walk.positions + behind,
        walk.rotations,
        lambda f: Camera(np.array([0.0, 82.0, 0.0]) + f * step, size=size),  # about half the body's height
        values,
    )
