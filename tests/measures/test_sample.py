"""Estimates from a sample of clips, and their confidence intervals."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.measures.accuracy import page
from hobble.measures.accuracy.run import measure
from hobble.measures.rollouts.page import rollout_chart
from hobble.measures.rollouts.run import measure_roll_outs
from hobble.measures.sample import LEAST, Sample, Stratum, drawn
from hobble.rows.clip_rows import save_clip_rows
from hobble.rows.facts import Facts, facts, load_facts, save_facts
from hobble.rows.layout import GAITS

_spec = importlib.util.spec_from_file_location("of_accuracy", Path(__file__).with_name("test_accuracy.py"))
assert _spec is not None
assert _spec.loader is not None
_of_accuracy = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_of_accuracy)
make_rows, make_network = _of_accuracy.make_rows, _of_accuracy.make_network


def population(seed: int, count: int = 600) -> tuple[list[Facts], dict[str, str], dict[str, float]]:
    """Clips of four kinds and of any length, one in twelve held out, and the mean error of each clip."""
    rng = np.random.default_rng(seed)
    clips, values = [], {}
    for number in range(count):
        gait, hurt = ("walk", "jog")[rng.integers(2)], rng.random() < 0.3
        rows = int(rng.integers(500, 5000))
        one = Facts(f"{seed}-{number:03d}", rows, gait, float(rng.gamma(4)), ("injury",) if hurt else ())
        clips.append(one)
        values[one.clip] = (2 if gait == "jog" else 1) + hurt + 0.1 * one.speed + rng.normal(0, 0.3)
    return clips, {one.clip: "held_out" if i % 12 == 0 else "train" for i, one in enumerate(clips)}, values


def estimate(sample: Sample, split: str, values: dict[str, float]) -> float:
    rows = {name: n for s in sample.strata if s.split == split for name, n in s.drawn.items()}
    weights = [sample.weights[name] * n for name, n in rows.items()]
    return float(np.average([values[name] for name in rows], weights=weights))


def test_where_there_are_few_frames_all_clips_are_measured():
    clips, splits, _ = population(0)
    rows = sum(one.rows for one in clips)
    assert drawn(clips, splits, rows) is None
    assert drawn(clips, splits, rows - 1) is not None


def test_the_sample_is_as_large_as_asked_and_has_something_of_every_kind():
    clips, splits, _ = population(1)
    sample = drawn(clips, splits, 300_000)
    assert sample is not None
    by_name = {one.clip: one for one in clips}
    measured = dict.fromkeys(("train", "held_out"), 0)
    for stratum in sample.strata:
        kinds = {(splits[n], by_name[n].gait, by_name[n].channels) for n in stratum.drawn}
        assert len(kinds) == 1
        assert len(stratum.drawn) >= min(LEAST, stratum.clips)
        measured[stratum.split] += sum(stratum.drawn.values())
    held_out = sum(one.rows for one in clips if splits[one.clip] == "held_out")
    assert measured["held_out"] == pytest.approx(min(150_000, held_out), rel=0.25)
    assert measured["train"] == pytest.approx(300_000 - measured["held_out"], rel=0.25)
    assert sum(s.rows for s in sample.strata) == sum(one.rows for one in clips)
    assert sum(stratum.split == "train" for stratum in sample.strata) == 2 * 3 * 2


def test_one_clip_more_changes_little():
    clips, splits, _ = population(2)
    more = [*clips, Facts("another", 900, "walk", 3.0, ())]
    before = drawn(clips, splits, 300_000)
    after = drawn(more, {**splits, "another": "train"}, 300_000)
    assert before is not None
    assert after is not None
    changed = before.weights.keys() ^ after.weights.keys()
    assert len(changed) <= 0.1 * len(before.weights)


@pytest.mark.parametrize("split", ["train", "held_out"])
def test_the_interval_holds_the_truth_nearly_as_often_as_it_says(split):
    """The intervals hold in nearly 95 % of samples. Without strata or weights they hold far less often."""
    inside, off = [], []
    for seed in range(300):
        clips, splits, values = population(seed)
        sample = drawn(clips, splits, 200_000)
        assert sample is not None
        own = [one for one in clips if splits[one.clip] == split]
        truth = np.average([values[one.clip] for one in own], weights=[one.rows for one in own])
        found = estimate(sample, split, values)
        inside.append(abs(found - truth) <= sample.half_width(split, values))
        off.append(found - truth)
    assert 0.88 < np.mean(inside) < 0.99
    assert abs(np.mean(off)) < 0.3 * np.std(off)


def test_clips_that_are_all_drawn_leave_no_doubt():
    stratum = Stratum("train", 3, 60, {"a": 10, "b": 20, "c": 30})
    sample = Sample((stratum,), 3)
    assert sample.half_width("train", {"a": 1.0, "b": 5.0, "c": 9.0}) == 0
    assert set(sample.weights.values()) == {1.0}
    half = Sample((Stratum("train", 4, 40, {"a": 10, "b": 10}),), 4)
    assert half.weights == {"a": 2.0, "b": 2.0}
    # Variance of the mean of 2 of 4: (1 - 2/4) * 8 / 2.
    assert half.half_width("train", {"a": 1.0, "b": 5.0}) == pytest.approx(1.96 * 2**0.5)


@pytest.fixture
def clips(tmp_path: Path) -> dict[str, Path]:
    files = {}
    for seed, name in enumerate("abcdefgh"):
        files[name] = tmp_path / f"{name}.npz"
        save_clip_rows(files[name], make_rows(name, 20 + 5 * seed, 1, seed))
    return files


def test_accuracy_and_roll_outs_count_each_clip_for_its_kind(tmp_path, clips):
    weights = tmp_path / "w.npz"
    np.savez(weights, **make_network())
    splits = dict.fromkeys(clips, "train")
    kinds = (
        Stratum("train", 5, 300, {"a": 20, "b": 25, "c": 30}),
        Stratum("train", 3, 165, {"d": 35, "e": 40}),
    )
    sample = Sample(kinds, 8)
    whole = measure(weights, clips, splits, "holden")
    found = measure(weights, clips, splits, "holden", sample=sample)
    means = {clip["clip"]: clip["mean"] for clip in whole["clips"]}
    assert [clip["clip"] for clip in found["clips"]] == list("abcde")
    first = np.average([means[n] for n in "abc"], weights=[20, 25, 30])
    second = np.average([means[n] for n in "de"], weights=[35, 40])
    assert found["train"]["mean"] == pytest.approx((300 * first + 165 * second) / 465)
    assert found["train"]["frames"] == 150
    assert found["train"]["interval"]["mean"] == pytest.approx(sample.half_width("train", means))
    by_clips = (5 * np.mean([means[n] for n in "abc"]) + 3 * np.mean([means[n] for n in "de"])) / 8
    assert found["train"]["mean_of_clips"] == pytest.approx(by_clips)
    assert found["sample"] == {"clips": 5, "of": 8, "strata": 2}
    assert "sample" not in whole
    assert "5 of 8 clips" in page.sampled(found)
    assert page.sampled(whole) == ""

    rolled = measure_roll_outs(weights, clips, splits, "holden", lengths=(1, 4), sample=sample)
    everything = measure_roll_outs(weights, clips, splits, "holden", lengths=(1, 4))
    of_clip = {c["clip"]: c["position_error_cm"] for c in everything["lengths"][0]["clips"]}
    entry = rolled["lengths"][0]["train"]
    assert entry["interval"]["position_error_cm"] == pytest.approx(sample.half_width("train", of_clip))
    assert entry["ended"] == sum(
        c["ended"] for c in everything["lengths"][0]["clips"] if c["clip"] in "abcde"
    )
    chart = rollout_chart(rolled)
    assert chart is not None
    assert len(chart.traces[0]["error_y"]["array"]) == 2
    plain = rollout_chart(everything)
    assert plain is not None
    assert "error_y" not in plain.traces[0]


def test_facts_of_a_clip_survive_their_file(tmp_path):
    rows = make_rows("a", 30, 1, 1)
    gait = rows.x[:, rows.layout.with_channels(()).x_gait].reshape(30, len(GAITS), -1)
    gait[:] = 0
    gait[:, GAITS.index("jog")] = 1
    rows.y[:, rows.layout.y_root_velocity] = [3, 4]
    found = facts(rows)
    assert (found.clip, found.rows, found.gait, found.channels) == ("a", 30, "jog", ("injury",))
    assert found.speed == pytest.approx(5)
    save_facts(tmp_path / "a.json", found)
    assert load_facts(tmp_path / "a.json") == found
    (tmp_path / "a.json").write_text('{"clip": "a"}')
    with pytest.raises(InputError, match="not the facts of a clip"):
        load_facts(tmp_path / "a.json")
