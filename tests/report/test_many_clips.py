"""With many clips the page shows some of them, estimates from some, and says so."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.report import data_section
from hobble.report.gather import ReportMaterial
from hobble.report.page import render_report


def of_many(material: ReportMaterial, copies: int) -> ReportMaterial:
    """The same data set with `copies` copies of each clip under other names."""

    def copied(reports: list[dict]) -> list[dict]:
        return [{**one, "clip": f"{one['clip']}-{i}"} for i in range(copies) for one in reports]

    splits = {f"{clip}-{i}": split for clip, split in material.splits.items() for i in range(copies)}
    many = {key: copied(getattr(material, key)) for key in ("motion", "labels", "channels")}
    return replace(material, splits=splits, **many)


def test_every_kind_of_clip_is_shown(material: ReportMaterial) -> None:
    many = of_many(material, 50)
    some = data_section.choose_clips(many, most=40)
    assert len(some) == 40
    assert {many.split_of(clip) for clip in some} == {"train", "held_out"}
    hurt = {report["clip"] for report in many.channels if report["values"]}
    assert some & hurt
    assert some - hurt
    reordered = replace(many, labels=many.labels[::-1])
    assert data_section.choose_clips(reordered, most=40) == some
    more = {**many.labels[0], "clip": "another"}
    assert len(data_section.choose_clips(replace(many, labels=[*many.labels, more]), most=40) - some) <= 1


@pytest.mark.slow
def test_the_page_does_not_grow_with_the_clips(
    material: ReportMaterial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With smaller limits, so that a test need not make hundreds of clips."""
    monkeypatch.setattr(data_section, "MOST_ROWS", 12)
    monkeypatch.setattr(data_section, "MOST_REMARKS", 20)
    sizes = [len(render_report(of_many(material, copies))) for copies in (20, 100)]
    assert sizes[1] < 1.01 * sizes[0]


def test_seconds_are_estimated_from_a_random_choice_of_clips(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path
) -> None:
    examples.rows(tmp_path / "walk.npz", holden31)
    paths = [str(tmp_path / f"walk-{i}.npz") for i in range(30)]
    for path in paths:
        shutil.copy(tmp_path / "walk.npz", path)
    some = data_section.sample_files(paths, most=10)
    assert len(some) == 10
    assert some != paths[:10]
    every, few = data_section.seconds_of_data(paths, {}), data_section.seconds_of_data(some, {}, all_clips=30)
    np.testing.assert_allclose(few["both"], every["both"])
    np.testing.assert_allclose(few["turns"]["train"], every["turns"]["train"])
    assert every["estimate"] == ""
    chart = data_section.turn_chart(few)
    assert chart is not None
    assert chart.caption.endswith("Estimated from 10 of 30 clips.")


def test_seconds_are_estimated_from_random_excerpts_of_clips(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = [tmp_path / f"walk-{i}.npz" for i in range(4)]
    for path in paths:
        examples.rows(path, holden31)
    every = data_section.seconds_of_data(paths, {})
    monkeypatch.setattr(data_section, "MOST_EXCERPTS", 3)
    few = data_section.seconds_of_data(paths, {}, all_clips=8)
    np.testing.assert_allclose(few["both"], 2 * every["both"])
    assert few["estimate"] == " Estimated from 4 of 8 clips and 75 % of their frames."


def test_many_remarks_are_grouped_by_kind(material: ReportMaterial, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_section, "MOST_REMARKS", 3)
    sentences = ["frames 1-3 held", "frames 20-31 held", "frames 4-5 held", "no foot down for 2.5 s"]
    motion = [{**material.motion[0], "clip": f"c{i}", "repairs": [s]} for i, s in enumerate(sentences)]
    table = data_section.remarks_table(replace(material, motion=motion, labels=[], channels=[]))
    assert table is not None
    assert table.title == "4 messages on doubts, warnings and repairs, by kind"
    assert table.rows == [
        [3, "repair", "c0", "frames 1-3 held"],
        [1, "repair", "c3", "no foot down for 2.5 s"],
    ]
