"""How well limps are recognised: of left-out people, at several strengths, and in captured clips.

    python benchmarks/limps.py CMU_FOLDER [CLIP.bvh ...] [--network WEIGHTS.npz]
    python benchmarks/limps.py CMU_FOLDER --sizes [--network WEIGHTS.npz]

Also prints how often healthy walks are called impaired, whether hurt versions of healthy walks are nearer to
captured limps than the healthy walks are, and how large the limps of hurt versions and of a network are. With
--sizes only that, with the goals of limp.json.
"""

import argparse
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from derive_gait import REFERENCE, healthy_windows

from hobble.channels.injury.status import parse_links
from hobble.cli.gait import read_clip
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.skeleton import other_side
from hobble.gait.cycles import join_walks, measure_clip
from hobble.gait.judge import Limp, numbers, numbers_of_people
from hobble.gait.profile import (
    GAITS,
    LEFT,
    NORMAL,
    PROFILE_NAMES,
    RIGHT,
    Profile,
    healthy_profile,
    measure_effects,
    mirror_profile,
    profile_of_walk,
    read_people,
)
from hobble.gait.recognise import (
    HEALTHY_FILE,
    SHRINKAGE_OF_PEOPLE,
    SIDES,
    Grader,
    compare_clip,
    examples_of_people,
    grade_walk,
    learn,
    learn_grader,
    recognise,
    shares_of_answers,
)
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip
from hobble.measures.limp_goals import GUARDINGS, USUAL, between_guardings, judge_limps
from hobble.measures.limp_run import SEVERITIES, leg_limps, limp_distance, row_of_walk, walk_figures
from hobble.models.load import load_network
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.skeleton_file import load_skeleton
from hobble.runtime import Runtime
from hobble.synthetic.generate_clip import walk_from_plan
from hobble.synthetic.plan import Segment

STRENGTHS = (0.15, 0.3, 0.5, 0.7, 1.0)
EXAM = ("105_16", "105_25", "105_26", "105_15")
SKELETONS = Path("config/skeletons")
DATA_SET = Path("config/datasets/cmu.yaml")  # has the severities of the captured limps
HEALTHY_WALKS = ("105_29", "105_36")  # hurt to be compared with captured limps


def left_out() -> Iterator[tuple[int, list[int]]]:
    """Each person, and all other people."""
    everyone = range(len(read_people()))
    return ((person, [other for other in everyone if other != person]) for person in everyone)


def half_way(a: Profile, b: Profile, share: float) -> dict[str, float]:
    return {name: a[name] + share * (b[name] - a[name]) for name in PROFILE_NAMES}


def limps(person: int, strength: float) -> Iterator[tuple[str, str, Profile, Profile]]:
    """(gait, side, walk, healthy walk) of one person, each leg in turn."""
    healthy = read_people()[person][NORMAL]
    for gait in GAITS[1:]:
        walk = half_way(healthy, read_people()[person][gait], strength)
        yield gait, "right", walk, healthy
        yield gait, "left", mirror_profile(walk), mirror_profile(healthy)


def people_left_out(name: str, judges: dict[int, Callable]) -> None:
    print(f"\n{name}, people left out; by strength, 1 as shown:")
    print(f"{'':15}" + "".join(f"{s:>25}" for s in STRENGTHS))
    print(f"{'':15}" + "impaired right  side".rjust(25) * len(STRENGTHS))
    confusion: Counter[tuple[str, str]] = Counter()
    totals = {s: np.zeros(3) for s in STRENGTHS}
    lines = {gait: f"{gait:15}" for gait in GAITS[1:]}
    for strength in STRENGTHS:
        outcomes: dict[str, list[tuple[bool, bool, bool]]] = {gait: [] for gait in GAITS[1:]}
        for person, judge in judges.items():
            for gait, side, walk, healthy in limps(person, strength):
                said = judge(walk, healthy)
                right = said.label == gait and said.side == side
                outcomes[gait].append((said.is_impaired, right, said.side in (None, side)))
                if strength == 1.0:
                    confusion[gait, said.label] += 1
        for gait, rows in outcomes.items():
            share = np.mean(rows, axis=0)
            lines[gait] += "{:>13.2f}{:>6.2f}{:>6.2f}".format(*share)
            totals[strength] += share / len(outcomes)
    print("\n".join(lines.values()))
    print(f"{'mean':15}" + "".join("{:>13.2f}{:>6.2f}{:>6.2f}".format(*totals[s]) for s in STRENGTHS))
    print(
        "confusion at 1 (rows: shown):",
        {gait: {b: n for (a, b), n in confusion.items() if a == gait} for gait in GAITS[1:]},
    )


def healthy_walks(folder: Path) -> None:
    print("\nhealthy walks of the CMU database, windows: share called impaired")
    print("performer, windows, by the linear one, the graded one, the graded one without the performer")
    known = load_npz(HEALTHY_FILE)
    for i, performer in enumerate(REFERENCE):
        own = [pair for _, *pair in healthy_windows(folder, performer)]
        rest = np.arange(len(REFERENCE)) != i
        others = np.average(known["covariances"][rest], axis=0, weights=known["clips"][rest])
        stranger = learn_grader(healthy=others)
        said = [
            np.mean([judge(*pair).is_impaired for pair in own])
            for judge in (recognise, grade_walk, stranger.grade)
        ]
        print(f"  {performer:4}{len(own):4}" + "".join(f"{share:6.2f}" for share in said))


def strangers() -> None:
    normal = [person[NORMAL] for person in read_people()]
    pairs = [(a, b) for a in normal for b in normal if a is not b]
    for name, judge in (("linear", recognise), ("graded", grade_walk)):
        wrong = np.mean([judge(*pair).is_impaired for pair in pairs])
        print(f"\none person's normal walk beside another's: {name} calls {wrong:.2f} impaired")


def rounded(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.2f}" for name, share in shares.items()) or "none"


def captured(folder: Path, clips: list[str]) -> None:
    healthy = healthy_profile([read_clip(folder / f"{name}.bvh") for name in REFERENCE["105"]])
    print("\ncaptured impaired walks, beside the healthy walks of CMU 105")
    for path in [*(folder / f"{name}.bvh" for name in EXAM), *map(Path, clips)]:
        try:
            compared = compare_clip(read_clip(path), healthy)
        except HobbleError as error:
            print(f"  {path.stem}: {error}")
            continue
        a, g = compared.answer, compared.grade
        print(f"  {path.stem}")
        by_linear, by_graded = (
            rounded(shares_of_answers(each)) for each in (compared.window_answers, compared.window_grades)
        )
        print(f"    linear {a.name}; windows: {by_linear}")
        print(f"    graded {g.name} {g.strength:.1f}; windows: {by_graded}")


def read(folder: Path, name: str) -> tuple[Clip, Labels]:
    """A clip of the folder on the skeleton holden31, and its labels."""
    file, skeleton = folder / f"{name}.bvh", SKELETONS / "holden31.yaml"
    clip, _ = make_clip(
        file, skeleton, SKELETONS, clip=name, skeleton_name="holden31", options=ClipMotion(ground="flat")
    )
    source = {"source_frames": len(clip), "source_fps": clip.fps}
    return clip, label_clip(clip, [], source, "walk", "flat", LabelOptions())[0]


def made(folder: Path) -> None:
    def walks(clips: list[Clip]) -> Profile:
        return profile_of_walk(join_walks(map(measure_clip, clips)))

    sources = [read(folder, name) for name in HEALTHY_WALKS]
    healthy = walks([clip for clip, _ in sources])
    print(f"\nspreads from a captured limp: healthy {', '.join(HEALTHY_WALKS)}; their hurt versions")
    for name, entry in yaml.safe_load(DATA_SET.read_text())["clips"].items():
        if not (status := entry.get("channels", {}).get("injury")):
            continue
        links = sources[0][0].skeleton.link_names
        hurt = dict(parse_links(status, links, name))
        severity = np.array([hurt.get(link, 0.0) for link in links])
        versions = [
            hurt_clip(clip, labels, np.tile(severity, (len(clip), 1))).clip for clip, labels in sources
        ]
        captured_limp = walks([read(folder, name)[0]])
        far = limp_distance(captured_limp, healthy, healthy, healthy)
        near = limp_distance(captured_limp, healthy, walks(versions), healthy)
        print(f"  {name} {far:.2f} {near:.2f}")


# Part -> link on the right that hurts.
PARTS = {
    "hip": "RHipJoint-RightUpLeg",
    "thigh": "RightUpLeg-RightLeg",
    "shank": "RightLeg-RightFoot",
    "foot": "RightFoot-RightToeBase",
}
COLUMNS = ("speed", "stance", "step_hurt", "step_sound", "knee_hurt", "knee_sound", "lean_forward")


def print_sizes(title: str, limps: Iterable[Limp]) -> None:
    """The effects of each part and severity: EFFECTS of `hobble.gait.profile`, and these.

    lift: rise of the sound ankle, share of healthy. turn: range of the pelvis' turn, degrees more. sd:
    `Limp.strength`. near: `Limp.nearest`.
    """
    print(f"\n{title}: {', '.join((*COLUMNS, 'lift', 'turn', 'sd', 'near'))}")
    for limp in (limp for limp in limps if limp.guarding == USUAL):
        effects = measure_effects(limp.walk, limp.healthy)
        numbers = [
            *(effects[name] for name in COLUMNS),
            limp.walk["range ankle_height_L"] / limp.healthy["range ankle_height_L"],
            limp.walk["range pelvis_turn_left"] - limp.healthy["range pelvis_turn_left"],
            limp.strength,
            limp.nearest,
        ]
        print(f"  {limp.part:5} {limp.severity:2.0f} " + " ".join(f"{number:6.2f}" for number in numbers))


def print_goals(limps: Mapping[str, Sequence[Limp]], sizes: Sequence[Mapping[str, Any]] = ()) -> None:
    """The table of goals of limp.json, the features beyond people's, and what tells from people most."""
    found = judge_limps(limps, sizes)
    for row in found["goals"]:
        least, most = row["least"], row["most"]
        values = ["  ".join(f"{value:.2f}" for value in row[side]) for side in SIDES]
        print(f"  {row['row']:20} {least!s:>5} to {most!s:5} {' | '.join(values)}  met: {row['met']}")
    left_out = found["left_out"]
    print(f"  beyond the means of people, actors and patients; counts from {left_out['by']:.2f} deviations")
    print(f"  (so many count of the ten people, each beside all others: {left_out['features']})")
    for row in found["beyond"]:
        groups, mark = ", ".join(f"{group:.2f}" for group in row["groups"]), " counts" * row["counts"]
        print(f"    {row['side']:5} {row['feature']}: {row['value']:.2f}, {groups} ({row['by']:+.2f}){mark}")
    own = np.array([[*numbers(o.walk, o.healthy).values()] for o in between_guardings(limps[RIGHT])])
    people = np.concatenate(numbers_of_people())
    away = (own.mean(axis=0) - people.mean(axis=0)) / np.sqrt((own.var(axis=0) + people.var(axis=0)) / 2)
    names = list(numbers(limps[RIGHT][0].walk, limps[RIGHT][0].healthy))
    for k in np.argsort(-np.abs(away))[:8]:
        means = f"{own[:, k].mean():.2f}, people {people[:, k].mean():.2f}"
        print(f"    differs: {names[k]} {means} ({away[k]:+.1f})")


def generated_walk() -> tuple[Clip, Labels]:
    """A healthy walk of the generated walker, 20 s at 1.3 m/s, and its labels."""
    skeleton = load_skeleton(SKELETONS / "holden31.yaml").skeleton
    walk = walk_from_plan("generated", skeleton, [Segment("walk", 130, seconds=20)], 1200, "flat", 60, 1).clip
    source = {"source_frames": len(walk), "source_fps": 60.0}
    return walk, label_clip(walk, [], source, "walk", "flat", LabelOptions())[0]


def hurt_walk(clip: Clip, labels: Labels, part: str, severity: float, guarding: float) -> Profile:
    """The profile of a clip's hurt version in which a part of the right leg hurts."""
    hurt = np.zeros((len(clip), len(clip.skeleton.links)))
    hurt[:, clip.skeleton.link_names.index(PARTS[part])] = severity
    return profile_of_walk(measure_clip(hurt_clip(clip, labels, hurt, guarding=guarding).clip))


def sizes_of_versions(folder: Path) -> None:
    for clip, labels in (generated_walk(), *(read(folder, name) for name in HEALTHY_WALKS)):
        healthy, limps = profile_of_walk(measure_clip(clip)), []
        cases = [(severity, USUAL) for severity in SEVERITIES] + [(10.0, guarding) for guarding in GUARDINGS]
        for part, (severity, guarding) in itertools.product(PARTS, cases):
            walk = hurt_walk(clip, labels, part, severity, guarding)
            limps.append(Limp(part, severity, guarding, walk, healthy))
        print_sizes(f"hurt versions of {clip.name}", limps)
        print_goals({RIGHT: limps, LEFT: []})


def sizes_of_network(file: Path) -> None:
    """The network's walks of 20 s at 1.2 m/s."""
    network = load_network(file)
    assert network.skeleton is not None
    links = [link for part in PARTS.values() for link in (part, "-".join(map(other_side, part.split("-"))))]
    injuries = [{}, *({link: severity} for link in links for severity in SEVERITIES)]
    crowd = walk_figures(network, [{"injury": injury} for injury in injuries], "walk", 20.0, Runtime())
    sizes = [{"gait": "walk", **row_of_walk(network.skeleton, figure, crowd[0])} for figure in crowd[1:]]
    limps = leg_limps(network, crowd, 20.0, Runtime())
    print_sizes(str(file), limps[RIGHT])
    print_goals(limps, sizes)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="CMU_FOLDER", help="folder of the CMU clips, as .bvh")
    parser.add_argument("clips", nargs="*", metavar="CLIP.bvh", help="more captured impaired walks")
    parser.add_argument(
        "--network", type=Path, metavar="WEIGHTS.npz", help="a network whose limps are measured"
    )
    parser.add_argument("--sizes", action="store_true", help="only the sizes of limps")
    options = parser.parse_args()
    sizes_of_versions(options.folder)
    if options.network:
        sizes_of_network(options.network)
    if options.sizes:
        return
    linear = {p: learn(*examples_of_people(rest), shrinkage=SHRINKAGE_OF_PEOPLE) for p, rest in left_out()}
    people_left_out("linear", {p: lambda w, h, j=j: recognise(w, h, j) for p, j in linear.items()})
    graders: dict[int, Grader] = {p: learn_grader(rest) for p, rest in left_out()}
    people_left_out("graded", {p: g.grade for p, g in graders.items()})
    strangers()
    healthy_walks(options.folder)
    captured(options.folder, options.clips)
    made(options.folder)


if __name__ == "__main__":
    main()
