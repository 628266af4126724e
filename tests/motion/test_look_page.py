"""The page about the clips of a data set."""

import json
import re
from typing import Any

import numpy as np

from hobble.motion import look as module
from hobble.motion.look import choose_clips, look_page

REPORT = {"rig": "<rig>", "source_fps": 120.0, "seconds": 4.0, "sha256": "a", "repairs": [], "retarget": None}
REPORT |= {"scale": 1.0}


def many(count: int, **changes: dict[int, Any]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Reports and labels of clips. changes: key -> number of a clip -> its value."""
    reports = [{**REPORT, "clip": f"clip-{n:05}", "sha256": str(n)} for n in range(count)]
    labels: list[dict[str, Any]] = [{"cycles": 3, "seconds": {"walk": 4.0}, "warnings": []} for _ in reports]
    for key, values in changes.items():
        for n, value in values.items():
            (labels if key == "warnings" else reports)[n][key] = value
    return reports, labels


def test_a_page_has_a_line_and_a_walking_figure_for_each_clip(walker, holden31):
    clip = walker(holden31, 240, 60.0)
    report = {**REPORT, "clip": clip.name}
    labels = {"cycles": 3, "seconds": {"walk": 4.0, "jog": 0.0}, "warnings": ["odd & new"]}
    contacts = [np.arange(200).reshape(50, 4) > 3, np.ones((10, 4))]
    page = look_page("mine", [report] * 2, [labels] * 2, lambda n: (clip, contacts[n]))
    assert page.count("<canvas") == 2
    assert "&lt;rig&gt;" in page
    assert "odd &amp; new" in page
    assert "walk 4.0" in page
    assert "98 %" in page
    assert "are the same file" in page
    assert "http" not in page
    data = json.loads(re.search(r'id="d">(.*?)</script>', page)[1])
    assert [len(one["p"]) for one in data] == [40, 40]


def test_with_very_many_clips_a_sample_is_drawn_and_every_clip_is_listed(walker, holden31, monkeypatch):
    clip, numbers = walker(holden31, 240, 60.0), []
    monkeypatch.setattr(module, "MOST_READ", 40)

    def read(n: int) -> tuple[Any, np.ndarray]:
        numbers.append(n)
        return clip, np.ones((10, 4))

    reports, labels = many(10_000, warnings={7: ["odd"], 9_876: ["odd"]}, unsure={123: ["no idea"]})
    page = look_page("mine", reports, labels, read)
    assert len(numbers) == module.MOST_READ == page.count("<canvas")
    assert {7, 123, 9_876} <= set(numbers)
    assert page.count("<tr>") == 10_001
    assert "clip-04321" in page
    assert "only 40 clips were read" in page
    assert len(json.loads(re.search(r'id="d">(.*?)</script>', page)[1])) == 40
    assert len(page.encode()) < 25e6


def test_the_sample_is_spread_over_the_clips_after_those_with_a_warning():
    some = choose_clips([n % 1000 == 7 for n in range(10_000)])
    assert len(set(some)) == module.MOST_READ
    assert set(range(7, 10_000, 1000)) < set(some)
    assert np.diff(some).max() < 3 * 10_000 / module.MOST_READ
    assert choose_clips([False] * 20) == list(range(20))
    assert choose_clips([]) == []
