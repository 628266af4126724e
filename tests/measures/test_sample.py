"""Estimates from a sample of clips, and their confidence intervals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.measures.accuracy import roll_out_chart
from hobble.measures.accuracy_run import measure_accuracy
from hobble.measures.sample import Drawn, Sample, draw_sample
from hobble.rows import clip_rows
from hobble.rows.clip_rows import Excerpt, ExcerptKind, RowsSummary, load_excerpt, save_clip_rows
from tests.measures.made_up import made_up_inputs, random_rows


def population(
    seed: int, count: int = 600, rows: tuple[int, int] = (500, 5000)
) -> tuple[list[RowsSummary], dict[str, str], dict[Excerpt, float]]:
    """Clips of four kinds and of any length, one in twelve held out, and the mean error of each excerpt.

    Half of the spread within a kind is that of clips, so excerpts of one clip resemble each other.
    """
    rng = np.random.default_rng(seed)
    clips, values = [], {}
    for number in range(count):
        gait, hurt = ("walk", "jog")[rng.integers(2)], rng.random() < 0.3
        name, length, speed = f"{seed}-{number:03d}", int(rng.integers(*rows)), rng.gamma(4)
        own = rng.normal(0, 0.2)
        kinds = []
        for one in clip_rows.cut_into_excerpts(name, length):
            kinds.append(ExcerptKind(gait, float(speed * rng.uniform(0.9, 1.1)), ("injury",) if hurt else ()))
            values[one] = (2 if gait == "jog" else 1) + hurt + 0.1 * speed + own + rng.normal(0, 0.2)
        clips.append(RowsSummary(name, length, tuple(kinds)))
    return clips, {one.clip: "held_out" if i % 12 == 0 else "train" for i, one in enumerate(clips)}, values


def test_the_sample_has_the_requested_size_and_half_of_it_is_held_out():
    clips, splits, _ = population(1)
    total = sum(one.rows for one in clips)
    assert draw_sample(clips, splits, total) is None, "all clips are measured"
    assert draw_sample(clips, splits, total - 1) is not None
    drawn = draw_sample(clips, splits, 300_000).splits
    rows = {split: sum(one.rows for one in of.drawn) for split, of in drawn.items()}
    held_out = sum(one.rows for one in clips if splits[one.clip] == "held_out")
    assert rows["held_out"] == pytest.approx(min(150_000, held_out), rel=0.1)
    assert rows["train"] == pytest.approx(300_000 - rows["held_out"], rel=0.1)
    assert sum(of.rows for of in drawn.values()) == total


def test_the_interval_contains_the_true_mean_about_as_often_as_stated():
    """The intervals hold in nearly 95 % of samples, although excerpts of a clip resemble each other."""
    inside, off = {"train": [], "held_out": []}, {"train": [], "held_out": []}
    for seed in range(80):
        clips, splits, values = population(seed, 48, (20_000, 60_000))
        for split, drawn in draw_sample(clips, splits, 200_000).splits.items():
            own = [one for one in values if splits[one.clip] == split]
            truth, found = (
                np.average([values[one] for one in some], weights=[one.rows for one in some])
                for some in (own, drawn.drawn)
            )
            inside[split].append(abs(found - truth) <= drawn.confidence_half_width(values))
            off[split].append(found - truth)
    for split in inside:
        assert 0.88 < np.mean(inside[split]) < 0.99
        assert abs(np.mean(off[split])) < 0.3 * np.std(off[split])


def test_excerpts_cover_a_clip_once_and_are_read_as_they_are(tmp_path):
    rows = random_rows("a", 2500, 2, 5)
    rows.fits[::3] = 1
    rows = replace(rows, heights=rows.heights[: rows.fits.sum()], mean=rows.mean[: rows.fits.sum()])
    save_clip_rows(tmp_path / "a.npz", rows)
    parts = clip_rows.cut_into_excerpts("a", 2500)
    assert [one.first for one in parts] == [0, 833, 1666]
    read = [load_excerpt(tmp_path / "a.npz", one) for one in parts]
    for name in ("x", "y", "p", "frame", "cycle", "fits", "heights", "mean"):
        joined = np.concatenate([getattr(part, name) for part in read])
        np.testing.assert_array_equal(joined, getattr(rows, name), name)
    injury = np.concatenate([part.channels["injury"] for part in read])
    np.testing.assert_array_equal(injury, rows.channels["injury"])
    around = load_excerpt(tmp_path / "a.npz", parts[1], before=2, after=900)
    np.testing.assert_array_equal(around.y, rows.y[831:])
    with pytest.raises(InputError, match="as many rows as its summary"):
        load_excerpt(tmp_path / "a.npz", Excerpt("a", 2400, 200, 2600))


def flat(clip):
    """The measures of a clip without those of its first positions, which a sample does not have."""
    return pytest.approx({key: value for key, value in clip.items() if key != "as_published"})


def test_accuracy_and_roll_outs_of_a_sample_have_intervals(tmp_path: Path):
    rows = {name: 20 + 5 * i for i, name in enumerate("abcdefgh")}
    clips = {name: random_rows(name, count, 1, seed) for seed, (name, count) in enumerate(rows.items())}
    inputs = made_up_inputs(tmp_path, clips)
    chosen = tuple(Excerpt(name, 0, rows[name], rows[name]) for name in "abcde")
    sample = Sample({"train": Drawn(chosen, 8, sum(rows.values()))}, 8)
    everything = measure_accuracy(inputs, lengths=(1, 4))
    found = measure_accuracy(inputs, sample=sample, lengths=(1, 4))
    means = {clip["clip"]: clip["mean"] for clip in everything["clips"]}
    assert found["clips"] == [flat(clip) for clip in everything["clips"][:5]]
    expected = np.average([means[n] for n in "abcde"], weights=[rows[n] for n in "abcde"])
    assert found["train"]["mean"] == pytest.approx(expected)
    width = sample.splits["train"].confidence_half_width({one: means[one.clip] for one in chosen})
    assert found["train"]["interval"]["mean"] == pytest.approx(width)
    assert found["sample"] == {"excerpts": 5, "of_excerpts": 8, "clips": 5, "of": 8}
    assert "sample" not in everything
    entries = everything["rollouts"][0]["clips"]
    of_clip = {one: entries[i]["position_error_cm"] for i, one in enumerate(chosen)}
    width = sample.splits["train"].confidence_half_width(of_clip)
    assert found["rollouts"][0]["train"]["interval"]["position_error_cm"] == pytest.approx(width)
    chart = roll_out_chart(found)
    assert len(chart.traces[0]["error_y"]["array"]) == 2
    assert "5 of 8 excerpts" in chart.caption


def test_all_excerpts_of_a_clip_together_measure_what_the_clip_does(tmp_path):
    """Roll-outs that begin in an excerpt go on after it, so none is cut short but at the end of the clip."""
    inputs = made_up_inputs(tmp_path, {"a": random_rows("a", 120, 1, 3)})
    parts = [Excerpt("a", 40 * i, 40, 120) for i in range(3)]
    sample = Sample({"train": Drawn(tuple(parts), 3, 120)}, 1)
    cut, uncut = measure_accuracy(inputs, None, sample, (1, 20)), measure_accuracy(inputs, lengths=(1, 20))
    assert cut["clips"] == [flat(uncut["clips"][0])]
    (one, twenty), (of_one, of_twenty) = cut["rollouts"], uncut["rollouts"]
    assert one["clips"] == [pytest.approx(of_one["clips"][0])]
    # Starts in steps of 10: at 1, 11, ... in the clip, at 1, 11, ..., 40, 50, ..., 80, ... in the excerpts.
    assert (of_twenty["train"]["ended"], twenty["train"]["ended"]) == (10, 4 + 4 + 2)
