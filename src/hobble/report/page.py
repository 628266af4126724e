"""Renders the report of a configuration into one self-contained HTML file."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import yaml

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import mesh_key
from hobble.figure.pack import packed_body
from hobble.report import parts
from hobble.report import sections as own
from hobble.report.character import body_channel, ground_pictures, opening_channel, opening_slider
from hobble.report.gather import ReportMaterial
from hobble.report.templates import measured_by, render_page

# Degrees a second: slower turning is not counted, because the body sways that much in a straight walk.
TURNING = 40.0
LITTLE_TURNING = 0.01  # if turning takes less than this share of the time, the page warns
LITTLE_OF_A_GAIT = 0.03  # the same for each gait
KIND_ORDER = ("warn", "note", "good", "fact")  # kinds of hints, in the order of the page


def render_report(
    material: ReportMaterial,
    playable: Mapping[str, Any] | None = None,
    captured_and_predicted: Mapping[str, Any] | None = None,
    bundle: str = "",
) -> str:
    """The report as one HTML document.

    playable: from `character.playable_data` or `character.playable_with_recogniser`. captured_and_predicted:
    from `character.packed_comparisons`. bundle: the page's scripts, from `bundle.bundle_page_scripts`.
    A section without data is left out.
    """
    terrain = own.some_files(material.terrain_files, own.MOST_SHOWN)
    # Seconds of data at each speed, turning speed and channel value.
    counted = own.seconds_of_data(material.row_files, material.splits)
    playable, compared = playable or {}, captured_and_predicted or {}
    grounds = ground_pictures(terrain, material.network["skeleton"])
    opening = opening_slider(playable, material.measurements.values())
    on_page = {material.name: playable} if playable else {}
    return render_page(
        material.name,
        [parts.SectionPart(0, parts.KeyFigures(key_figures(material)))],
        parts.join_sections(
            [*measured_by(material, "section"), *own.own_sections(material, counted, terrain)]
        ),
        {
            "bodies": _bodies(material),
            "hero": opening,
            "grounds": grounds,
            "playable": on_page,
            "compare": compared,
        },
        bundle,
        dataset=material.dataset,
        title=material.title or material.name,
        headline=material.title,
        eyebrow=f"Hobble report · configuration {material.name} · data set {material.dataset}",
        lead=lead_text(material),
        opening=opening,
        hurts=body_channel(playable) is not None,  # whether the reader can hurt parts of the body
        shown_channel=opening_channel(playable),
        hints=hints(material, counted["both"]),
        playable=list(on_page),
        captured_and_predicted=[clip["name"] for clip in compared.get("clips", ())],
        grounds=[picture["name"] for picture in grounds["pictures"]],
        configuration=yaml.safe_dump(dict(material.resolved), sort_keys=False, allow_unicode=True),
    )


def _bodies(material: ReportMaterial) -> dict[str, Any]:
    """The body to draw, under its key (`mesh_key`); {} if the network has no skeleton."""
    if not material.network["skeleton"]:
        return {}
    figure = Skeleton.from_dict({"name": "", **material.network["skeleton"]})
    return {mesh_key(figure): packed_body(figure)}


def _training_options(material: ReportMaterial) -> Mapping[str, Any]:
    """The options of training in the configuration; empty if they are not known."""
    return (material.resolved.get("configuration") or {}).get("training") or {}


def _held_out_count(material: ReportMaterial) -> int:
    return sum(material.split_of(report["clip"]) == "held_out" for report in material.motion)


def lead_text(material: ReportMaterial) -> str:
    """A sentence or two on the network and its training data."""
    network, held_out, count = material.network, _held_out_count(material), len(material.motion)
    text = f"A character driven by {network['described']}, built"
    if network["sizes"]:
        columns = f"{network['inputs']} inputs and {network['outputs']} outputs"
        text = f"A {network['described']}, with {columns}, trained"
        passes = _training_options(material).get("passes")
        text += f" for {passes:g} passes" if passes else ""
    text += f" on {count - held_out} clips of the data set {material.dataset}"
    text += f", and tested on {held_out} held-out clips" if held_out else ""
    frames = sum(report.get("frames", 0) for report in material.motion)
    return f"{text}. All clips together have {frames:,} frames at 60\u00a0Hz."


def key_figures(material: ReportMaterial) -> list[parts.KeyFigure]:
    """The numbers at the top of the page, most important first."""
    figures = [figure for shown in measured_by(material, "figures") for figure in shown]
    seconds = sum(report.get("seconds", 0) for report in material.motion)
    if seconds:
        note = f"{len(material.motion)} clips, {_held_out_count(material)} of them held out"
        value, _, unit = parts.format_duration(seconds).partition(" ")
        figures.append(parts.KeyFigure("Motion data", value, unit, note, order=30))
    figures.append(_network_figure(material.network))
    if total := material.pipeline.get("total_seconds"):
        value, _, unit = parts.format_duration(total).partition(" ")
        note = (
            "sum over all jobs, from clips to measurements; jobs can run in parallel, so the run can be "
            f"shorter; {parts.format_bytes(material.pipeline.get('total_bytes'))} written"
        )
        figures.append(parts.KeyFigure("Whole pipeline", value, unit, note, order=50))
    return sorted(figures, key=lambda figure: figure.order)


def _network_figure(network: Mapping[str, Any]) -> parts.KeyFigure:
    """Number of parameters, layers and size on disk. network: from `gather.describe_network`."""
    # A PFNN has a set of weights at each control point, and `parameters` counts one of these sets. For other
    # networks it counts all parameters. Motion matching has no layers, so its `sizes` are empty.
    note = "numbers in its tables"
    if network["sizes"]:
        which = " at each control point" if "phase-functioned" in network["described"] else ""
        note = f"parameters{which}; layers of {'–'.join(map(str, network['sizes']))}"
    note += f"; {parts.format_bytes(network['bytes'])} on disk"
    return parts.KeyFigure(
        "Network", parts.format_number(network["parameters"] / 1e6, 3), "M", note, order=40
    )


def hints(material: ReportMaterial, both: Mapping[str, Array] | None = None) -> list[parts.Hint]:
    """Warnings and advice in the order in which to follow them, then what is good, then plain facts.

    both: of `sections.seconds_of_data`, if the seconds were counted.
    """
    found = [
        *(each for shown in measured_by(material, "hints") for each in shown),
        *_training_hints(material),
        *_gait_hints(material),
        *_turning_hints(both or {}),
        *_repair_hints(material),
    ]
    return sorted(found, key=lambda each: (KIND_ORDER.index(each.kind), each.order))


def _training_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """Whether the held-out error rises, still falls, or has stopped falling."""
    curve = zip(material.history.get("pass", ()), material.history.get("held_out_mse", ()), strict=False)
    points = [(p, error) for p, error in curve if p is not None and error is not None]
    if len(points) < 8:  # with fewer values, a trend is only noise
        return
    passes, errors = np.array(points).T
    # The error is measured several times in a pass. One value is noisy, so compare means over passes.
    means = {p: errors[passes == p].mean() for p in dict.fromkeys(passes)}
    best = min(means, key=lambda p: means[p])
    if means[passes[-1]] > 1.05 * means[best]:
        yield parts.hint("hints.lowest", best=f"{best:.0f}")
    # With another schedule, the error fell because the learning rate fell. That does not show whether more
    # passes would help.
    elif _training_options(material).get("schedule", "constant") == "constant":
        quarter = max(1, len(errors) // 4)
        fall = 1 - errors[-quarter:].mean() / errors[-2 * quarter : -quarter].mean()
        yield (
            parts.hint("hints.falling", percent=f"{100 * fall:.0f}")
            if fall > 0.03
            else parts.hint("hints.flat")
        )


def _gait_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """Gaits of which there is little data or none."""
    train, held_out = own.gait_seconds(material).values()
    totals = {gait: train[gait] + held_out[gait] for gait in train}
    little = LITTLE_OF_A_GAIT * sum(totals.values())
    if little and not totals["stand"]:
        yield parts.hint("hints.standing")
    scarce = sorted(g for g, seconds in totals.items() if 0 < seconds < little and g not in ("jump", "bump"))
    if scarce:
        yield parts.hint("hints.scarce", gaits=" and ".join(scarce), each=" each" if len(scarce) > 1 else "")


def _turning_hints(both: Mapping[str, Array]) -> Iterator[parts.Hint]:
    """A warning if hardly anybody turns. both: of `sections.seconds_of_data`."""
    seconds = np.sum([of_split.sum(axis=1) for of_split in both.values()], axis=0)
    if not np.any(seconds):
        return
    middles = (own.TURN_EDGES[:-1] + own.TURN_EDGES[1:]) / 2  # of the bins, degrees a second
    share = float(np.sum(seconds[np.abs(middles) > TURNING]) / np.sum(seconds))
    if share < LITTLE_TURNING:
        yield parts.hint("hints.turning", percent=f"{100 * share:.1f}", turning=f"{TURNING:.0f}")


def _repair_hints(material: ReportMaterial) -> Iterator[parts.Hint]:
    """How many clips were repaired or have warnings."""
    reports = [*material.labels, *material.channels]
    repaired = {report["clip"] for report in material.motion if report.get("repairs")}
    warned = {report["clip"] for report in reports if report.get("warnings")}
    if repaired or warned:
        yield parts.hint("hints.repaired", repaired=len(repaired), warned=len(warned))
