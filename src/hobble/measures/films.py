"""The questionnaire: thirteen films of a character that begins to hurt, and a page that asks about them.

The films and the five questions are those of Ferre et al. (2019). In each film, a healthy character walks.
Then one or two parts of its body begin to hurt; in the last four films, the hurt character then breaks into a
run.

The looping picture at the top of the README is drawn here, too: a healthy and a hurt character side by side.
"""

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from hobble.channels.injury.shown import link_of_part
from hobble.core.errors import HobbleError
from hobble.core.files import write_bytes, write_json, write_text
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.figure.pack import links_of_bones
from hobble.measures.study import PARTS, QUESTIONS
from hobble.measures.walks import record
from hobble.models.network import Network
from hobble.report.parts import embedded
from hobble.report.raster import FPS, BodyRenderer, Camera, Picture, webp
from hobble.report.stimuli import draw_loop
from hobble.report.templates import load_template, own_file
from hobble.runtime import Runtime
from hobble.runtime.generated import make_loop

INJURY = "injury"  # the channel
SPEEDS = {"walk": 2.5, "jog": 6.0}  # gait -> target speed, cm a frame
WARM_UP_SECONDS = 4.0  # of walking before a film begins
HEALTHY_SECONDS, HURT_SECONDS = 3.0, 7.0  # of a film, before and after the injury begins
# A second injury begins this many seconds after the first. The severity of each rises for RISE_SECONDS.
SECOND_SECONDS, RISE_SECONDS = 2.0, 2.0
# A film with a change of gait is this many seconds longer. The gait changes in the middle of the film.
EXTRA_SECONDS_FOR_CHANGE = 5.0
# The three kinds of films.
ONE_PART, SEVERAL_PARTS, CHANGE_OF_GAIT = "one part", "several parts", "change of gait"
SIZE = 360  # default width and height of the films, and of each half of the looping picture, pixels
# Of the WebP images, see `webp`. With an effort of 3 it takes twice the time, and files are only 6 % smaller.
QUALITY, EFFORT = 45, 2
CAMERA_SMOOTHING = 25.0  # frames: sigma of the Gaussian that smooths the camera's path
LOOK_AT = 82.0  # cm: height of the point that the camera looks at
DISTANCE = 400.0  # cm: from the camera to this point
# Of the looping picture.
HURT_PARTS = {"left thigh": 8.0, "left shank": 8.0}  # part of the hurt character's body -> severity
CAPTIONS = ("healthy", "left knee hurts: 8 of 10")  # of the left and the right half
PICTURE_QUALITY = 50  # of the looping picture


@dataclass(frozen=True)
class Film:
    """One film.

    number: counted from 1; the tables of answers have this order. kind: ONE_PART, SEVERAL_PARTS or
    CHANGE_OF_GAIT. severities: part that hurts -> its severity in the end, in the order in which they begin.
    gaits: target gaits at the beginning and at the end.
    """

    number: int
    kind: str
    severities: Mapping[str, float]
    gaits: tuple[str, str] = ("walk", "walk")

    @property
    def seconds(self) -> float:
        """Length of the film, in seconds."""
        extra = EXTRA_SECONDS_FOR_CHANGE if self.gaits[0] != self.gaits[1] else 0.0
        return HEALTHY_SECONDS + HURT_SECONDS + extra

    def at(self, frame: int) -> tuple[dict[str, float], str]:
        """Part -> severity at a frame, and the target gait. Frames of the warm-up are negative."""
        seconds = frame / FPS - HEALTHY_SECONDS
        risen = [(seconds - n * SECOND_SECONDS) / RISE_SECONDS for n in range(len(self.severities))]
        now = {
            part: severity * min(share, 1.0)
            for share, (part, severity) in zip(risen, self.severities.items(), strict=True)
            if share > 0
        }
        changed = seconds >= HURT_SECONDS - EXTRA_SECONDS_FOR_CHANGE / 2
        return now, self.gaits[1] if changed else self.gaits[0]


# The captions of Tables III to XV name the parts and the four films with a change of gait. Films 5 and 6, and
# 7 and 8, have the same parts. We read them as the two experiments of Section IV: a second injury rises to 10
# while the first stays at 5, then while it stays at 10. Of the parts of film 9, the upper leg is taken as the
# first, at 10.
FILMS = (
    Film(1, ONE_PART, {"left shank": 10}),
    Film(2, ONE_PART, {"right thigh": 10}),
    Film(3, ONE_PART, {"right shank": 10}),
    Film(4, ONE_PART, {"left forearm": 10}),
    Film(5, SEVERAL_PARTS, {"left shank": 5, "right thigh": 10}),
    Film(6, SEVERAL_PARTS, {"left shank": 10, "right thigh": 10}),
    Film(7, SEVERAL_PARTS, {"left shank": 5, "right shank": 10}),
    Film(8, SEVERAL_PARTS, {"left shank": 10, "right shank": 10}),
    Film(9, SEVERAL_PARTS, {"right thigh": 10, "right shank": 10}),
    Film(10, CHANGE_OF_GAIT, {"left shank": 10}, ("walk", "jog")),
    Film(11, CHANGE_OF_GAIT, {"right thigh": 10}, ("walk", "jog")),
    Film(12, CHANGE_OF_GAIT, {"right shank": 10}, ("walk", "jog")),
    Film(13, CHANGE_OF_GAIT, {"left forearm": 10}, ("walk", "jog")),
)


def part_links(network: Network, parts: Sequence[str]) -> list[str]:
    """For each part, the name of the link whose severity is set to make the part hurt.

    A link is the piece of the body between two neighbouring joints. A part may have several links. The
    uppermost link that was hurt in training is taken. If no link of the part was hurt in training, its
    uppermost link is taken. Raises HobbleError if the network has no injury channel, or if the skeleton has
    no such part.
    """
    links, trained = network.channels.get(INJURY, ()), network.trained_labels(INJURY)
    if network.skeleton is None or not links:
        raise HobbleError("this network has no injury channel. Use a configuration with `channels: [injury]`")
    chosen = []
    for part in parts:
        link = link_of_part(network.skeleton, part, links, trained)
        if link is None:
            raise HobbleError(
                f"the skeleton of this network has no {part} that can hurt, but a film needs it"
            )
        chosen.append(link)
    return chosen


def film_motion(
    network: Network, film: Film, links: Mapping[str, str], runtime: Runtime
) -> tuple[Array, Array]:
    """The motion of a character that goes straight ahead and does what a film shows.

    links: part that hurts in it -> link; a part without a link stays healthy. Returns positions (F, J, 3) in
    the world, cm, and rotations (F, J, 4).
    """
    warm_up, targets = round(WARM_UP_SECONDS * FPS), []
    for frame in range(-warm_up, round(film.seconds * FPS)):
        severities, gait = film.at(frame)
        injury = {links[part]: severity for part, severity in severities.items() if part in links}
        targets.append({"target_velocity": [0.0, SPEEDS[gait]], "gait": gait, INJURY: injury})
    positions, rotations = record(network, runtime, targets, lambda pose: (pose.positions, pose.rotations))
    return positions[warm_up:], rotations[warm_up:]


def distance_from_healthy(positions: Array, healthy: Array) -> float:
    """Mean distance, cm, of the joints from those of a healthy character, after the injury begins.

    Both are measured from the ground below the first joint, the root.
    """
    own, others = (p - p[:, :1] * [1.0, 0.0, 1.0] for p in (positions, healthy))
    distances = np.linalg.norm(own - others, axis=-1)
    return float(distances[round(HEALTHY_SECONDS * FPS) :].mean())


def write_questionnaire(
    network: Network,
    folder: str | Path,
    runtime: Runtime,
    configuration: str,
    films: Sequence[Film] = FILMS,
    parts: str = "published",
    size: int = SIZE,
    threads: int = 1,
) -> dict[str, Any]:
    """Write questionnaire.html (the page) and films.json (the right answers) into a folder.

    Nothing on the page says what hurts in a film. configuration: its name, for films.json. parts: the key in
    PARTS of those that people can tick. size: width and height of the films, pixels. threads: how many films
    are drawn at once; the files are the same for any number. Returns the content of films.json. Raises
    HobbleError if the network has no injury channel, or if the skeleton lacks a part that hurts in a film.
    """
    # Raises an error before anything is drawn or written.
    links = [dict(zip(f.severities, part_links(network, list(f.severities)), strict=True)) for f in films]
    assert network.skeleton is not None
    renderer = BodyRenderer(network.skeleton)

    def draw_film(film: Film, links: Mapping[str, str]) -> tuple[dict[str, Any], dict[str, Any]]:
        """The film's entry in films.json, and its entry in the data of the page.

        The camera follows the character smoothly. The character has one colour, so that people have to judge
        by its motion what hurts.
        """
        positions, rotations = film_motion(network, film, links, runtime)
        healthy, _ = film_motion(network, film, {}, runtime)
        path = gaussian(positions[:, 0], CAMERA_SMOOTHING)  # the points that the camera looks at
        path[:, 1] = LOOK_AT
        pictures = renderer.film(
            positions, rotations, lambda f: Camera(path[f], distance=DISTANCE, size=size)
        )
        data = base64.b64encode(webp(pictures, 1, QUALITY, EFFORT)).decode("ascii")
        trained = network.trained_labels(INJURY)
        solution = {
            "film": film.number,
            "kind": film.kind,
            "parts": list(film.severities),
            "severities": list(film.severities.values()),
            "gaits": list(dict.fromkeys(film.gaits)),
            "links": list(links.values()),
            "untrained": [link for link in links.values() if link not in trained],
            "seconds": film.seconds,
            "from_healthy_cm": round(distance_from_healthy(positions, healthy), 2),
        }
        return solution, {"film": film.number, "webp": data}

    with ThreadPoolExecutor(threads) as pool:
        solutions, films_on_page = map(list, zip(*pool.map(draw_film, films, links), strict=True))
    # Answers are saved with this id, which shows to which version of the films they belong.
    study = hashlib.sha256(json.dumps([solutions, films_on_page]).encode()).hexdigest()[:12]
    solution = {"study": study, "configuration": configuration, "parts": PARTS[parts], "films": solutions}
    on_page = {"questions": QUESTIONS, "parts": PARTS[parts], "films": films_on_page, "size": size}
    page = load_template("questionnaire.html.j2").render(
        style=own_file("page.css"),
        script=own_file("questionnaire.js"),
        embedded=embedded({"study": study, **on_page}),
        count=len(films),
        questions=len(QUESTIONS) + 1,
        sided=parts == "sided",
    )
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "questionnaire.html", page)
    write_json(folder / "films.json", solution)
    return solution


def write_limp_picture(network: Network, path: str | Path, runtime: Runtime) -> int:
    """Write the looping picture as a WebP. Returns its size in bytes.

    The healthy and the hurt character have the same target speed. Raises HobbleError if the network has no
    injury channel.
    """
    hurt = dict(zip(part_links(network, list(HURT_PARTS)), HURT_PARTS.values(), strict=True))
    assert network.skeleton is not None
    links, halves = network.channels[INJURY], []
    renderer = BodyRenderer(network.skeleton, links_of_bones(network.skeleton, links))
    for injury in ({}, hurt):
        # A link is drawn in a colour from 0 (healthy) to 1 (severity 10).
        colours = np.array([injury.get(link, 0.0) for link in links]) / 10
        halves.append(draw_loop(renderer, make_loop(network, {INJURY: injury}, runtime), colours, SIZE))
    content = webp(put_side_by_side(*halves), 0, PICTURE_QUALITY, 4)
    write_bytes(path, content)
    return len(content)


def put_side_by_side(healthy: Sequence[Picture], hurt: Sequence[Picture]) -> list[Picture]:
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
        out.append(np.asarray(both))
    return out
