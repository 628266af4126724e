"""Renders the report of a configuration into one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from hobble.channels.shown import shown_names
from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import mesh_key
from hobble.figure.pack import packed_body
from hobble.report import (
    cost_section,
    coverage,
    data_section,
    findings,
    measure_sections,
    shown_clips,
    terrain_section,
    training_section,
)
from hobble.report.formats import embedded, json_data
from hobble.report.gather import ReportMaterial
from hobble.report.ground_pictures import ground_pictures
from hobble.report.opening_slider import body_channel, opening_channel, opening_slider
from hobble.report.provenance import git_commit, machine, versions
from hobble.report.templates import FOLDER, chart_specs, load_template, mark_safe, page_style


def render_report(
    material: ReportMaterial,
    scenes: Mapping[str, Any] | None = None,
    playable: Mapping[str, Any] | None = None,
    captured_and_predicted: Mapping[str, Any] | None = None,
    bundle: str = "",
    hero: Mapping[str, Any] | None = None,
) -> str:
    """The report as one HTML document.

    The arguments come from other modules of hobble.report: scenes from `scenes.packed_scenes`; playable from
    `playable.playable_data`, or with a recogniser from `pack_recogniser.playable_with_recogniser`;
    captured_and_predicted from `captured_and_predicted.packed_comparisons`; bundle, the page's scripts, from
    `bundle.bundle_page_scripts`; hero, the top of the page, from `opening_walk.opening_walk`. A section
    without data is left out. Without `hero`, the characters at the top begin in the network's start frame.

    Texts from the user's files cannot become HTML: the template escapes every value, and the data for the
    scripts is JSON without any "<".
    """
    clips = shown_clips.choose_clips(material)
    terrain = shown_clips.files_of_clips(material.terrain_files, clips)
    row_files = shown_clips.sample_files(material.row_files)
    # Seconds of data at each speed, turning speed and channel value.
    counted = coverage.seconds_of_data(row_files, material.splits, all_clips=len(material.row_files))
    sections = _sections(material, counted, clips, terrain)
    measured_sections = measure_sections.sections(material)
    scenes, playable = dict(scenes or {}), playable or {}
    captured_and_predicted = captured_and_predicted or {}
    strips = data_section.clip_strips(material, clips)  # the labels of each clip over time
    grounds = ground_pictures(terrain, material.network["skeleton"])
    playables = {material.name: playable} if playable else {}
    data = {
        "charts": chart_specs([sections, measured_sections]),
        "bodies": _bodies(material),
        "hero": hero or opening_slider(playable, material.measurements.values()),
        "scenes": scenes,
        "strips": strips,
        "grounds": grounds,
        "name": material.name,
        "playable": playables,
        "compare": captured_and_predicted,
    }
    return load_template("page.html.j2").render(
        material=material,
        measured_sections=measured_sections,
        figures=findings.key_figures(material),
        hints=findings.hints(material, counted["turns"]),
        embedded={name: embedded(part) for name, part in data.items()},
        scene_names=[scene["name"] for scene in scenes.get("scenarios", ())],
        playable=playables,
        captured_and_predicted=[clip["name"] for clip in captured_and_predicted.get("clips", ())],
        grounds=[picture["name"] for picture in grounds["pictures"]],
        strips=[strip["clip"] for strip in strips],
        style=page_style(),
        bundle=mark_safe("the bundle", bundle),
        **_top_values(material, playable),
        **_origin_values(material),
        **sections,
    )


def _bodies(material: ReportMaterial) -> dict[str, Any]:
    """The body to draw, under its key (`mesh_key`); {} if the network has no skeleton."""
    if not material.network["skeleton"]:
        return {}
    figure = Skeleton.from_dict({"name": "", **material.network["skeleton"]})
    return {mesh_key(figure): packed_body(figure)}


def _top_values(material: ReportMaterial, playable: Mapping[str, Any]) -> dict[str, Any]:
    """The template's values for the part above the first section.

    `hurts`: whether the reader can set a value for parts of the character's body. `shown_channel`: the
    channel that the reader can set at the top, or None.
    """
    return {
        "name": material.name,
        "title": material.title or material.name,
        "titled": bool(material.title),
        "eyebrow": f"Hobble report · configuration {material.name} · data set {material.dataset}",
        "lead": findings.lead_text(material),
        "hurts": body_channel(playable) is not None,
        "shown_channel": opening_channel(playable),
    }


def _origin_values(material: ReportMaterial) -> dict[str, Any]:
    """The template's values for the last sections: the configuration, and what the page was made with."""
    resolved = json_data(dict(material.resolved))
    return {
        "configuration": yaml.safe_dump(resolved, sort_keys=False, allow_unicode=True),
        "provenance": {"commit": git_commit(FOLDER), "machine": machine(), "versions": versions()},
    }


def _sections(
    material: ReportMaterial, counted: Mapping[str, Any], clips: frozenset[str], terrain: list[str]
) -> dict[str, dict[str, Any]]:
    """Section -> name in the template -> chart, table or list of charts; None if there is nothing to show.

    counted: from `coverage.seconds_of_data`. clips: names of the clips that are shown one by one. terrain:
    files of their terrain fits.
    """
    costs, data, training = cost_section, data_section, training_section
    return {
        "training": {
            "curve": training.learning_curve(material),
            "blocks": training.block_curves(material),
            "table": training.history_table(material),
        },
        "terrain": terrain_section.section(terrain),
        "stages": {
            **dict(zip(("seconds", "bytes"), costs.stage_charts(material), strict=True)),
            "table": costs.stage_table(material),
        },
        "data": {
            "gaits": data.gait_chart(material),
            "speeds": data.speed_chart(material),
            "turns": coverage.turn_chart(counted),
            "both": coverage.speed_turn_chart(counted),
            "channels": coverage.channel_charts(counted, shown_names(material.network["skeleton"])),
            "retarget": data.retarget_chart(material),
            "clips": data.clip_table(material, clips),
            "remarks": data.remarks_table(material),
        },
    }
