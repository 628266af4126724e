"""Makes the page of the questionnaire, which contains its films, and the file with the right answers."""

from __future__ import annotations

import base64
import hashlib
import io
import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hobble.channels.injury.crowd_severities import hurt_links
from hobble.channels.injury.study.films import (
    FILMS,
    FPS,
    PARTS,
    SEVERITY,
    Film,
    FilmMotion,
    film_motion,
    part_links,
)
from hobble.core.files import write_json, write_text
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian
from hobble.figure.mesh import body
from hobble.models.network import Network
from hobble.report.formats import embedded
from hobble.report.raster import BodyRenderer, Camera
from hobble.report.stimuli import VISIBLE
from hobble.report.templates import questionnaire_script, style, template
from hobble.runtime.export import jointed
from hobble.runtime.options import Runtime

FRAME_STEP = 2  # every second frame of the motion is shown
SIZE = 360  # default width and height of the films, pixels
QUALITY = 45  # of the WebP encoder, 0 to 100
EFFORT = 2  # of the WebP encoder, 0 to 6; 3 takes twice the time for files that are 6 % smaller
CAMERA_SMOOTHING = 25.0  # frames, sigma of the Gaussian over the camera's path
LOOK_AT = 82.0  # cm: height of the point that the camera looks at
DISTANCE = 400.0  # cm: from the camera to this point


def write_questionnaire(
    network: Network,
    folder: str | Path,
    runtime: Runtime,
    configuration: str,
    films: Sequence[Film] = FILMS,
    size: int = SIZE,
    threads: int = 1,
) -> dict[str, Any]:
    """Write questionnaire.html and films.json. Returns the content of films.json, the right answers.

    Nothing on the page says what hurts in a film. size: width and height of the films, pixels. threads: how
    many films are drawn at once; the files do not depend on it. Raises HobbleError if the network has no
    injury channel, or if the skeleton lacks a part that hurts in a film.
    """
    folder = Path(folder)
    for film in films:
        part_links(network, film.parts)
    assert network.skeleton is not None
    folder.mkdir(parents=True, exist_ok=True)
    studio, skeleton = BodyRenderer(body(network.skeleton)), network.skeleton

    def drawn(film: Film) -> tuple[dict[str, Any], dict[str, Any]]:
        motion = film_motion(network, film, runtime)
        data = encoded(pictures(studio, skeleton, motion, size))
        return _row(network, film, motion), {
            "film": film.number,
            "webp": base64.b64encode(data).decode("ascii"),
        }

    with ThreadPoolExecutor(threads) as pool:
        rows, shown = map(list, zip(*pool.map(drawn, films), strict=True))
    study = hashlib.sha256(json.dumps([rows, shown]).encode()).hexdigest()[:12]
    solution = {
        "study": study,
        "configuration": configuration,
        "severity": SEVERITY,
        "parts": PARTS,
        "films": rows,
    }
    page = template("questionnaire.html.j2").render(
        style=style(),
        script=questionnaire_script(),
        embedded=embedded({"study": study, "parts": PARTS, "films": shown, "size": size}),
        count=len(films),
    )
    write_text(folder / "questionnaire.html", page)
    write_json(folder / "films.json", solution)
    return solution


def _row(network: Network, film: Film, motion: FilmMotion) -> dict[str, Any]:
    links = part_links(network, film.parts)
    return {
        "film": film.number,
        "kind": film.kind,
        "parts": list(film.parts),
        "gaits": list(dict.fromkeys(film.gaits)),
        "links": links,
        "untrained": [link for link in links if link not in hurt_links(network)],
        "seconds": film.seconds,
        "from_healthy_cm": round(motion.from_healthy, 2),
    }


def doubts(solution: dict[str, Any]) -> list[str]:
    """Warnings about films in which nobody can see the injury, and about links never hurt in training.

    solution: the content of films.json.
    """
    same = [str(row["film"]) for row in solution["films"] if row["from_healthy_cm"] < VISIBLE]
    never = sorted({link for row in solution["films"] for link in row["untrained"]})
    out = [f"film {', '.join(same)}: nobody can see the injury (less than {VISIBLE} cm)."] if same else []
    return out + ([f"Never hurt in training: {', '.join(never)}."] if never else [])


def pictures(
    studio: BodyRenderer, skeleton: Skeleton, motion: FilmMotion, size: int
) -> list[NDArray[np.uint8]]:
    """The pictures (size, size, 3) of a film, without colours for injuries. The camera follows smoothly."""
    shown = body(skeleton).bones  # the bones that move the body's mesh
    world, places = jointed(skeleton, motion.positions, motion.rotations)
    path = gaussian(motion.positions[:, 0], CAMERA_SMOOTHING)
    path[:, 1] = LOOK_AT
    return [
        studio.draw(places[f, shown], world[f, shown], Camera(path[f], distance=DISTANCE, size=size))
        for f in range(0, len(places), FRAME_STEP)
    ]


def encoded(frames: Sequence[NDArray[np.uint8]]) -> bytes:
    """An animated WebP that plays once."""
    images = [Image.fromarray(frame) for frame in frames]
    out = io.BytesIO()
    options: dict[str, Any] = {
        "quality": QUALITY,
        "method": EFFORT,
        "duration": round(1000 * FRAME_STEP / FPS),
    }
    images[0].save(out, "WEBP", save_all=True, append_images=images[1:], loop=1, **options)
    return out.getvalue()
