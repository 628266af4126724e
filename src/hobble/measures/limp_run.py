"""Measures the size of each link's limp, and compares it with the limps of people and of captured clips.

A link is a pair of neighbouring joints. A severity from 0 to 10 says how much a link hurts.

The rank correlations of the measurement `injury` say nothing about size, because a correlation is 1 even if
the walk changes by only 2 %. Here the size of each effect of an injury on the walk is measured at severities
3, 5, 7 and 10, relative to the healthy walk of the same network. The two recognisers of `hobble.gait`, a
linear and a graded one, judge the walks. They learnt only from real people.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait import profile
from hobble.gait.cycles import CURVES, WalkCycles, join_walks, measure_cycles
from hobble.gait.judge import Limp
from hobble.gait.recognise import SIDES, compare_walk, examples_of_people
from hobble.hurt.effects import part_of_link
from hobble.measures import walks
from hobble.measures.limp_goals import GUARDINGS, LEG, USUAL, judge_limps
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.measures.sample import HURT_VERSION, ClipPart, clip_parts, sample_to_measure, with_sample
from hobble.measures.walks import FPS, PHASES, Case, mean_of_known, rounded, share_of_true
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, captured_stretches, headings
from hobble.rows.layout import GAITS
from hobble.runtime import Runtime

INJURY, GUARDING = "injury", "guarding"  # channels
NO_CYCLE = "the network's healthy character does not walk a whole cycle"
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the link that hurts; only one link hurts in a walk
SPEEDS = {"walk": 2.0, "jog": 7.0}  # target speeds, cm a frame; 2 is 1.2 m/s, a usual walking speed
WARM_UP_FRAMES = 5 * FPS  # frames that are not measured, while figures reach their speed and begin to limp
RECOGNISED = ("named", "wrong_side")  # keys of a row: shares of its windows
IN_GALLERY = 6  # captured limps that the report shows beside the character
# Imitated impairment -> parts of the right side; one of them hurts in the character beside these people.
FITTING = {
    "antalgic": ("thigh", "shank"),
    "stiff_legged": ("thigh",),
    "steppage": ("foot",),
    "trendelenburg": ("hip",),
    "lurch": ("hip", "pelvis"),
}
# The curves that stand beside people's. A Kinect sees ankles and toes badly.
COMPARED_CURVES = (
    "knee_flexion_R", "knee_flexion_L", "hip_flexion_R", "hip_flexion_L", "trunk_forward", "trunk_left",
)  # fmt: skip
MIRROR = "_mirror"  # end of the name of a mirrored clip
Rows = list[dict[str, Any]]
Injury = Mapping[str, float]  # link -> severity, only of links that hurt


@dataclass(frozen=True)
class Walk:
    """The walk of a person in a captured clip, or of a figure of the crowd.

    injury: the same in all frames. cycles: its gait cycles. poses: (PHASES, J, 3) their mean poses, cm. clip:
    "" for a figure. speed, frames: mean speed, cm a frame, and length of a figure's walk.
    """

    injury: Injury
    cycles: WalkCycles = field(repr=False)
    poses: Array = field(repr=False)
    clip: str = ""
    speed: float = 0.0
    frames: int = 0

    @cached_property
    def profile(self) -> profile.Profile | None:
        """None if there is no whole cycle, which cannot happen in a captured walk."""
        return profile.profile_of_walk(self.cycles) if len(self.cycles) else None

    @property
    def curves(self) -> dict[str, Array]:
        """Name of CURVES -> (50,) its median over the cycles that begin as the right foot lands."""
        return dict(zip(CURVES, np.median([c.curves for c in self.cycles.right], axis=0), strict=True))

    @property
    def performer(self) -> str:
        """Who walks: the part of the clip's name before the first underscore, such as "105" in "105_25".

        Mirrored clips count as clips of another performer, because their left and right are swapped.
        """
        return (self.clip.partition("_")[0] or self.clip) + MIRROR * self.clip.endswith(MIRROR)


def walk_figures(
    network: Network, cases: Sequence[Case], gait: str, seconds: float, runtime: Runtime
) -> list[Walk]:
    """Let a figure for each of `cases` walk straight ahead for `seconds` at the speed of the gait."""
    assert network.skeleton is not None
    frames = max(FPS, round(seconds * FPS))
    gaits, speeds = [gait] * len(cases), [SPEEDS[gait]] * len(cases)
    script = [walks.CrowdTarget(length, gaits, cases, speeds) for length in (WARM_UP_FRAMES, frames)]
    crowd = walks.generate_walks(network, script, runtime)
    hips, out = network.skeleton.role("hips"), []
    for i, case in enumerate(cases):
        span = slice(WARM_UP_FRAMES, None)
        world = walks.in_world(*(values[span, i] for values in (crowd.local, crowd.root, crowd.yaw)))
        # Distance on the ground between the first and the last position, divided by the frames between them.
        speed = float(np.linalg.norm((world[-1, hips] - world[0, hips])[::2])) / (frames - 1)
        cycles = measure_cycles(network.skeleton, world, FPS)
        out.append(Walk(case.get(INJURY, {}), cycles, crowd.cycle(1, i), "", speed, frames))
    return out


def captured_walks(parts: Iterable[ClipPart], links: Sequence[str], skeleton: Skeleton) -> list[Walk]:
    """The walks of all captured clips. parts: the parts of the clips to read, sorted by clip."""
    found = []
    for clip, parts_of_clip in groupby(parts, key=lambda part: part.clip):
        if HURT_VERSION.search(clip) is None:
            rows_of_clip = [rows for part in parts_of_clip if len(rows := part.load().rows)]
            if rows_of_clip and (walk := _walk_of_clip(clip, rows_of_clip, links, skeleton)):
                found.append(walk)
    return found


def _walk_of_clip(
    clip: str, rows_of_clip: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> Walk | None:
    """The walk of a clip; None if the severities change in it, or if nobody walks a whole cycle.

    rows_of_clip: all rows of the clip as one item, or an item for each of the clip's excerpts.
    """
    severity = np.concatenate([rows.channels[INJURY] for rows in rows_of_clip])
    if np.ptp(severity, axis=0).any():
        return None
    parts, stretches = [], []
    for rows in rows_of_clip:
        turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
        for stretch in captured_stretches(rows):
            if stretch.gait.mean(axis=0).argmax() == GAITS.index("walk"):
                world = walks.in_world(stretch.local, stretch.root, headings(turn[stretch.rows]))
                parts.append(measure_cycles(skeleton, world, FPS))
                stretches.append(stretch)
    if not parts or not len(cycles := join_walks(parts)):
        return None
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    local, phase = (np.concatenate([getattr(s, name) for s in stretches]) for name in ("local", "phase"))
    return Walk(hurt, cycles, walks.mean_cycle(local, phase), clip)


def healthy_reference(walk: Walk, captured: Sequence[Walk]) -> tuple[profile.Profile, str]:
    """The healthy walk to compare a captured walk with, and whose walk it is.

    "performer": it is measured over the performer's healthy clips. "data set": if the performer has no
    healthy clip, it is measured over all healthy clips. "people": if there is no healthy clip at all, it is
    the mean normal walk of people in `hobble.gait.profile`. captured: all captured walks.
    """
    healthy = [other for other in captured if not other.injury]
    of_performer = [other for other in healthy if other.performer == walk.performer]
    for chosen, whose in ((of_performer, "performer"), (healthy, "data set")):
        if chosen:
            return profile.profile_of_walk(join_walks(other.cycles for other in chosen)), whose
    return profile.healthy_profile([]), "people"


def measure_limps(
    network: Network,
    captured: Sequence[Walk],
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The content of limp.json; docs/artefacts.md explains its keys.

    If the healthy character does not walk, `applies` is false and `reason` says so. captured:
    from `captured_walks`. seconds: length of each generated walk. links: names of the links to hurt, by
    default all.
    """
    skeleton = network.skeleton
    assert skeleton is not None
    links = list(links or network.channels[INJURY])
    limps = [walk for walk in captured if walk.injury]
    held_out, shown = [walk for walk in limps if _is_held_out(walk, splits)], in_gallery(limps, splits)
    cases: list[Case] = [{}, *({INJURY: {link: severity}} for link in links for severity in SEVERITIES)]
    as_captured: list[Case] = [{INJURY: walk.injury} for walk in (*held_out, *shown)]
    walking = walk_figures(network, [*cases, *as_captured], "walk", seconds, runtime)
    healthy, figures = walking[0], iter(walking[len(cases) :])
    if healthy.profile is None:
        return {"configuration": configuration, "applies": False, "reason": NO_CYCLE}
    crowds = {"walk": walking[: len(cases)], "jog": walk_figures(network, cases, "jog", seconds, runtime)}
    sizes = [
        {"gait": gait, **row_of_walk(skeleton, figure, crowd[0])}
        for gait, crowd in crowds.items()
        if crowd[0].profile is not None
        for figure in crowd[1:]
    ]
    legs = [row for row in sizes if row["gait"] == "walk" and row["part"] in LEG]
    limps_of_legs = leg_limps(network, crowds["walk"], seconds, runtime)
    return {
        "configuration": configuration,
        "applies": True,
        "asked_cm_per_second": {gait: 60 * speed for gait, speed in SPEEDS.items()},
        "seconds": seconds,
        "effects": profile.EFFECTS,
        "trained": [link for link in links if link in network.trained_labels(INJURY)],
        "sizes": sizes,
        "named": _recognition(legs),
        **judge_limps(limps_of_legs, sizes),
        "people": {
            gait: {name: [round(v, 5) for v in mean_and_sd] for name, mean_and_sd in of_gait.items()}
            for gait, of_gait in profile.effects_of_people().items()
        },
        "held_out_limps": [
            compare_held_out(walk, next(figures), healthy, healthy_reference(walk, captured))
            for walk in held_out
        ],
        "gallery": [
            {
                "clip": walk.clip,
                "hurt": dict(walk.injury),
                "phases": [round(b / PHASES, 5) for b in range(0, PHASES, PHASES // 8)],
                "poses": {
                    name: np.round(one.poses[:: PHASES // 8], 1).tolist()
                    for name, one in (("captured", walk), ("character", next(figures)), ("healthy", healthy))
                },
            }
            for walk in shown
        ],
        "imitated": [] if shown else list(imitated_walks(skeleton, crowds["walk"])),
    }


def imitated_walks(skeleton: Skeleton, crowd: Sequence[Walk]) -> Iterator[dict[str, Any]]:
    """The ten people's normal walk and their impairments, each beside the character with the nearest limp.

    crowd: the healthy figure, then figures in which one link hurts, of which those of FITTING are compared.
    Yields the rows of `imitated` in limp.json.
    """
    healthy, *hurt = crowd
    assert healthy.profile is not None
    strongest = [figure for figure in hurt if SEVERITIES[-1] in figure.injury.values()]
    for gait, people in profile.mean_curves().items():
        limp = profile.mean_profile(gait), profile.mean_profile(profile.NORMAL)
        fitting = [(part, profile.RIGHT) for part in FITTING.get(gait, ())]
        away = [
            (limp_distance(figure.profile, healthy.profile, *limp), figure)
            for figure in strongest
            if figure.profile and _part_and_side(skeleton, *figure.injury) in fitting
        ]
        from_hurt, nearest = min(away, key=lambda pair: pair[0], default=(None, None))
        shown = healthy if gait == profile.NORMAL else nearest
        curves = {"people": people} | ({"character": shown.curves} if shown else {})
        row = {
            "gait": gait,
            "hurt": dict(shown.injury) if shown else {},
            "from_hurt": from_hurt,
            "from_healthy": limp_distance(healthy.profile, healthy.profile, *limp),
            "curves": {
                whose: {name: np.round(some[name], 1).tolist() for name in COMPARED_CURVES}
                for whose, some in curves.items()
            },
        }
        yield rounded(row)


def leg_limps(
    network: Network, crowd: Sequence[Walk], seconds: float, runtime: Runtime
) -> dict[str, list[Limp]]:
    """Side -> the limps of its hip, thigh, shank and foot, as `judge_limps` needs them.

    crowd: the healthy figure, then figures in which one link hurts. Of several links of one part, such as
    toes, the first counts. The figures with another guarding walk here, if the network has this channel.
    """
    assert network.skeleton is not None
    links: dict[tuple[str, str | None], str] = {}
    for link in (link for figure in crowd for link in figure.injury):
        part, side = _part_and_side(network.skeleton, link)
        if part in LEG:
            links.setdefault((part, side), link)
    crowds = {USUAL: crowd}
    for guarding in GUARDINGS if GUARDING in network.channels else ():
        injuries = ({}, *({link: SEVERITIES[-1]} for link in links.values()))
        cases = [{INJURY: injury, GUARDING: {GUARDING: guarding}} for injury in injuries]
        crowds[guarding] = walk_figures(network, cases, "walk", seconds, runtime)
    out: dict[str, list[Limp]] = {side: [] for side in SIDES}
    for guarding, (healthy, *hurt) in crowds.items():
        for figure in hurt:
            ((link, severity),) = figure.injury.items()
            part, side = _part_and_side(network.skeleton, link)
            if links.get((part, side)) == link and side and figure.profile and healthy.profile:
                pair = figure.profile, healthy.profile
                if side == profile.LEFT:
                    pair = profile.mirror_profile(pair[0]), profile.mirror_profile(pair[1])
                out[side].append(Limp(part, severity, guarding, *pair))
    return out


def _part_and_side(skeleton: Skeleton, link: str) -> tuple[str, str | None]:
    """The part of the body that a link belongs to, and its side: "left", "right", or None on the midline."""
    part = part_of_link(skeleton, skeleton.links[skeleton.link_names.index(link)])
    return part.name, None if part.side is None else ("left", "right")[part.side]


def row_of_walk(skeleton: Skeleton, figure: Walk, healthy: Walk) -> dict[str, Any]:
    """The row of a walk in which one link hurts: its severity, the effects, and how the walk is recognised.

    graded: label and side that the graded recogniser gives to the whole walk. named: share of windows in
    which it finds a limp, and not on the side opposite to the link's. wrong_side: share of windows in which
    it finds one there; None for a link on the midline, which counts as right for the effects. speed_share:
    speed, divided by the speed of the healthy walk. If the figure does not walk a whole cycle, all but
    `speed_share` is None.
    """
    assert healthy.profile is not None
    ((link, severity),) = figure.injury.items()
    part, side = _part_and_side(skeleton, link)
    row: dict[str, Any] = {"link": link, "part": part, "severity": severity, "side": side}
    row["speed_share"] = round(figure.speed / max(healthy.speed, 1e-9), 5)
    if figure.profile is None:
        return row | dict.fromkeys((*profile.EFFECTS, "graded", *RECOGNISED))
    found = compare_walk(figure.cycles, figure.frames, healthy.profile)
    wrong_side = SIDES[1 - SIDES.index(side or profile.RIGHT)]
    answers = [(grade.is_impaired, grade.side == wrong_side) for grade in found.window_grades]
    return {
        **row,
        **rounded(found.effects[side or profile.RIGHT]),
        "graded": found.grade.name,
        "named": share_of_true([limps and not wrong for limps, wrong in answers]),
        "wrong_side": share_of_true([limps and wrong for limps, wrong in answers]) if side else None,
    }


def _recognition(rows: Sequence[Mapping[str, Any]]) -> Rows:
    """For each severity, means over the walks of `rows`.

    walks: number of walks that are judged. A very slow walk is not judged if no window has enough cycles.
    """
    out: Rows = []
    for severity in SEVERITIES:
        group = [row for row in rows if row["severity"] == severity]
        walks = sum(row["named"] is not None for row in group)
        means = {key: mean_of_known(row[key] for row in group) for key in (*RECOGNISED, "speed_share")}
        out.append({"severity": severity, "walks": walks, **means})
    return out


def limp_distance(
    walk: profile.Profile, healthy: profile.Profile, other: profile.Profile, other_healthy: profile.Profile
) -> float:
    """How much the limps of two bodies differ. A limp is how a body's walk differs from its healthy walk.

    walk, healthy: profiles of the first body. other, other_healthy: profiles of the second body. The distance
    is the root mean square of the differences of all features of the limps. Each difference is divided by the
    standard deviation of its feature over people's walks.
    """
    spread = examples_of_people()[0].std(axis=0)
    a, b = (
        np.array(list(profile.features(*pair).values())) for pair in ((walk, healthy), (other, other_healthy))
    )
    return float(np.sqrt(np.mean(((a - b) / spread) ** 2)))


def compare_held_out(
    walk: Walk, figure: Walk, healthy: Walk, reference: tuple[profile.Profile, str]
) -> dict[str, Any]:
    """Whether the limp of a held-out clip is nearer to the hurt character than to the healthy one.

    figure: the character with the clip's severities. healthy: the healthy character. Both have a target speed
    of 1.2 m/s, a likely speed of the performer's healthy walk. reference: from `healthy_reference`. `hurt`,
    `healthy`: the `limp_distance` of the clip from the hurt and from the healthy character; None if the hurt
    one does not walk a whole cycle. `nearer`: whether the hurt character is nearer, as it should be.
    """
    own, whose = reference
    row = {"clip": walk.clip, "hurt_links": dict(walk.injury), "compared_with": whose}
    if figure.profile is None:
        return {**row, "healthy": None, "hurt": None, "nearer": False}
    assert healthy.profile is not None
    from_healthy, from_hurt = (
        limp_distance(profile.profile_of_walk(walk.cycles), own, other, healthy.profile)
        for other in (healthy.profile, figure.profile)
    )
    distances = rounded({"healthy": from_healthy, "hurt": from_hurt})
    return {**row, **distances, "nearer": from_hurt < from_healthy}


def _is_held_out(walk: Walk, splits: Mapping[str, str]) -> bool:
    return splits.get(walk.clip) == "held_out"


def in_gallery(limps: Iterable[Walk], splits: Mapping[str, str]) -> list[Walk]:
    """The captured limps that are shown: at most IN_GALLERY, held-out clips and strong limps first."""
    shown = [walk for walk in limps if not walk.clip.endswith(MIRROR)]
    shown.sort(key=lambda w: (not _is_held_out(w, splits), -max(w.injury.values()), w.clip))
    return shown[:IN_GALLERY]


def run(inputs: MeasureInputs, options: Any) -> Outcome:
    """Measure the limps. The outcome has the content of limp.json and its tables."""
    network = load_network(inputs.weights)
    assert network.skeleton is not None
    sample = sample_to_measure(inputs, options)
    parts = clip_parts(inputs.clips, sample)
    result = measure_limps(
        network,
        captured_walks(parts, network.channels[INJURY], network.skeleton),
        inputs.splits,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        seconds=options.limp_seconds,
    )
    tables = {name: result.get(name, []) for name in ("sizes", "named", "goals")}
    log_line = str(result.get("reason", ""))
    if result["applies"]:
        share = result["named"][-1]["named"]
        log_line = f"a limp is named in {share} of the windows with a leg at severity 10"
    return Outcome(with_sample(result, sample), tables, log_line)
