"""Measures the size of each link's limp, and compares it with the limps of people and of captured clips.

A link is a pair of neighbouring joints. A severity from 0 to 10 says how much a link hurts.

The rank correlations of the measurement `injury` say nothing about size, because a correlation is 1 even if
the walk changes by only 2 %. Here the size of each effect of an injury on the walk is measured at severities
3, 5, 7 and 10, relative to the healthy walk of the same network. The two recognisers of `hobble.gait`, a
linear and a graded one, judge the walks. They learnt only from real people.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait import profile
from hobble.gait.cycles import WalkCycles, join_walks, measure_cycles
from hobble.gait.recognise import SIDES, compare_walk, examples_of_people
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.measures.sample import HURT_VERSION, ClipPart, clip_parts, sample_to_measure, with_sample
from hobble.measures.walks import (
    FPS,
    PHASES,
    in_world,
    mean_cycle,
    mean_of_known,
    rounded,
    share_of_true,
    walk_straight,
)
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, captured_stretches, headings
from hobble.rows.layout import GAITS
from hobble.runtime.options import Runtime

INJURY = "injury"  # the channel
NO_CYCLE = "the network's healthy character does not walk a whole cycle"
SEVERITIES = (3.0, 5.0, 7.0, 10.0)  # of the link that hurts; only one link hurts in a walk
SPEEDS = {"walk": 2.0, "jog": 7.0}  # target speeds, cm a frame; 2 is 1.2 m/s, a usual walking speed
LEG = ("hip", "thigh", "shank", "foot")  # parts of the body that belong to a leg
WARM_UP_FRAMES = 5 * FPS  # frames that are not measured, while figures reach their speed and begin to limp
RECOGNISED = ("impaired", "named", "wrong_side")  # keys of a row: shares of its windows
IN_GALLERY = 6  # captured limps that the report shows beside the character
MIRROR = "_mirror"  # end of the name of a mirrored clip
Rows = list[dict[str, Any]]
Injury = Mapping[str, float]  # link -> severity, only of links that hurt
Case = Mapping[str, Mapping[str, float]]  # channel -> column -> value of a figure


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
    walks = walk_straight(
        network, cases, gait, [SPEEDS[gait]] * len(cases), (WARM_UP_FRAMES, frames), runtime
    )
    hips, out = network.skeleton.role("hips"), []
    for i, case in enumerate(cases):
        span = slice(WARM_UP_FRAMES, None)
        world = in_world(*(values[span, i] for values in (walks.local, walks.root, walks.yaw)))
        # Distance on the ground between the first and the last position, divided by the frames between them.
        speed = float(np.linalg.norm((world[-1, hips] - world[0, hips])[::2])) / (frames - 1)
        cycles = measure_cycles(network.skeleton, world, FPS)
        out.append(Walk(case.get(INJURY, {}), cycles, walks.cycle(1, i), "", speed, frames))
    return out


def captured_walks(
    parts: Iterable[ClipPart], splits: Mapping[str, str], links: Sequence[str], skeleton: Skeleton
) -> tuple[list[Walk], dict[str, dict[str, float]]]:
    """The walks of all captured clips, and for how many seconds each link hurts in the training clips.

    The seconds are "captured" or "made" (in hurt versions) -> link -> seconds. If the parts are only a sample
    of the clips, they are estimates. parts: the parts of the clips to read, sorted by clip. splits: clip ->
    "train" or "held_out".
    """
    walks: list[Walk] = []
    seconds = {origin: np.zeros(len(links)) for origin in ("captured", "made")}
    for clip, parts_of_clip in groupby(parts, key=lambda part: part.clip):
        made = HURT_VERSION.search(clip) is not None
        rows_of_clip: list[ClipRows] = []
        for part in parts_of_clip:
            rows = part.load().rows
            if splits.get(clip) == "train":
                hurts = np.sum(rows.channels[INJURY] > 0, axis=0)
                seconds["made" if made else "captured"] += hurts * part.weight / FPS
            if not made and len(rows):
                rows_of_clip.append(rows)
        if rows_of_clip and (found := _walk_of_clip(clip, rows_of_clip, links, skeleton)):
            walks.append(found)
    return walks, {
        origin: {link: round(float(s), 2) for link, s in zip(links, of_links, strict=True) if s}
        for origin, of_links in seconds.items()
    }


def _walk_of_clip(
    clip: str, rows_of_clip: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> Walk | None:
    """The walk of a clip; None if the severities change in it, or if nobody walks a whole cycle.

    rows_of_clip: all rows of the clip as one item, or an item for each of the clip's excerpts.
    """
    severity = np.concatenate([rows.channels[INJURY] for rows in rows_of_clip])
    if np.ptp(severity, axis=0).any():
        return None
    walks, stretches = [], []
    for rows in rows_of_clip:
        turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
        for stretch in captured_stretches(rows):
            if stretch.gait.mean(axis=0).argmax() == GAITS.index("walk"):
                world = in_world(stretch.local, stretch.root, headings(turn[stretch.rows]))
                walks.append(measure_cycles(skeleton, world, FPS))
                stretches.append(stretch)
    if not walks or not len(cycles := join_walks(walks)):
        return None
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    local, phase = (np.concatenate([getattr(s, name) for s in stretches]) for name in ("local", "phase"))
    return Walk(hurt, cycles, mean_cycle(local, phase), clip)


def healthy_reference(walk: Walk, walks: Sequence[Walk]) -> tuple[profile.Profile, str]:
    """The healthy walk to compare a captured walk with, and whose walk it is.

    "performer": it is measured over the performer's healthy clips. "data set": if the performer has no
    healthy clip, it is measured over all healthy clips. "people": if there is no healthy clip at all, it is
    the mean normal walk of people in `hobble.gait.profile`. walks: all captured walks.
    """
    healthy = [other for other in walks if not other.injury]
    of_performer = [other for other in healthy if other.performer == walk.performer]
    for chosen, whose in ((of_performer, "performer"), (healthy, "data set")):
        if chosen:
            return profile.profile_of_walk(join_walks(other.cycles for other in chosen)), whose
    return profile.healthy_profile([]), "people"


def measure_limps(
    network: Network,
    captured: Sequence[Walk],
    hurt_seconds: Mapping[str, Mapping[str, float]],
    splits: Mapping[str, str],
    *,
    configuration: str,
    runtime: Runtime,
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """The content of limp.json; docs/artefacts.md explains its keys.

    If the healthy character does not walk, `applies` is false and `reason` says so. captured, hurt_seconds:
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
    together = limps_together(network, links, seconds, runtime)
    return {
        "configuration": configuration,
        "applies": True,
        "asked_cm_per_second": {gait: 60 * speed for gait, speed in SPEEDS.items()},
        "seconds": seconds,
        "effects": profile.EFFECTS,
        "trained": [link for link in links if link in network.trained_labels(INJURY)],
        "hurt_seconds": hurt_seconds,
        "sizes": sizes,
        "named": _recognition(legs, "severity"),
        "people": {
            gait: {name: [round(v, 5) for v in mean_and_sd] for name, mean_and_sd in of_gait.items()}
            for gait, of_gait in profile.effects_of_people().items()
        },
        "captured": [_row_of_clip(skeleton, walk, captured) for walk in limps],
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
        "together": together,
        "named_together": _recognition(together, "channel", "column"),
    }


def _part_and_side(skeleton: Skeleton, link: str) -> tuple[str, str | None]:
    """The part of the body that a link belongs to, and its side: "left", "right", or None on the midline."""
    part = part_of_link(skeleton, skeleton.links[skeleton.link_names.index(link)])
    return part.name, None if part.side is None else ("left", "right")[part.side]


def hurt_side(skeleton: Skeleton, injury: Injury) -> str:
    """The side of the link that hurts most.

    Links on the midline count as right, because the effects need a hurt side.
    """
    return _part_and_side(skeleton, max(injury, key=lambda link: injury[link]))[1] or profile.RIGHT


def row_of_walk(skeleton: Skeleton, figure: Walk, healthy: Walk) -> dict[str, Any]:
    """The row of a walk in which one link hurts: its severity, the effects, and how the walk is recognised.

    called: label and side that the linear recogniser gives to the whole walk. graded: label and side that the
    graded recogniser gives to it. impaired: share of windows in which the linear recogniser finds a limp. The
    wrong side is the side opposite to `hurt_side`. named: share of windows in which the graded recogniser
    finds a limp, and not on the wrong side. wrong_side: share of windows in which it finds one on the wrong
    side; None for a link on the midline. speed_share: speed, divided by the speed of the healthy walk.
    If the figure does not walk a whole cycle, all but `speed_share` is None.
    """
    assert healthy.profile is not None
    ((link, severity),) = figure.injury.items()
    part, side = _part_and_side(skeleton, link)
    row: dict[str, Any] = {"link": link, "part": part, "severity": severity, "side": side}
    row["speed_share"] = round(figure.speed / max(healthy.speed, 1e-9), 5)
    if figure.profile is None:
        return row | dict.fromkeys((*profile.EFFECTS, "called", "graded", *RECOGNISED))
    found = compare_walk(figure.cycles, figure.frames, healthy.profile)
    wrong_side = SIDES[1 - SIDES.index(side or profile.RIGHT)]
    answers = [(grade.is_impaired, grade.side == wrong_side) for grade in found.window_grades]
    return {
        **row,
        **rounded(found.effects[side or profile.RIGHT]),
        "called": found.answer.name,
        "graded": found.grade.name,
        "impaired": share_of_true([answer.is_impaired for answer in found.window_answers]),
        "named": share_of_true([limps and not wrong for limps, wrong in answers]),
        "wrong_side": share_of_true([limps and wrong for limps, wrong in answers]) if side else None,
    }


def _recognition(rows: Iterable[Mapping[str, Any]], *by: str) -> Rows:
    """A row for each group of walks that have the same values of the keys `by`, with means over the walks.

    walks: number of walks that are judged. A very slow walk is not judged if no window has enough cycles.
    """
    groups: dict[tuple[Any, ...], Rows] = {}
    for row in rows:
        groups.setdefault(tuple(row[key] for key in by), []).append(dict(row))
    return [
        {
            **dict(zip(by, labels, strict=True)),
            "walks": sum(row["named"] is not None for row in group),
            **{key: mean_of_known(row[key] for row in group) for key in (*RECOGNISED, "speed_share")},
        }
        for labels, group in groups.items()
    ]


def limps_together(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> Rows:
    """The rows of walks with one hurt link and one column of another channel at its highest value.

    There is a row for each pair of a column, such as "sad", and a link of a leg, which hurts at severity 10.
    Only columns that were above 0 in training are used (all columns if none was). The row's effects are
    relative to the walk with the same value of the column and no injury. A column is left out if this walk
    has no whole cycle.
    """
    assert network.skeleton is not None
    legs = [link for link in links if _part_and_side(network.skeleton, link)[0] in LEG]
    columns = [(n, column) for n in network.channels if n != INJURY for column in network.trained_labels(n)]
    injuries: list[Injury] = [{}, *({link: SEVERITIES[-1]} for link in legs)]
    cases = [
        {name: {column: channel(name).highest}, INJURY: injury}
        for name, column in columns
        for injury in injuries
    ]
    figures = iter(walk_figures(network, cases, "walk", seconds, runtime) if cases else ())
    rows: Rows = []
    for name, column in columns:
        healthy, *hurt = (next(figures) for _ in injuries)
        if healthy.profile is not None:
            labels = {"channel": name, "column": column, "gait": "walk"}
            rows += [{**labels, **row_of_walk(network.skeleton, figure, healthy)} for figure in hurt]
    return rows


def _row_of_clip(skeleton: Skeleton, walk: Walk, captured: Sequence[Walk]) -> dict[str, Any]:
    """The effects of the injury in a captured clip, relative to a healthy walk.

    Its key `healthy` says whose healthy walk this is (see `healthy_reference`).
    """
    healthy, whose = healthy_reference(walk, captured)
    side = hurt_side(skeleton, walk.injury)
    sizes = rounded(profile.measure_effects(profile.profile_of_walk(walk.cycles), healthy, side))
    return {"clip": walk.clip, "hurt": dict(walk.injury), "side": side, "healthy": whose, **sizes}


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
    if network.skeleton is None:
        raise HobbleError(f"{inputs.weights}: this network file has no skeleton, so limps cannot be measured")
    sample = sample_to_measure(inputs, options)
    parts = clip_parts(inputs.clips, sample)
    result = measure_limps(
        network,
        *captured_walks(parts, inputs.splits, network.channels[INJURY], network.skeleton),
        inputs.splits,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        seconds=options.limp_seconds,
    )
    tables = {name: result.get(name, []) for name in ("sizes", "named", "together")}
    log_line = str(result.get("reason", ""))
    if result["applies"]:
        share = result["named"][-1]["impaired"]
        log_line = f"a limp is found in {share} of the windows with a leg at severity 10"
    return Outcome(with_sample(result, sample), tables, log_line)
