from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from hobble.report.findings import hints, key_figures
from hobble.report.gather import Material


def heads(material: Material, **changes: Any) -> dict[str, str]:
    """Head of each hint -> its kind."""
    return {hint.head: hint.kind for hint in hints(replace(material, **changes))}


def accuracy(material: Material, held_out: float | None, train: float = 0.04) -> dict[str, Any]:
    return {**material.accuracy, "train": {"mean": train}, "held_out": {"mean": held_out}}


def history(losses: list[float]) -> dict[str, list[float | None]]:
    n = len(losses)
    return {
        "pass": [1.0 + i // 2 for i in range(n)],
        "section": [1.0 + i % 2 for i in range(n)],
        "train_mse": list(losses),
        "held_out_mse": list(losses),
    }


@pytest.mark.parametrize(
    ("held_out", "kind", "words"),
    [(0.1, "warn", "2.5 times worse"), (0.041, "good", "about as well"), (0.052, "note", "1.30 times")],
)
def test_generalisation(material: Material, held_out: float, kind: str, words: str) -> None:
    found = heads(material, accuracy=accuracy(material, held_out))
    assert [k for head, k in found.items() if words in head] == [kind]


def test_nothing_held_out(material: Material) -> None:
    assert heads(material, accuracy=accuracy(material, None))["Nothing was held out."] == "warn"


def test_curve_that_rises_falls_or_rests(material: Material) -> None:
    rising = history([1.0, 0.5, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
    assert "The held-out error was lowest in pass 2 and has risen since." in heads(material, history=rising)
    falling = history([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])
    assert any("still falling, by 36 %" in head for head in heads(material, history=falling))
    assert heads(material, history=history([0.3] * 8))["Training has settled."] == "good"
    noisy = history([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.28, 0.32])  # the last section is no trend
    assert heads(material, history=noisy)["Training has settled."] == "good"


def test_waypoints_flips_and_links_that_do_nothing(material: Material) -> None:
    missed = {**material.responsivity, "largest_turn_degrees": 175.0}
    found = heads(material, responsivity=missed)
    assert found["The character reached 113 of 114 waypoints."] == "warn"
    assert found["A joint turned by 175 degrees in one frame."] == "warn"
    deaf = {"applies": True, "responses": [{"gait": "walk", "link": "a-b", "from_healthy_cm": 0.1}]}
    assert "1 of 1 link hardly changes the walk at severity 10" in heads(material, injury=deaf)


def test_most_pressing_first(material: Material) -> None:
    kinds = [hint.kind for hint in hints(material)]
    assert kinds == sorted(kinds, key=["warn", "note", "good"].index)


def test_key_figures_stand_beside_the_published(material: Material) -> None:
    figures = {f.label: f for f in key_figures(replace(material, name="holden"))}
    assert "HOLDEN was published at 4.39 %" in figures["Error on held-out clips"].beside
    assert "published 0.376 ms" in figures["Time for a frame"].beside
    assert figures["Network"].beside.startswith("parameters a phase: 372–16–16–311")


def test_figures_of_almost_nothing(material: Material) -> None:
    bare = replace(
        material, accuracy={}, responsivity={}, injury={}, pipeline={}, history={}, motion=[], labels=[]
    )
    assert [f.label for f in key_figures(bare)] == ["Network"]
    assert [hint.head for hint in hints(bare)] == ["Nothing was held out."]
