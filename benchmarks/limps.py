"""How well limps are recognised: of left-out people, at several strengths, and in captured clips.

    python benchmarks/limps.py CMU_FOLDER [CLIP.bvh ...] [--network WEIGHTS.npz]
    python benchmarks/limps.py CMU_FOLDER [CLIP.bvh ...] --sizes [--network WEIGHTS.npz] [--patients FOLDER]

Also prints how often healthy walks are called impaired, whether hurt versions of healthy walks are nearer to
captured limps than the healthy walks are, and how large the limps of hurt versions and of a network are. With
--sizes only that. With --patients also in which features the limps of the network are beyond those of three
groups: the ten people, the actors of CMU 105_25 and of the CLIPs, and the patients.
"""

import argparse
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
import yaml
from derive_gait import REFERENCE, healthy_windows

from hobble.channels.injury.status import parse_links
from hobble.cli.gait import read_clip
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.core.skeleton import other_side
from hobble.gait.cycles import join_walks, measure_clip
from hobble.gait.profile import (
    GAITS,
    NORMAL,
    PROFILE_NAMES,
    Profile,
    features,
    healthy_profile,
    measure_effects,
    mirror_profile,
    profile_of_walk,
    read_people,
)
from hobble.gait.recognise import (
    HEALTHY_FILE,
    SHRINKAGE,
    SHRINKAGE_OF_PEOPLE,
    Grader,
    compare_clip,
    examples_of_people,
    grade_walk,
    healthy_covariance,
    learn,
    learn_grader,
    recognise,
    shares_of_answers,
)
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import Labels
from hobble.labels.label import label_clip
from hobble.measures.limp_run import limp_distance, walk_figures
from hobble.models.load import load_network
from hobble.models.network import Network
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
SEVERITIES = (3.0, 5.0, 7.0, 10.0)
COLUMNS = ("speed", "stance", "step_hurt", "step_sound", "knee_hurt", "knee_sound", "lean_forward")


def print_sizes(title: str, healthy: Profile, walks: Mapping[tuple[str, float], Profile]) -> None:
    """The effects of each part and severity: EFFECTS of `hobble.gait.profile`, and these.

    lift: rise of the sound ankle, share of healthy. turn: range of the pelvis' turn, degrees more. sd: root
    mean square of the 21 features, each divided by its standard deviation over healthy windows of one person.
    near: `limp_distance` to the nearest real limp of the ten people. The last line: how far parts are apart
    at 10, in the same unit as `sd`.
    """
    deviation, spread = np.sqrt(np.diag(healthy_covariance())), examples_of_people()[0].std(axis=0)
    real = np.array(
        [list(features(p[gait], p[NORMAL]).values()) for p in read_people() for gait in GAITS[1:]]
    )
    print(f"\n{title}: {', '.join((*COLUMNS, 'lift', 'turn', 'sd', 'near'))}")
    found: dict[tuple[str, float], Array] = {}
    for (part, severity), walk in walks.items():
        effects = measure_effects(walk, healthy)
        found[part, severity] = limp = np.array(list(features(walk, healthy).values()))
        numbers = [
            *(effects[name] for name in COLUMNS),
            walk["range ankle_height_L"] / healthy["range ankle_height_L"],
            walk["range pelvis_turn_left"] - healthy["range pelvis_turn_left"],
            np.sqrt(np.mean((limp / deviation) ** 2)),
            np.sqrt((((real - limp) / spread) ** 2).mean(axis=1)).min(),
        ]
        print(f"  {part:5} {severity:2.0f} " + " ".join(f"{number:6.2f}" for number in numbers))
    for a, b in (("hip", "thigh"), ("thigh", "shank"), ("thigh", "foot"), ("shank", "foot")):
        apart = np.sqrt(np.mean(((found[a, 10.0] - found[b, 10.0]) / deviation) ** 2))
        print(f"  {a} and {b}: {apart:.1f} apart")


def sizes_of_versions(folder: Path) -> None:
    skeleton = load_skeleton(SKELETONS / "holden31.yaml").skeleton
    walk = walk_from_plan("generated", skeleton, [Segment("walk", 130, seconds=20)], 1200, "flat", 60, 1).clip
    source = {"source_frames": len(walk), "source_fps": 60.0}
    generated = walk, label_clip(walk, [], source, "walk", "flat", LabelOptions())[0]
    for clip, labels in (generated, *(read(folder, name) for name in HEALTHY_WALKS)):
        walks = {}
        for part, link in PARTS.items():
            for severity in SEVERITIES:
                hurt = np.zeros((len(clip), len(skeleton.links)))
                hurt[:, skeleton.link_names.index(link)] = severity
                walks[part, severity] = profile_of_walk(measure_clip(hurt_clip(clip, labels, hurt).clip))
        print_sizes(f"hurt versions of {clip.name}", profile_of_walk(measure_clip(clip)), walks)


def sizes_of_network(file: Path, others: Mapping[str, list[dict[str, float]]]) -> None:
    network = load_network(file)
    cases = [(part, severity) for part in PARTS for severity in SEVERITIES]
    injuries = [{}, *({PARTS[part]: severity} for part, severity in cases)]
    healthy, *hurt = profiles(network, injuries, [0.6] * len(injuries))
    print_sizes(str(file), healthy, dict(zip(cases, hurt, strict=True)))
    sides = [{}, *({link: 10.0} for link in PARTS.values())]
    sides += [{"-".join(other_side(joint) for joint in link.split("-")): 10.0} for link in PARTS.values()]
    made: list[tuple[str, Profile, Profile]] = []
    guardings = (0.0, 0.4, 0.6, 0.8, 1.0)
    walks = profiles(network, sides * 5, np.repeat(guardings, len(sides)).tolist())
    for i, guarding in enumerate(guardings):
        healthy, *hurt = walks[i * len(sides) : (i + 1) * len(sides)]
        pairs = [(walk, healthy) for walk in hurt[:4]]
        leans = [f"{measure_effects(*pair)['lean_forward']:.1f}" for pair in pairs]
        print(f"  guarding {guarding:g}: lean forward {', '.join(leans)}")
        pairs += [(mirror_profile(walk), mirror_profile(healthy)) for walk in hurt[4:]]
        if 0 < guarding < 1:
            made += [(part, *pair) for part, pair in zip([*PARTS] * 2, pairs, strict=True)]
    told_from_people(made)
    if others:
        beyond_people(made, others)


def profiles(network: Network, injuries: list[dict[str, float]], guarding: list[float]) -> list[Profile]:
    """The walks of 20 s at 1.2 m/s of figures with these injuries."""
    bodies = [
        {"injury": injury, "guarding": {"guarding": each}}
        for injury, each in zip(injuries, guarding, strict=True)
    ]
    figures = walk_figures(network, bodies, "walk", 20.0, Runtime())
    found = [figure.profile for figure in figures]
    assert all(found)
    return found


MORE = ("speed", "stride", "step_hurt", "step_sound", "knee_hurt", "knee_sound", "hip_sound")


def numbers(walk: Profile, healthy: Profile) -> dict[str, float]:
    """The 21 features, and 7 effects, of a limp of the right leg."""
    effects = measure_effects(walk, healthy)
    return features(walk, healthy) | {name: effects[name] for name in MORE}


def real_limps(paths: Iterable[Path]) -> list[dict[str, float]]:
    """Of each clip with a gait cycle, compared with healthy people. The leg that stands shorter is hurt."""
    found = []
    for path in paths:
        if len(walk := measure_clip(read_clip(path))):
            limp = profile_of_walk(walk)
            right = limp["stance_share_R"] <= limp["stance_share_L"]
            found.append(numbers(limp if right else mirror_profile(limp), healthy_profile([])))
    return found


def beyond_people(
    made: list[tuple[str, Profile, Profile]], others: Mapping[str, list[dict[str, float]]]
) -> None:
    """Print the features whose mean is above or below the mean of the ten people and of all others.

    made: as in `told_from_people`. others: name of a group of people -> what `numbers` says of their limps.
    """
    people = [numbers(p[gait], p[NORMAL]) for p in read_people() for gait in GAITS[1:]]
    own = [numbers(walk, healthy) for _, walk, healthy in made]
    print(
        f"  beyond the means of all groups: ten people, {', '.join(others)} (people's deviations from them)"
    )
    for name in own[0]:
        mean, *groups = (np.mean([limp[name] for limp in some]) for some in (own, people, *others.values()))
        if not min(groups) <= mean <= max(groups):
            deviation = np.std([limp[name] for limp in people])
            z = min((mean - group for group in groups), key=abs) / deviation
            print(f"    {name}: {mean:.2f}, {', '.join(f'{group:.2f}' for group in groups)} ({z:+.2f})")


def told_from_people(made: list[tuple[str, Profile, Profile]]) -> None:
    """How well a classifier tells the character's limps at 10 from those of the ten people.

    made: part of the leg, walk and healthy walk; the right side is hurt. The classifier has the 21 features
    and 7 effects. Each person and each part of the leg are left out of its training in turn. Prints the area
    under the curve (.5: cannot tell), and the features in which the two differ most.
    """
    people = [(i, numbers(p[gait], p[NORMAL])) for i, p in enumerate(read_people()) for gait in GAITS[1:]]
    own = [(part, numbers(*pair)) for part, *pair in made]
    real, hurt = (np.array([list(each.values()) for _, each in some]) for some in (people, own))
    person, part = (np.array([key for key, _ in some]) for some in (people, own))
    areas = []
    for i, left in itertools.product(np.unique(person), PARTS):
        known = real[person != i], hurt[part != left]
        judge = learn(np.concatenate(known), ["real"] * len(known[0]) + ["made"] * len(known[1]), SHRINKAGE)
        of_real, of_made = (
            np.diff(judge.scores(some))[:, 0] for some in (real[person == i], hurt[part == left])
        )
        areas.append(np.mean(of_real[:, None] > of_made))
    print(f"  told from the ten people: area under the curve {np.mean(areas):.2f}")
    apart = (hurt.mean(axis=0) - real.mean(axis=0)) / np.sqrt((hurt.var(axis=0) + real.var(axis=0)) / 2)
    names = list(own[0][1])
    for k in np.argsort(-np.abs(apart))[:6]:
        print(f"    {names[k]}: {hurt[:, k].mean():.2f}, people {real[:, k].mean():.2f}")


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
    parser.add_argument("--patients", type=Path, metavar="FOLDER", help="folder of patients' walks, as .bvh")
    options = parser.parse_args()
    sizes_of_versions(options.folder)
    if options.network:
        others = {}
        if options.patients:
            actors = [options.folder / "105_25.bvh", *map(Path, options.clips)]
            patients = sorted(options.patients.glob("*.bvh"))
            others = {"actors": real_limps(actors), "patients": real_limps(patients)}
        sizes_of_network(options.network, others)
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
