"""Makes the questionnaire: an HTML page that contains its films, and a file with the right answers.

People watch each film and say which parts of the character's body hurt.
"""

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

from hobble.channels.injury.crowd_severities import links_hurt_in_training
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
from hobble.figure.mesh import body_mesh
from hobble.models.network import Network
from hobble.report.parts import embedded
from hobble.report.raster import BodyRenderer, Camera
from hobble.report.stimuli import VISIBLE
from hobble.report.templates import load_template, page_style, questionnaire_script
from hobble.runtime.export import restore_bone_lengths
from hobble.runtime.options import Runtime

FRAME_STEP = 2  # every second frame of the motion is shown
SIZE = 360  # default width and height of the films, pixels
QUALITY = 45  # of the WebP images, 0 to 100
EFFORT = 2  # of the WebP encoder, 0 to 6; with 3 it needs twice the time, and files are only 6 % smaller
CAMERA_SMOOTHING = 25.0  # frames: sigma of the Gaussian that smooths the camera's path
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
    """Write questionnaire.html (the page) and films.json (the right answers) into a folder.

    Nothing on the page says what hurts in a film. configuration: its name, for films.json. size: width and
    height of the films, pixels. threads: how many films are drawn at once; the files are the same for any
    number. Returns the content of films.json. Raises HobbleError if the network has no injury channel, or if
    the skeleton lacks a part that hurts in a film.
    """
    folder = Path(folder)
    for film in films:
        part_links(network, film.parts)  # raises an error before anything is drawn or written
    assert network.skeleton is not None
    folder.mkdir(parents=True, exist_ok=True)
    renderer, skeleton = BodyRenderer(body_mesh(network.skeleton)), network.skeleton

    def draw_film(film: Film) -> tuple[dict[str, Any], dict[str, Any]]:
        """The film's entry in films.json, and its entry in the data of the page."""
        motion = film_motion(network, film, runtime)
        data = encode_webp(draw_pictures(renderer, skeleton, motion, size))
        return _solution_of(network, film, motion), {
            "film": film.number,
            "webp": base64.b64encode(data).decode("ascii"),
        }

    with ThreadPoolExecutor(threads) as pool:
        solutions, films_on_page = map(list, zip(*pool.map(draw_film, films), strict=True))
    # Answers are saved with this id, which shows to which version of the films they belong.
    study = hashlib.sha256(json.dumps([solutions, films_on_page]).encode()).hexdigest()[:12]
    solution = {
        "study": study,
        "configuration": configuration,
        "severity": SEVERITY,
        "parts": PARTS,
        "films": solutions,
    }
    page = load_template("questionnaire.html.j2").render(
        style=page_style(),
        script=questionnaire_script(),
        embedded=embedded({"study": study, "parts": PARTS, "films": films_on_page, "size": size}),
        count=len(films),
    )
    write_text(folder / "questionnaire.html", page)
    write_json(folder / "films.json", solution)
    return solution


def _solution_of(network: Network, film: Film, motion: FilmMotion) -> dict[str, Any]:
    """The entry of a film in films.json. untrained: links of the film never hurt in training."""
    links = part_links(network, film.parts)
    return {
        "film": film.number,
        "kind": film.kind,
        "parts": list(film.parts),
        "gaits": list(dict.fromkeys(film.gaits)),
        "links": links,
        "untrained": [link for link in links if link not in links_hurt_in_training(network)],
        "seconds": film.seconds,
        "from_healthy_cm": round(motion.cm_from_healthy, 2),
    }


def list_doubts(solution: dict[str, Any]) -> list[str]:
    """Warnings: films in which nobody can see the injury, and hurt links that were never hurt in training.

    solution: the content of films.json.
    """
    same = [str(row["film"]) for row in solution["films"] if row["from_healthy_cm"] < VISIBLE]
    never = sorted({link for row in solution["films"] for link in row["untrained"]})
    out = [f"film {', '.join(same)}: nobody can see the injury (less than {VISIBLE} cm)."] if same else []
    return out + ([f"Never hurt in training: {', '.join(never)}."] if never else [])


def draw_pictures(
    renderer: BodyRenderer, skeleton: Skeleton, motion: FilmMotion, size: int
) -> list[NDArray[np.uint8]]:
    """The pictures of a film, each (size, size, 3). The camera follows the character smoothly.

    The character has one colour, so that people have to judge by its motion what hurts.
    """
    bones = body_mesh(skeleton).bones  # indices of the joints that move the body's mesh
    rotations, positions = restore_bone_lengths(skeleton, motion.positions, motion.rotations)
    path = gaussian(motion.positions[:, 0], CAMERA_SMOOTHING)  # the points that the camera looks at
    path[:, 1] = LOOK_AT
    return [
        renderer.draw(positions[f, bones], rotations[f, bones], Camera(path[f], distance=DISTANCE, size=size))
        for f in range(0, len(positions), FRAME_STEP)
    ]


def encode_webp(pictures: Sequence[NDArray[np.uint8]]) -> bytes:
    """The bytes of an animated WebP that plays the pictures once."""
    images = [Image.fromarray(picture) for picture in pictures]
    out = io.BytesIO()
    options: dict[str, Any] = {
        "quality": QUALITY,
        "method": EFFORT,
        "duration": round(1000 * FRAME_STEP / FPS),  # milliseconds a picture
    }
    images[0].save(out, "WEBP", save_all=True, append_images=images[1:], loop=1, **options)
    return out.getvalue()
