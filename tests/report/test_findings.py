from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hobble.report.data_section import TURN_EDGES
from hobble.report.gather import ReportMaterial
from hobble.report.page import hints, key_figures


def changed(material: ReportMaterial, **changes: Any) -> ReportMaterial:
    """The material with other measurements, or with other fields."""
    fields = {key: value for key, value in changes.items() if hasattr(material, key)}
    found = {key: value for key, value in changes.items() if key not in fields}
    return replace(material, measurements={**material.measurements, **found}, **fields)


REMEDY = re.compile(r"\b(add|check|expect|keep|list|look|measure|more passes|see|train|try)\b", re.IGNORECASE)


def heads(material: ReportMaterial, **changes: Any) -> dict[str, str]:
    """Title of each hint -> its kind. Every hint about a fault says what to do."""
    found = hints(changed(material, **changes))
    assert [hint for hint in found if hint.kind in ("warn", "note") and not REMEDY.search(hint.text)] == []
    return {hint.head: hint.kind for hint in found}


def accuracy(material: ReportMaterial, held_out: float | None, train: float = 0.04) -> dict[str, Any]:
    return {**material.measurements["accuracy"], "train": {"mean": train}, "held_out": {"mean": held_out}}


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
    [(0.1, "warn", "2.5 times the"), (0.041, "good", "does not overfit"), (0.052, "fact", "1.30 times")],
)
def test_the_gap_to_held_out_clips_gives_the_right_hint(
    material: ReportMaterial, held_out: float, kind: str, words: str
) -> None:
    found = heads(material, accuracy=accuracy(material, held_out))
    assert [k for head, k in found.items() if words in head] == [kind]


def test_a_rising_falling_or_flat_curve_gives_the_right_hint(material: ReportMaterial) -> None:
    rising = history([1.0, 0.5, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
    assert "The held-out error was lowest in pass 2 and has risen since." in heads(material, history=rising)
    falling = history([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])
    assert any("still fell by 36 %" in head for head in heads(material, history=falling))
    assert heads(material, history=history([0.3] * 8))["The held-out error has stopped falling."] == "good"
    with_the_rate = {"configuration": {"training": {"schedule": "cosine"}}}
    for losses in (falling, history([0.3] * 8)):  # the learning rate has reached its end
        found = heads(material, history=losses, resolved=with_the_rate)
        assert not any("still fell" in head or "stopped falling" in head for head in found)
    assert "The held-out error was lowest in pass 2 and has risen since." in heads(
        material, history=rising, resolved=with_the_rate
    )
    noisy = history([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.28, 0.32])  # the last section is no trend
    assert heads(material, history=noisy)["The held-out error has stopped falling."] == "good"


def test_missed_waypoints_flips_and_ineffective_links_are_reported(material: ReportMaterial) -> None:
    missed = {**material.measurements["responsivity"], "largest_turn_degrees": 175.0}
    found = heads(material, responsivity=missed)
    assert found["The character reached 113 of 114 waypoints."] == "warn"
    assert found["A joint turned by 175 degrees in one frame."] == "warn"
    deaf = {"applies": True, "responses": [swept("a-b", True, 0.1, 0.0)]}
    assert "1 of 1 hurt links hardly change the walk at severity 10" in heads(material, injury=deaf)


def swept(link: str, trained: bool, pose: float, left: float, rho: float = 1.0) -> dict[str, Any]:
    measures = {"from_healthy_cm": pose, "after_healing_cm": left, "spearman": {"from_healthy": rho}}
    return {"gait": "walk", "link": link, "trained": trained, **measures}


def test_links_never_hurt_in_training_only_show_the_drift_of_the_walk(material: ReportMaterial) -> None:
    drift = swept("never", False, 10.0, 7.0)
    like_it = {"responses": [drift, swept("hurt", True, 11.0, 6.5, 0.3)]}
    found = heads(material, injury=like_it)
    assert found["Even a healthy walk changes, by 10.0 cm per joint."] == "warn"
    assert "1 of 1 hurt links hardly change the walk at severity 10" in found
    assert not [head for head in found if "does not recover" in head]
    caught = {"responses": [swept("never", False, 0.1, 0.1), swept("hurt", True, 11.0, 6.5)]}
    found = heads(material, injury=caught)
    assert "The walk does not recover after these links have healed: hurt." in found
    head = "1 of 2 links were hurt in training."
    assert found[head] == "good"
    texts = {hint.head: hint.text for hint in hints(changed(material, injury=caught))}
    assert texts[head].startswith("At severity 10, each changes the walk by 11.0 cm per joint. A link is")


def test_the_time_of_a_frame_is_a_median(material: ReportMaterial) -> None:
    times = {"predict": 0.17, "total": 0.17, "spread": {"median": 0.025, "p99": 0.163}}
    slow = changed(
        material, name="holden", responsivity={**material.measurements["responsivity"], "milliseconds": times}
    )
    figure = next(f for f in key_figures(slow) if f.label == "Time per frame")
    assert (figure.value, figure.unit) == ("0.025", "ms")
    assert "667 characters" in figure.note
    assert "mean 0.17 ms, published mean 0.376 ms" in figure.note
    assert (
        next(kind for head, kind in heads(slow).items() if head.startswith("A frame takes 0.1 %")) == "good"
    )


def test_key_figures_without_results(material: ReportMaterial) -> None:
    bare = changed(
        material, accuracy={}, responsivity={}, injury={}, pipeline={}, history={}, motion=[], labels=[]
    )
    assert [f.label for f in key_figures(bare)] == ["Network"]
    assert [hint.head for hint in hints(bare)] == ["No clips were held out."]


def test_missing_data_comes_before_longer_training(material: ReportMaterial) -> None:
    """If nobody stands in the clips and the error still falls, the hint on the clips comes first."""
    labels = [{"clip": "a", "seconds": {"walk": 30.0}, "curves": {}}]
    falling = history([0.5 * 0.9**k for k in range(20)])
    found = list(heads(material, labels=labels, history=falling))
    missing = next(k for k, head in enumerate(found) if head.startswith("Nobody stands"))
    longer = next(k for k, head in enumerate(found) if "still fell" in head)
    assert missing < longer
    standing = [{"clip": "a", "seconds": {"walk": 30.0, "stand": 5.0}, "curves": {}}]
    assert not any("Nobody stands" in head for head in heads(material, labels=standing, history=falling))


def test_clips_without_turns_are_reported(material: ReportMaterial) -> None:
    """A hundred seconds straight on, and some that turn by 50 degrees a second."""
    middles = (TURN_EDGES[:-1] + TURN_EDGES[1:]) / 2

    def said(seconds: float) -> bool:
        straight = np.where(np.abs(middles) < 20, 50.0, 0.0)
        turns = {"train": straight[:, None], "held_out": np.where(middles == 50, seconds, 0.0)[:, None]}
        return any("Hardly anybody turns" in hint.head for hint in hints(material, turns))

    assert said(0.0)
    assert said(0.9)
    assert not said(1.5)
    assert not any("turns" in hint.head for hint in hints(material, {"train": 0.0 * middles[:, None]}))
