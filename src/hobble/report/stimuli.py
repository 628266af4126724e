"""Short loops of the character walking hurt, for a questionnaire or a README: images and BVH files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body
from hobble.figure.pack import regions
from hobble.models.network import Network
from hobble.report.playable import PRESETS, body_parts
from hobble.report.raster import GRID, Camera, Studio
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton, jointed
from hobble.runtime.options import Runtime

SEVERITY = 8.0
# The study of Quentin Ferre (2019) showed thirteen walks, and asked which part is hurt; nothing is coloured.
STUDY: dict[str, tuple[str, ...]] = {
    "healthy": (),
    "left-thigh": ("left thigh",),
    "left-shank": ("left shank",),
    "left-foot": ("left foot",),
    "right-thigh": ("right thigh",),
    "right-shank": ("right shank",),
    "right-foot": ("right foot",),
    "lower-back": ("lower back",),
    "left-arm": ("left upper arm",),
    "right-arm": ("right upper arm",),
    "left-leg": ("left thigh", "left shank", "left foot"),
    "right-leg": ("right thigh", "right shank", "right foot"),
    "thigh-and-back": ("left thigh", "lower back"),
}
SPEED = 2.5  # cm a frame, asked for
SETTLED = 6 * 60  # frames until the gait is the hurt one
SHORTEST, LONGEST = 150, 300  # frames of a loop
BLEND = 12  # frames over which the end of a loop passes into its beginning
STRIDE = 2  # frames of the motion to one of the image
QUALITY = 80
FELT = 0.1  # cm; a loop nearer to the healthy one shows nothing of what hurts


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
    """Write <name>.webp and <name>.bvh of each stimulus and preset into a folder, and stimuli.json.

    The thirteen of the study are grey; `preset-<name>` shows the severities as colours. Links that were
    never hurt in training, and how far each walk is from the healthy one, are listed: see `doubts`. Raises
    HobbleError for a network without severities.
    """
    if network.skeleton is None or not network.links:
        raise HobbleError("this network has no severities among its inputs; make the stimuli of `injured`")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    skeleton = network.skeleton
    figure, rows = body(skeleton), []
    studio = Studio(figure, regions(skeleton, network.links))
    healthy, trained = walk(network, {}, runtime), hurt_in_training(network)
    for name, hurt, shown in wanted(network):
        loop = walk(network, hurt, runtime) if hurt else healthy
        own = skeleton
        if "skeleton" not in network.meta:
            own = fitted_skeleton(skeleton, loop.positions, loop.rotations)
        export_bvh(folder / f"{name}.bvh", name, own, loop.positions, loop.rotations)
        severity = np.array([hurt.get(link, 0.0) for link in network.links]) if shown else None
        save_loop(folder / f"{name}.webp", frames(studio, skeleton, loop, severity, size))
        seconds = len(loop.positions) / 60
        rows.append(
            {
                "name": name,
                "severities": hurt,
                "coloured": shown,
                "hurt_in_training": all(link in trained for link in hurt),
                "never_hurt": [link for link in hurt if link not in trained],
                "from_healthy_cm": round(apart(loop, healthy), 2),
                "seconds": seconds,
                "metres_a_second": round(float(np.linalg.norm(loop.way)) / 100 / seconds, 3),
                "gap_cm": round(loop.gap, 2),
            }
        )
    write_json(folder / "stimuli.json", {"severity": SEVERITY, "stimuli": rows})
    return rows


def hurt_in_training(network: Network) -> set[str]:
    """Links whose severity was above 0 somewhere in training, as the mean of the input tells."""
    means = network.x_mean[network.layout.x_channel("injury")]
    return {link for link, mean in zip(network.links, means, strict=True) if mean > 0}


def apart(loop: Loop, other: Loop) -> float:
    """Mean distance (cm, over joints and poses) of the poses of a loop from the nearest ones of another.

    Both stand over the origin and go the same way. 0 where they are the same walk, wherever it was cut.
    """
    ours, theirs = _ahead(loop), _ahead(other)
    return float(np.mean([np.linalg.norm(theirs - pose, axis=-1).mean(axis=1).min() for pose in ours]))


def doubts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What whoever shows the stimuli has to know of them: those that hurt nobody sees. rows: of the above."""
    same = [row for row in rows if row["severities"] and row["from_healthy_cm"] < FELT]
    part = [row for row in rows if row["never_hurt"] and row not in same]
    out = []
    if same:
        names = ", ".join(row["name"] for row in same)
        out.append(
            f"{names}: no different from the healthy walk (less than {FELT} cm); not for a questionnaire."
        )
    if part:
        out.append(f"{', '.join(row['name'] for row in part)}: not all that is hurt there shows.")
    if never := sorted({link for row in [*same, *part] for link in row["never_hurt"]}):
        out.append(f"Never hurt in training: {', '.join(never)}. Train on clips in which they are.")
    return out


def wanted(network: Network) -> list[tuple[str, dict[str, float], bool]]:
    """Name, severities by link, and whether they are shown as colours, of each image."""
    assert network.skeleton is not None
    parts = body_parts(network.skeleton, network.links, network.hurt_links)
    out = []
    for name, labels in STUDY.items():
        out.append((name, {network.links[parts[label]]: SEVERITY for label in labels}, False))
    for title, values in PRESETS.items():
        hurt = {network.links[parts[label]]: float(value) for label, value in values.items()}
        out.append((f"preset-{title.lower().replace(' ', '-')}", hurt, True))
    return out


def walk(network: Network, injury: Mapping[str, float], runtime: Runtime) -> Loop:
    """The character walking straight on, cut where a later moment is most like an earlier one."""
    animation = ProceduralAnimation(network, **dict(runtime))
    ahead = np.array([0.0, SPEED])
    poses = [
        animation.next_pose(ahead, None, "walk", injury=dict(injury) or None)
        for _ in range(SETTLED + 60 + LONGEST + BLEND)
    ]
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
    studio: Studio, skeleton: Skeleton, loop: Loop, severity: Array | None, size: int
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
        out.append(studio.draw(points + travelled, turns[f], camera, severity))
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
