"""The page about the clips of a data set."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from hobble.motion.look_page import figure, foot_down, look_page


def test_a_page_has_a_line_and_a_walking_figure_for_each_clip(walker, holden31):
    clip = walker(holden31, 240, 60.0)
    report = {"rig": "<rig>", "source_fps": 120.0, "sha256": "a", "repairs": [], "retarget": None}
    labels = {"cycles": 3, "seconds": {"walk": 4.0, "jog": 0.0}, "warnings": ["odd & new"]}
    page = look_page("mine", [clip, clip], [report, report], [labels, labels], [0.98, 1.0])
    assert page.count("<canvas") == 2
    assert "&lt;rig&gt;" in page
    assert "odd &amp; new" in page
    assert "walk 4.0" in page
    assert "98 %" in page
    assert "are the same file" in page
    assert "http" not in page
    data = json.loads(re.search(r'id="d">(.*?)</script>', page)[1])
    assert [len(one["p"]) for one in data] == [40, 40]


def test_a_figure_walks_on_the_spot_to_its_right(walker, holden31):
    clip = walker(holden31, 240, 60.0)
    shown = figure(clip)
    joints = np.array(shown["p"]).reshape(40, -1, 2)
    assert joints[:, 0, 0] == pytest.approx(40)
    toe, heel = (holden31.role(f"left_{part}") for part in ("toe", "heel"))
    assert (joints[:, toe, 0] > joints[:, heel, 0]).mean() > 0.9
    assert shown["f"] == pytest.approx(10)


def test_a_foot_is_down_where_one_of_four_is():
    assert foot_down(np.array([[0, 0, 0, 1], [0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, 0]])) == 0.5
