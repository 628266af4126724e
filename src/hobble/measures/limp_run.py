"""Measures the size of each link's limp, and compares it with the limps of people and of captured clips.

A link is a pair of neighbouring joints. A severity from 0 to 10 says how much a link hurts.

The rank correlations of the measurement `injury` say nothing about size, because a correlation is 1 even if
the walk changes by only 2 %. Here the size of each effect of an injury on the walk is measured at severities
3, 5, 7 and 10, relative to the healthy walk of the same network. The two recognisers of `hobble.gait`, a
linear and a graded one, judge the walks. They learnt only from real people.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import WalkCycles, join_walks, measure_cycles
from hobble.gait.profile import (
    EFFECTS,
    RIGHT,
    Profile,
    effects_of_people,
    features,
    healthy_profile,
    measure_effects,
    profile_of_walk,
)
from hobble.gait.recognise import SIDES, compare_walk, examples_of_people
from hobble.hurt.effects import part_of_link
from hobble.measures.measure import MeasureInputs, Outcome
from hobble.measures.sample import HURT_VERSION, ClipPart, clip_parts, sample_to_measure, with_sample
from hobble.measures.walks import (
    FPS,
    PHASES,
    CrowdTarget,
    channel_values,
    generate_walks,
    mean_cycle,
    mean_of_known,
    share_of_true,
    spearman,
)
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows, captured_stretches, rotate_by_yaw
from hobble.runtime.animation import ProceduralAnimation
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
Injury = Mapping[str, float]  # link -> severity


@dataclass(frozen=True)
class FigureWalk:
    """The walk of one figure of the crowd.

    walk: its gait cycles. profile: None if there is no whole cycle. speed: mean speed, cm a frame. frames:
    length of the walk in frames.
    """

    walk: WalkCycles = field(repr=False)
    profile: Profile | None = field(repr=False)
    speed: float
    frames: int


@dataclass(frozen=True)
class CapturedWalk:
    """The walk in one captured clip. The severities are the same in all its frames.

    severity_by_link: those of the links that hurt. walk: the gait cycles. cycle: their mean poses, see
    `hobble.measures.walks.mean_cycle`.
    """

    clip: str
    severity_by_link: Injury
    walk: WalkCycles = field(repr=False)
    cycle: Array = field(default_factory=lambda: np.zeros((PHASES, 0, 3)), repr=False)

    @property
    def performer(self) -> str:
        """Who walks: the part of the clip's name before the first underscore, such as "105" in "105_25".

        Mirrored clips count as clips of another performer, because their left and right are swapped.
        """
        return (self.clip.partition("_")[0] or self.clip) + MIRROR * self.clip.endswith(MIRROR)


def walk_figures(
    network: Network,
    injuries: Sequence[Injury],
    speed: float,
    gait: str,
    seconds: float,
    runtime: Runtime,
    other_channels: Mapping[str, Sequence[Mapping[str, float]]] | None = None,
) -> list[FigureWalk]:
    """Let a crowd of figures walk straight ahead for `seconds`, all in the gait `gait`.

    injuries: of each figure. speed: target speed, cm a frame. other_channels: name of another channel -> for
    each figure, column -> value.
    """
    assert network.skeleton is not None
    count, frames = len(injuries), max(4, round(seconds * FPS))
    animation = ProceduralAnimation(network, characters=count, **dict(runtime))
    velocity = np.tile([0.0, speed], (count, 1))
    channels: dict[str, Array] = {}
    for name, values in {INJURY: injuries, **(other_channels or {})}.items():
        channels |= channel_values(network, name, values)
    shares = np.tile([float(name == gait) for name in network.gaits], (count, 1))
    positions = np.zeros((frames, count, len(network.skeleton.joints), 3), np.float32)
    for frame in range(-WARM_UP_FRAMES, frames):
        pose = animation.next_pose(velocity, gait=shares.copy(), **channels)
        if frame >= 0:
            positions[frame] = pose.positions.reshape(count, -1, 3)
    return [_figure_walk(network.skeleton, positions[:, i].astype(float)) for i in range(count)]


def _figure_walk(skeleton: Skeleton, positions: Array) -> FigureWalk:
    """The walk of one figure. positions: (F, J, 3) of its joints in the world, cm."""
    hips = skeleton.role("hips")
    # Distance on the ground between the first and the last position, divided by the frames between them.
    speed = float(np.linalg.norm((positions[-1, hips] - positions[0, hips])[::2])) / (len(positions) - 1)
    walk = measure_cycles(skeleton, positions, FPS)
    return FigureWalk(walk, profile_of_walk(walk) if len(walk) else None, speed, len(positions))


def captured_walks(
    parts: Iterable[ClipPart], splits: Mapping[str, str], links: Sequence[str], skeleton: Skeleton
) -> tuple[list[CapturedWalk], dict[str, dict[str, float]]]:
    """The walks of all captured clips, and for how many seconds each link hurts in the training clips.

    The seconds are "captured" or "made" (in hurt versions) -> link -> seconds. If the parts are only a sample
    of the clips, they are estimates. parts: the parts of the clips to read, sorted by clip. splits: clip ->
    "train" or "held_out".
    """
    walks: list[CapturedWalk] = []
    seconds: dict[str, dict[str, float]] = {"captured": {}, "made": {}}
    for clip, parts_of_clip in groupby(parts, key=lambda part: part.clip):
        made = HURT_VERSION.search(clip) is not None
        rows_of_clip: list[ClipRows] = []
        for part in parts_of_clip:
            rows = part.load().rows
            of_links = seconds["made" if made else "captured"]
            if splits.get(clip) == "train" and INJURY in rows.channels:
                for link, column in zip(links, rows.channels[INJURY].T, strict=False):
                    if column.any():
                        more = float(np.sum(column > 0)) * part.weight / FPS
                        of_links[link] = round(of_links.get(link, 0.0) + more, 2)
            if not made and len(rows):
                rows_of_clip.append(rows)
        if rows_of_clip and (found := _walk_of_clip(clip, rows_of_clip, links, skeleton)):
            walks.append(found)
    return walks, seconds


def _walk_of_clip(
    clip: str, rows_of_clip: Sequence[ClipRows], links: Sequence[str], skeleton: Skeleton
) -> CapturedWalk | None:
    """The walk of a clip; None if the severities change in it, or if nobody walks a whole cycle.

    rows_of_clip: all rows of the clip as one item, or an item for each of the clip's excerpts.
    """
    severity = np.concatenate(
        [rows.channels.get(INJURY, np.zeros((len(rows), len(links)))) for rows in rows_of_clip]
    )
    if np.ptp(severity, axis=0).any():
        return None
    walks, stretches = [], []
    for rows in rows_of_clip:
        turn = rows.y[:, rows.layout.y_turn][:, 0].astype(float)
        for stretch in captured_stretches(rows):
            if stretch.gait.mean(axis=0).argmax() != 1:  # gait 1 is walking
                continue
            # `turn` is the change of yaw in each frame, negated.
            yaw = np.concatenate([[0.0], -np.cumsum(turn[stretch.rows])[:-1]])
            world = stretch.local.copy()
            world[..., ::2] = rotate_by_yaw(world[..., ::2], yaw[:, None])
            walks.append(measure_cycles(skeleton, world + stretch.root[:, None], FPS))
            stretches.append(stretch)
    walk = join_walks(walks) if walks else WalkCycles(FPS, (), ())
    hurt = {link: float(value) for link, value in zip(links, severity[0], strict=True) if value > 0}
    if not len(walk):
        return None
    local, phase = (np.concatenate([getattr(s, name) for s in stretches]) for name in ("local", "phase"))
    return CapturedWalk(clip, hurt, walk, mean_cycle(local, phase))


def healthy_reference(captured_walk: CapturedWalk, walks: Sequence[CapturedWalk]) -> tuple[Profile, str]:
    """The healthy walk to compare a captured walk with, and whose walk it is.

    "performer": it is measured over the performer's healthy clips. "data set": if the performer has no
    healthy clip, it is measured over all healthy clips. "people": if there is no healthy clip at all, it is
    the mean normal walk of people in `hobble.gait.profile`. walks: all captured walks.
    """
    healthy = [other for other in walks if not other.severity_by_link and len(other.walk)]
    of_performer = [other for other in healthy if other.performer == captured_walk.performer]
    for chosen, whose in ((of_performer, "performer"), (healthy, "data set")):
        if chosen:
            return profile_of_walk(join_walks(other.walk for other in chosen)), whose
    return healthy_profile([]), "people"


def measure_limps(
    network: Network,
    captured: Sequence[CapturedWalk],
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
    assert network.skeleton is not None
    links = list(links or network.channels[INJURY])
    rows = _size_rows(network, links, seconds, runtime)
    if rows is None:
        return {"configuration": configuration, "applies": False, "reason": NO_CYCLE}
    together = limps_together(network, links, seconds, runtime)
    return {
        "configuration": configuration,
        "applies": True,
        "asked_cm_per_second": {gait: 60 * speed for gait, speed in SPEEDS.items()},
        "seconds": seconds,
        "effects": EFFECTS,
        "trained": [link for link in links if link in network.trained_labels(INJURY)],
        "hurt_seconds": hurt_seconds,
        "sizes": rows,
        "trends": _trend_rows(rows),
        "named": _recognition_by_severity(rows),
        "people": {
            gait: {name: [round(v, 5) for v in mean_and_sd] for name, mean_and_sd in of_gait.items()}
            for gait, of_gait in effects_of_people().items()
        },
        "captured": [
            _row_of_clip(network.skeleton, clip, captured) for clip in captured if clip.severity_by_link
        ],
        "held_out_limps": compare_held_out(network, captured, splits, seconds, runtime),
        "gallery": gallery(network, captured, splits, seconds, runtime),
        "together": together,
        "named_together": _recognition_by_column(together),
    }


def _size_rows(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> Rows | None:
    """A row of `_row_of_walk` for each gait, link and severity.

    None if the healthy character does not walk a whole cycle in the gait "walk". If it does not in another
    gait, the rows of this gait are left out.
    """
    rows: Rows = []
    cases = [(link, severity) for link in links for severity in SEVERITIES]
    injuries = [{}, *({link: severity} for link, severity in cases)]
    for gait, speed in SPEEDS.items():
        healthy, *hurt = walk_figures(network, injuries, speed, gait, seconds, runtime)
        if healthy.profile is not None:
            rows += [
                _row_of_walk(network, gait, *case, figure, healthy)
                for case, figure in zip(cases, hurt, strict=True)
            ]
        elif gait == "walk":
            return None
    return rows


def _part_and_side(skeleton: Skeleton, link: str) -> tuple[str, str | None]:
    """The part of the body that a link belongs to, and its side: "left", "right", or None on the midline."""
    part = part_of_link(skeleton, skeleton.links[skeleton.link_names.index(link)])
    return part.name, None if part.side is None else ("left", "right")[part.side]


def hurt_side(skeleton: Skeleton, link: str) -> str:
    """The side of a link. Links on the midline count as right, because the effects need a hurt side."""
    return _part_and_side(skeleton, link)[1] or RIGHT


def _row_of_walk(
    network: Network, gait: str, link: str, severity: float, figure: FigureWalk, healthy: FigureWalk
) -> dict[str, Any]:
    """The row of one walk: gait, link and severity, the effects, and how the walk is recognised.

    called: label and side that the linear recogniser gives to the whole walk. graded: label and side that the
    graded recogniser gives to it. impaired: share of windows in which the linear recogniser finds a limp. The
    wrong side is the side opposite to `hurt_side`. named: share of windows in which the graded recogniser
    finds a limp, and not on the wrong side. wrong_side: share of windows in which it finds one on the wrong
    side; None for a link on the midline. speed_share: speed, divided by the speed of the healthy walk.
    If the figure does not walk a whole cycle, all but `speed_share` is None.
    """
    assert network.skeleton is not None
    assert healthy.profile is not None
    part, side = _part_and_side(network.skeleton, link)
    row: dict[str, Any] = {"gait": gait, "link": link, "part": part, "severity": severity, "side": side}
    row["speed_share"] = round(figure.speed / max(healthy.speed, 1e-9), 5)
    if figure.profile is None:
        return row | dict.fromkeys((*EFFECTS, "called", "graded", *RECOGNISED))
    row |= _rounded_values(measure_effects(figure.profile, healthy.profile, side or RIGHT))
    found = compare_walk(figure.walk, figure.frames, healthy.profile)
    wrong_side = SIDES[1 - SIDES.index(side or RIGHT)]
    answers = [(grade.is_impaired, grade.side == wrong_side) for grade in found.window_grades]
    return row | {
        "called": found.answer.name,
        "graded": found.grade.name,
        "impaired": share_of_true([answer.is_impaired for answer in found.window_answers]),
        "named": share_of_true([limps and not wrong for limps, wrong in answers]),
        "wrong_side": share_of_true([limps and wrong for limps, wrong in answers]) if side else None,
    }


def _rounded_values(values: Mapping[str, float]) -> dict[str, float | None]:
    """The values, rounded to 5 decimals. None in place of a value that is not finite."""
    return {name: round(float(v), 5) if np.isfinite(v) else None for name, v in values.items()}


def _trend_rows(rows: Rows) -> Rows:
    """A row for each gait, link and effect: Spearman's rho with severity, and the size at severity 10."""
    out = []
    for (gait, link), group in groupby(rows, key=lambda row: (row["gait"], row["link"])):
        of_link = list(group)
        for name in EFFECTS:
            values = [row[name] for row in of_link]
            if None not in values:
                rho = spearman([row["severity"] for row in of_link], values)
                out.append({"gait": gait, "link": link, "effect": name, "at_10": values[-1], "spearman": rho})
    return out


def _recognition_by_severity(rows: Rows) -> Rows:
    """A row for each severity: how well walks with a hurt leg are recognised, as means over these walks."""
    out = []
    for severity in SEVERITIES:
        legs = [r for r in rows if r["gait"] == "walk" and r["severity"] == severity and r["part"] in LEG]
        means = {key: mean_of_known(row[key] for row in legs) for key in RECOGNISED}
        out.append({"severity": severity, "walks": len(legs), **means})
    return out


def limps_together(network: Network, links: Sequence[str], seconds: float, runtime: Runtime) -> Rows:
    """The rows of walks with one hurt link and one column of another channel at its highest value.

    There is a row for each pair of a column, such as "sad", and a link of a leg, which hurts at severity 10.
    Only columns that were above 0 in training are used (all columns if none was). The row's effects are
    relative to the walk with the same value of the column and no injury. A column is left out if this walk
    has no whole cycle.
    """
    assert network.skeleton is not None
    legs = [link for link in links if _part_and_side(network.skeleton, link)[0] in LEG]
    names = [name for name in network.channels if name != INJURY]
    columns = [(name, column) for name in names for column in network.trained_labels(name)]
    if not columns:
        return []
    # A figure walks for each case. Its link is None if it has no injury.
    cases = [(other, column, link) for other, column in columns for link in (None, *legs)]
    other_channels = {
        name: [{column: channel(name).highest} if other == name else {} for other, column, _ in cases]
        for name in names
    }
    injuries = [{} if link is None else {link: SEVERITIES[-1]} for *_, link in cases]
    walks = walk_figures(network, injuries, SPEEDS["walk"], "walk", seconds, runtime, other_channels)
    figures = dict(zip(cases, walks, strict=True))
    return [
        {"channel": other, "column": column}
        | _row_of_walk(network, "walk", link, SEVERITIES[-1], figures[other, column, link], healthy)
        for other, column in columns
        if (healthy := figures[other, column, None]).profile is not None
        for link in legs
    ]


def _recognition_by_column(rows: Rows) -> Rows:
    """A row for each column of another channel, with means over the rows of `limps_together`.

    walks: number of walks that are judged. A very slow walk is not judged if no window has enough cycles.
    """
    out = []
    for (other, column), group in groupby(rows, key=lambda row: (row["channel"], row["column"])):
        of_column = list(group)
        means = {
            key: mean_of_known(row[key] for row in of_column)
            for key in ("impaired", "named", "wrong_side", "speed_share")
        }
        judged = sum(row["named"] is not None for row in of_column)
        known = {key: mean for key, mean in means.items() if mean is not None}
        out.append({"channel": other, "column": column, "walks": judged, **known})
    return out


def _row_of_clip(skeleton: Skeleton, clip: CapturedWalk, captured: Sequence[CapturedWalk]) -> dict[str, Any]:
    """The effects of the injury in a captured clip, relative to a healthy walk.

    Its key `healthy` says whose healthy walk this is (see `healthy_reference`). If several links hurt, the
    side of the one with the highest severity counts as hurt.
    """
    healthy, whose = healthy_reference(clip, captured)
    side = hurt_side(skeleton, max(clip.severity_by_link, key=lambda link: clip.severity_by_link[link]))
    sizes = _rounded_values(measure_effects(profile_of_walk(clip.walk), healthy, side))
    return {"clip": clip.clip, "hurt": dict(clip.severity_by_link), "side": side, "healthy": whose, **sizes}


def limp_distance(walk: Profile, healthy: Profile, other: Profile, other_healthy: Profile) -> float:
    """How much the limps of two bodies differ. A limp is how a body's walk differs from its healthy walk.

    walk, healthy: profiles of the first body. other, other_healthy: profiles of the second body. The distance
    is the root mean square of the differences of all features of the limps. Each difference is divided by the
    standard deviation of its feature over people's walks.
    """
    spread = examples_of_people()[0].std(axis=0)
    a, b = (np.array(list(features(*pair).values())) for pair in ((walk, healthy), (other, other_healthy)))
    return float(np.sqrt(np.mean(((a - b) / spread) ** 2)))


def compare_held_out(
    network: Network,
    captured: Sequence[CapturedWalk],
    splits: Mapping[str, str],
    seconds: float,
    runtime: Runtime,
) -> Rows:
    """Whether limps in held-out clips are nearer to the hurt character than to the healthy one.

    Each clip is compared with the hurt character, which has the clip's severities, and with the healthy
    character. Both have a target speed of 1.2 m/s, a likely speed of the performer's healthy walk. Returns a
    row for each clip. `hurt`, `healthy`: the `limp_distance` of the clip from the hurt and from the healthy
    character; None if either of them does not walk a whole cycle. `nearer`: whether the hurt character is
    nearer, as it should be; False without distances.
    """
    limps = [clip for clip in captured if clip.severity_by_link and splits.get(clip.clip) == "held_out"]
    if not limps:
        return []
    injuries = [{}, *(clip.severity_by_link for clip in limps)]
    healthy_figure, *hurt = walk_figures(network, injuries, SPEEDS["walk"], "walk", seconds, runtime)
    out = []
    for clip, figure in zip(limps, hurt, strict=True):
        healthy, whose = healthy_reference(clip, captured)
        row: dict[str, Any] = {
            "clip": clip.clip,
            "hurt_links": dict(clip.severity_by_link),
            "compared_with": whose,
        }
        if healthy_figure.profile is None or figure.profile is None:
            out.append({**row, "healthy": None, "hurt": None, "nearer": False})
            continue
        of_clip = profile_of_walk(clip.walk)
        from_healthy, from_hurt = (
            limp_distance(of_clip, healthy, walk, healthy_figure.profile)
            for walk in (healthy_figure.profile, figure.profile)
        )
        distances = {"healthy": round(from_healthy, 5), "hurt": round(from_hurt, 5)}
        out.append({**row, **distances, "nearer": from_hurt < from_healthy})
    return out


def gallery(
    network: Network,
    captured: Sequence[CapturedWalk],
    splits: Mapping[str, str],
    seconds: float,
    runtime: Runtime,
) -> Rows:
    """Poses of captured limps over a gait cycle, and of the character with the same injuries and healthy.

    There are at most IN_GALLERY, held-out clips and strong limps first. `poses`: "captured", "character" or
    "healthy" -> (8, J, 3) places of the joints relative to the root at 8 phases, cm; `phases`.
    """
    limps = [clip for clip in captured if clip.severity_by_link and not clip.clip.endswith(MIRROR)]
    limps.sort(key=lambda c: (splits.get(c.clip) != "held_out", -max(c.severity_by_link.values()), c.clip))
    limps = limps[:IN_GALLERY]
    if not limps:
        return []
    injuries = [{}, *(clip.severity_by_link for clip in limps)]
    gait, speed = ["walk"] * len(injuries), [SPEEDS["walk"]] * len(injuries)
    hurt_channel = channel_values(network, INJURY, injuries)
    lengths = (WARM_UP_FRAMES, max(FPS, round(seconds * FPS)))
    walks = generate_walks(network, [CrowdTarget(n, gait, hurt_channel, speed) for n in lengths], runtime)
    healthy, *hurt = (walks.cycle(1, i) for i in range(len(injuries)))
    return [
        {
            "clip": clip.clip,
            "hurt": dict(clip.severity_by_link),
            "phases": [round(b / PHASES, 5) for b in range(0, PHASES, PHASES // 8)],
            "poses": {
                name: np.round(cycle[:: PHASES // 8], 1).tolist()
                for name, cycle in (("captured", clip.cycle), ("character", own), ("healthy", healthy))
            },
        }
        for clip, own in zip(limps, hurt, strict=True)
    ]


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
    tables = {name: result.get(name, []) for name in ("sizes", "trends", "named", "together")}
    log_line = str(result.get("reason", ""))
    if result["applies"]:
        share = result["named"][-1]["impaired"]
        log_line = f"a limp is found in {share} of the windows with a leg at severity 10"
    return Outcome(with_sample(result, sample), tables, log_line)
