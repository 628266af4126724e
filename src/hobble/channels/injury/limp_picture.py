"""Draws the looping picture at the top of the README. The character walks healthy and hurt, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hobble.channels.injury.crowd_severities import injury_links, links_hurt_in_training
from hobble.channels.injury.shown import link_index_by_part
from hobble.core.errors import HobbleError
from hobble.core.files import atomic_path
from hobble.figure.mesh import body_mesh
from hobble.figure.pack import links_of_bones
from hobble.models.network import Network
from hobble.report.raster import BodyRenderer
from hobble.report.stimuli import FRAME_STEP, draw_frames, make_loop
from hobble.runtime.options import Runtime

Picture = NDArray[np.uint8]

INJURIES = {"left thigh": 8.0, "left shank": 8.0}  # part of the hurt character's body -> severity
CAPTIONS = ("healthy", "left knee hurts: 8 of 10")  # of the left and the right half
SIZE = 360  # width and height of each half, pixels
MOST_BYTES = 1_000_000  # largest allowed size of the file
QUALITIES = (80, 65, 50, 35, 20)  # of the WebP encoder; the first that gives at most MOST_BYTES is used


def write_limp_picture(network: Network, path: str | Path, runtime: Runtime) -> int:
    """Write the picture as an endless animated WebP of at most MOST_BYTES. Returns its size in bytes.

    The healthy and the hurt character have the same target speed. Raises HobbleError if the network has no
    injury channel, or if the picture is too large even at the lowest quality.
    """
    link_names = injury_links(network)
    if network.skeleton is None or not link_names:
        raise HobbleError("this network has no injury channel. Use a configuration with `channels: [injury]`")
    # name of a part of the body -> index of its link
    link_of_part = link_index_by_part(network.skeleton, link_names, links_hurt_in_training(network))
    hurt = {link_names[link_of_part[part]]: severity for part, severity in INJURIES.items()}
    renderer = BodyRenderer(body_mesh(network.skeleton), links_of_bones(network.skeleton, link_names))
    halves = []
    for injury in ({}, hurt):
        # A link is drawn in a colour from 0 (healthy) to 1 (severity 10).
        colours = np.array([injury.get(link, 0.0) for link in link_names]) / 10
        loop = make_loop(network, {"injury": injury}, runtime)
        halves.append(draw_frames(renderer, network.skeleton, loop, colours, SIZE))
    return _save_webp(Path(path), put_side_by_side(*halves))


def put_side_by_side(healthy: Sequence[Picture], hurt: Sequence[Picture]) -> list[Image.Image]:
    """One loop of pictures, each with a picture of `healthy` on the left and one of `hurt` on the right.

    The loop is as long as `hurt`. While `hurt` plays once, `healthy` plays a whole number of times, faster or
    slower if need be. So the loop repeats without a jump.
    """
    repeats = max(1, round(len(hurt) / len(healthy)))
    out = []
    for index, right in enumerate(hurt):
        left = healthy[index * repeats * len(healthy) // len(hurt) % len(healthy)]
        both = Image.fromarray(np.concatenate([left, right], axis=1)[..., :3])
        draw, font = ImageDraw.Draw(both), ImageFont.load_default(size=18)
        for half, text in enumerate(CAPTIONS):
            middle = (half + 0.5) * both.width / 2
            draw.text((middle, 18), text, fill=(90, 90, 90), font=font, anchor="mm")
        out.append(both)
    return out


def _save_webp(path: Path, images: Sequence[Image.Image]) -> int:
    """Write the images with the first of QUALITIES that gives at most MOST_BYTES. Returns the file's size."""
    for quality in QUALITIES:
        with atomic_path(path) as temporary:
            images[0].save(
                temporary,
                format="WEBP",
                save_all=True,
                append_images=images[1:],
                duration=round(1000 * FRAME_STEP / 60),
                loop=0,
                quality=quality,
                method=4,
            )
        if (size := path.stat().st_size) <= MOST_BYTES:
            return size
    raise HobbleError(
        f"{path}: the picture has {size} bytes at the lowest quality. At most {MOST_BYTES} are allowed. "
        "Make SIZE in limp_picture.py smaller"
    )
