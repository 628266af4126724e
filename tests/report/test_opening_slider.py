"""Which injury the page opens with."""

from __future__ import annotations

from typing import Any

import pytest

from hobble.report.character import opening_slider

PLAYABLE = {
    "channels": [
        {"columns": ["hip-knee", "back-neck"], "regions": [1], "sliders": {"left thigh": 0, "lower back": 1}}
    ]
}
POSES = {
    "responses": [
        {"gait": "walk", "link": "hip-knee", "from_healthy_cm": 4.0},
        {"gait": "walk", "link": "back-neck", "from_healthy_cm": 6.0},
    ]
}


def limps(thigh: float, back: float, gait: str = "walk") -> dict[str, Any]:
    """The limps of both parts at severities 10 and 3."""
    return {
        "sizes": [
            {"gait": gait, "link": link, "stance": share * stance, "step_hurt": 1.0, "knee_hurt": None}
            for share in (1.0, 0.3)
            for link, stance in (("hip-knee", thigh), ("back-neck", back))
        ]
    }


@pytest.mark.parametrize(
    ("measurements", "part"),
    [
        ([POSES, limps(0.15, 0.01)], "left thigh"),
        ([limps(0.01, -0.15), POSES], "lower back"),
        ([POSES, limps(0.15, 0.01, gait="jog")], "lower back"),
        ([POSES], "lower back"),
        ([], "left thigh"),
    ],
)
def test_the_page_opens_with_the_injury_that_limps_most(
    measurements: list[dict[str, Any]], part: str
) -> None:
    assert opening_slider(PLAYABLE, measurements) == {"part": part, "value": 7}


def test_a_page_without_sliders_opens_with_no_injury() -> None:
    assert opening_slider({"channels": []}, [POSES]) == {"part": None, "value": 0}
