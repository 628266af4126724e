"""Recognising moods and diagnoses: whole people left out, values of two channels at once, what is shown."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas
import pytest

from hobble.channels import channel
from hobble.measures import manners as page
from hobble.measures import manners_run as module
from hobble.measures.manners_run import NONE, captured_windows, recognise_left_out
from hobble.measures.windows import STEP, USED, WINDOW, Window
from hobble.models.network import Network
from hobble.report.parts import Paragraph
from hobble.rows.clip_rows import Captured
from hobble.runtime.options import Runtime
from tests.measures.made_up import captured_walk

FRAMES = 300


@pytest.fixture
def both(hurtable) -> Network:
    """A network of random weights with 25 severities and five moods, all of which were seen in training."""
    links = hurtable.channels["injury"][:25]
    layout = replace(hurtable.layout, channels=(("injury", 25), ("mood", 5)))
    moods = channel("mood").columns(hurtable.skeleton)
    return replace(hurtable, layout=layout, channels={"injury": links, "mood": moods})


def clip(
    network: Network, name: str, mood: str | None, *, lean: float, hurt: float = 0.0, value: float = 1.0
):
    """A captured clip of a figure that glides straight ahead; its trunk leans forward by `lean` cm."""
    skeleton, rng = network.skeleton, np.random.default_rng(sum(map(ord, name)))
    local = np.tile(network.y_mean[network.layout.y_joint_position].reshape(-1, 3), (FRAMES, 1, 1))
    local = local + rng.normal(0, 0.3, local.shape)
    local[:, [skeleton.role("neck"), skeleton.role("head")], 2] += lean
    channels = {key: np.zeros((FRAMES, len(columns))) for key, columns in network.channels.items()}
    channels["injury"][150:, 0] = hurt
    if mood:
        channels["mood"][:, network.channels["mood"].index(mood)] = value
    return captured_walk(name, local, channels)


@pytest.fixture
def motion(both: Network) -> list[Captured]:
    leans = {None: 0.0, "sad": 12.0, "old": 30.0}
    return [clip(both, f"{m}-{n}", m, lean=lean + n) for m, lean in leans.items() for n in (1, 2, 3)]


def measure(network: Network, motion: Sequence[Captured], people: Mapping[str, str] | None = None) -> Any:
    splits = {one.clip: "train" for one in motion}
    who = people or {one.clip: one.clip for one in motion}
    return module.measure_manners(network, motion, splits, who, Runtime())


def test_windows_with_an_injury_or_half_a_mood_are_left_out(both: Network) -> None:
    whole = (FRAMES - WINDOW) // STEP + 1
    found = captured_windows(clip(both, "a", "sad", lean=0), both, "mood")
    assert [w.label for w in found] == ["sad"] * whole
    found = captured_windows(clip(both, "a", "sad", lean=0, hurt=3.0), both, "mood")
    assert len(found) == (150 - WINDOW) // STEP + 1
    assert captured_windows(clip(both, "a", "sad", lean=0, value=0.5), both, "mood") == []


def window(who: str, manner: str, *values: float) -> Window:
    return Window(who, manner, dict(enumerate(map(float, values))))


def test_whole_people_are_left_out() -> None:
    """Each clip is like the other clip of its person and unlike all others."""
    rng = np.random.default_rng(2)
    windows, people = [], {}
    for person in range(12):
        own, manner = rng.normal(0, 1, 6), "sad" if person % 2 else NONE
        for take in (1, 2):
            name = f"{person}-{take}"
            people[name] = str(person)
            windows += [window(name, manner, *(own + rng.normal(0, 0.02, 6))) for _ in range(20)]
    by_clip = recognise_left_out(windows, {name: name for name in people}, [0.6])
    by_person = recognise_left_out(windows, people, [0.6])
    assert by_clip["people"] == 24
    assert by_person["people"] == 12
    assert by_person["people_of"] == {NONE: 6, "sad": 6}
    assert by_clip["windows"] == by_person["windows"] == 480
    assert by_clip["right"] > by_person["right"] + 0.2


def test_each_manner_is_tried_with_each_column_of_another_channel(
    both: Network, motion: list[Captured], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Captured windows stand for the generated figures: those of the right mood, and at one link those of no
    mood.
    """
    real = {
        m: [w.values for w in captured_windows(clip(both, f"{m}-9", m, lean=lean), both, "mood")]
        for m, lean in LEANS
    }
    walked: list[Any] = []
    broken = both.channels["injury"][3]

    def generated_values(network: Network, walks: Sequence[Any], runtime: Runtime, features: Any):
        walked.extend(walks)
        moods = [next(iter(channels["mood"]), None) for channels, _ in walks]
        lost = [broken in channels.get("injury", {}) for channels, _ in walks]
        return [real[None if gone else mood] for mood, gone in zip(moods, lost, strict=True)]

    monkeypatch.setattr(module, "generated_values", generated_values)
    [found] = measure(both, motion)["channels"]
    assert found["manners"] == ["old", "sad"]
    assert found["captured"]["right"] == 1.0
    assert found["captured"]["shrinkage"] == 0.6, "of equals the largest"
    assert found["right_at_1"] == 1.0
    rows = found["together"]
    assert len(rows) == 3 * 25
    assert {r["column"] for r in rows if r["share"] != 1.0} == {broken}
    assert [r["share"] for r in rows if r["column"] == broken] == [1.0, 0.0, 0.0]
    hurt = [(channels, speed) for channels, speed in walked if "injury" in channels]
    assert {value for channels, _ in hurt for value in channels["injury"].values()} == {10.0}
    assert [speed for _, speed in hurt] == pytest.approx([2.0] * 75, rel=1e-3)
    effect = found["effects"][2]
    assert (effect["manner"], effect["effect"]) == ("old", "trunk")
    rest = both.y_mean[both.layout.y_joint_position].reshape(-1, 3)
    neck, hips = (rest[both.skeleton.role(part)] for part in ("neck", "hips"))

    def lean(cm: float) -> float:
        return float(np.degrees(np.arctan2(neck[2] + cm - hips[2], neck[1] - hips[1])))

    assert effect["captured"] == pytest.approx(lean(32) - lean(2), abs=0.2)
    assert effect["generated"] == effect["generated_at_half"] == pytest.approx(lean(31) - lean(1), abs=0.2)


LEANS = ((None, 1.0), ("sad", 13.0), ("old", 31.0))


def test_a_network_walks_in_every_manner_and_mixture(both: Network, motion: list[Captured]) -> None:
    [found] = measure(both, motion)["channels"]
    per = (USED - WINDOW) // STEP + 1
    assert [row["windows"] for row in found["generated"]] == [3 * per] * 6
    assert [row["manners"] for row in found["generated"]] == [
        [], ["old"], ["sad"], ["old"], ["sad"], ["old", "sad"],
    ]  # fmt: skip
    assert "between" in found["generated"][-1]
    places = (pandas.Series(place) for place in ([3.0, 1.0], [0.0, 0.0], [4.0, 0.0]))
    assert module._position_between(*places) == 0.75, "nearer to the second"
    shown = page.section({"applies": True, "channels": [found]}, SimpleNamespace(network={"skeleton": {}}))
    assert shown.title == "Mood"
    assert len({part.content.name for part in shown.parts if not isinstance(part.content, Paragraph)}) == 6


def test_missing_results_are_explained(hurtable, both: Network, motion: list[Captured]) -> None:
    assert measure(hurtable, [])["reason"] == module.NO_MANNERS
    assert measure(both, motion[:6:2])["reason"] == module.TOO_FEW
    assert page.section(measure(hurtable, []), SimpleNamespace(network={"skeleton": {}})).parts == []
