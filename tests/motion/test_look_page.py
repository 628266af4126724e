"""The page about the clips of a data set."""

import json
import re
from typing import Any

import numpy as np

from hobble.motion import look as module
from hobble.motion.look import choose_clips, look_page

REPORT = {"rig": "<rig>", "source_fps": 120.0, "seconds": 4.0, "sha256": "a", "repairs": [], "retarget": None}
LABELS: dict[str, Any] = {"cycles": 3, "seconds": {"walk": 4.0, "jog": 0.0}, "warnings": []}


def test_a_page_has_a_line_and_a_walking_figure_for_each_clip(walker, holden31):
    clip = walker(holden31, 240, 60.0)
    contacts = [np.arange(200).reshape(50, 4) > 3, np.ones((10, 4))]
    labels = LABELS | {"warnings": ["odd & new"]}
    page = look_page("mine", [REPORT | {"clip": clip.name}] * 2, [labels] * 2, lambda n: (clip, contacts[n]))
    assert page.count("<canvas") == 2
    for text in ("&lt;rig&gt;", "odd &amp; new", "walk 4.0", "98 %", "are the same file"):
        assert text in page
    assert "http" not in page
    data = json.loads(re.search(r'id="d">(.*?)</script>', page)[1])
    assert [len(one["p"]) for one in data] == [40, 40]


def test_with_very_many_clips_a_sample_is_drawn_and_every_clip_is_listed(walker, holden31, monkeypatch):
    """The sample has those with a warning, and is spread over the others."""
    clip, numbers = walker(holden31, 240, 60.0), list[int]()
    monkeypatch.setattr(module, "MOST_READ", 40)
    reports = [REPORT | {"clip": f"clip-{n:05}", "sha256": str(n)} for n in range(10_000)]
    labels = [LABELS | {"warnings": ["odd"] if n in (7, 9_876) else []} for n in range(10_000)]
    reports[123]["unsure"] = ["no idea"]
    page = look_page("mine", reports, labels, lambda n: numbers.append(n) or (clip, np.ones((10, 4))))
    assert len(numbers) == 40 == page.count("<canvas")
    assert {7, 123, 9_876} <= set(numbers)
    assert np.diff(numbers).max() < 3 * 10_000 / 40
    assert page.count("<tr>") == 10_001
    assert "clip-04321" in page
    assert "only 40 clips were read" in page
    assert len(page.encode()) < 25e6
    assert choose_clips([False] * 20) == list(range(20))
