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


@pytest.mark.slow
def test_the_page_does_not_grow_with_the_clips(
    material: ReportMaterial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With smaller limits, so that a test need not make hundreds of clips."""
    monkeypatch.setattr(data_section, "MOST_ROWS", 12)
    monkeypatch.setattr(data_section, "MOST_REMARKS", 20)
    sizes = [len(render_report(of_many(material, copies))) for copies in (20, 100)]
    assert sizes[1] < 1.01 * sizes[0]


def test_seconds_are_estimated_from_some_excerpts_of_some_clips(
    examples: ModuleType, holden31: Skeleton, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    examples.rows(tmp_path / "walk.npz", holden31)
    paths = [str(tmp_path / f"walk-{i}.npz") for i in range(8)]
    for path in paths:
        shutil.copy(tmp_path / "walk.npz", path)
    every = data_section.seconds_of_data(paths, {})
    assert every["estimate"] == ""
    monkeypatch.setattr(data_section, "MOST_COUNTED", 4)
    monkeypatch.setattr(data_section, "MOST_EXCERPTS", 3)
    few = data_section.seconds_of_data(paths, {})
    np.testing.assert_allclose(few["both"]["train"], every["both"]["train"])
    assert few["estimate"] == " Estimated from 4 of 8 clips and 75 % of their frames."
    charts = data_section.speed_and_turn_charts(few)
    assert all(chart is not None and chart.caption.endswith(few["estimate"]) for chart in charts)
    assert data_section.some_files(paths, 4) != paths[:4]
