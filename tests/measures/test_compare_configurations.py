"""Comparison of configurations: eq. 3.2, fitted lines, published counts, different data sets."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.measures import compare
from hobble.measures.responsivity_run import parameter_counts

SIZES = {
    "holden": (342, 512, 512, 311),
    "holden-xl": (342, 512, 512, 512, 311),
    "ava": (1302, 512, 512, 1751),
}
RELEASED = "LocomotionFlat04_000"  # a clip on which the released network was measured
CLIPS = {"holden": {"a": 0.02, RELEASED: 0.04}, "holden-xl": {"a": 0.02, RELEASED: 0.03}, "ava": {"a": 0.05}}
MODES = ("constant", "cubic")
NOT_MADE = {"applies": False, "reason": "none"}
JUDGED = {"windows": 4, "right": 0.5, "right_without_side": 0.8, "confusion": {}}
RECOGNISED = {
    "applies": True,
    "captured": {"cross_validated": JUDGED, "held_out": JUDGED},
    "generated": {**JUDGED, "by_severity": [{"severity": 10.0, "right": 0.9}]},
}


def results(name: str) -> compare.ConfigurationResults:
    """A frame takes .1 ms plus 1 ns a computation, and twice that in the mode cubic."""

    def error(mean: float | None, **more: Any) -> dict[str, Any]:
        return {"frames": 100, "mean": mean, "sd": 0.02, "position_error_cm": 1.0, **more}

    def timed(ms: float) -> dict[str, Any]:
        return {"predict": ms / 2, "total": ms, "spread": {"median": ms / 4, "p99": ms}}

    counts, clips = parameter_counts(SIZES[name]), CLIPS[name]
    modes, once = [], 0.1 + 1e-6 * counts["true"]
    for mode, ms in zip(MODES, (once, 2 * once), strict=True):
        laps = [{"lap": n, "milliseconds": timed((n + 0.5) * ms / 2)} for n in (1, 2)]
        modes.append({"mode": mode, "laps": laps, "milliseconds": timed(ms), "laps_finished": 1})
    measurements = {
        "accuracy": {
            "joints": 31,
            "train": error(float(np.mean(list(clips.values())))),
            "held_out": error(None),
            "clips": [error(mean, clip=clip, split="train") for clip, mean in clips.items()],
            "rollouts": [],
        },
        "responsivity": {
            "parameters": counts,
            "bytes_each": 4,
            "stored": {"constant": 50 * counts["true"], "cubic": 4 * counts["true"]},
            "exact": "cubic",
            "modes": modes,
        },
        "injury": NOT_MADE,
        "recognition": RECOGNISED if name == "ava" else NOT_MADE,
    }
    stages = [
        {"stage": stage, "seconds": 60.0, "bytes": 500, "rules": []} for stage in ("training", "database")
    ]
    network = {"hidden_layers": len(SIZES[name]) - 2, "units": 512, "control_points": 4}
    model = {"dataset": f"of-{name}", "channels": [], "network": network, "training": {"passes": 20}}
    history = {"pass": [1.0, 2.0], "train_mse": [0.5, 0.4]}
    pipeline = {"stages": stages, "database": {"bytes": 300}}
    return compare.ConfigurationResults(name, {"configuration": model}, measurements, pipeline, history)


@pytest.fixture(scope="module")
def published(root: Path) -> dict[str, Any]:
    return yaml.safe_load((root / "src/hobble/report/published.yaml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def compared(published: dict[str, Any]) -> dict[str, Any]:
    return dict(compare.compare_configurations(list(map(results, SIZES)), published))


def ours_of(rows: list[dict[str, Any]]) -> dict[tuple[str, str], Any]:
    """(measure, configuration) -> our number beside the published one."""
    return {(row["measure"], row["configuration"]): row["ours"] for row in rows}


def test_the_fit_recovers_the_line_of_the_frame_times(compared) -> None:
    ours, theirs = compared["milliseconds"]["fit"]
    counts = [parameter_counts(sizes)["table_6_1_as_printed"] for sizes in SIZES.values()]
    assert counts == [335_501, 598_157, 1_566_701]
    line = np.polyfit([335501, 598157, 335501, 1566701], [0.376, 0.499, 0.382, 1.55], 1)
    assert (theirs["slope"], theirs["intercept"]) == pytest.approx(line)
    times = ours_of(compared["milliseconds"]["against_published"])
    assert times["milliseconds for each computation of Table 6.1", "all"] == ours["slope"]


def test_a_pair_is_compared_by_equation_3_2_over_the_means_of_clips_and_laps(compared) -> None:
    found = {(d["a"], d["b"], d["over"]): d for d in compared["difference"]}
    # No clip is held out, and `ava` has one clip only.
    pairs = (("holden", "holden-xl"), ("holden", "ava"), ("holden-xl", "ava"))
    assert list(found) == [(*pair, "train") for pair in pairs]
    spread = 0.0002**0.5 + 0.00005**0.5  # of .02 and .04, and of .02 and .03, with n - 1
    assert found["holden", "holden-xl", "train"]["difference"] == pytest.approx(2 * 0.005 / spread)
    assert found["holden", "ava", "train"]["difference"] is None, "one clip does not spread"
    times = {(d["a"], d["b"], d["over"]): d["difference"] for d in compared["milliseconds"]["difference"]}
    assert list(times) == [(*pair, mode) for pair in pairs for mode in MODES]
    ms = [0.1 + 1e-6 * parameter_counts(SIZES[name])["true"] for name in pairs[0]]  # of laps .75 and 1.25
    assert times["holden", "holden-xl", "cubic"] == pytest.approx(2 * (ms[1] - ms[0]) / sum(ms) / 0.5**1.5)


def test_published_numbers_stand_beside_ours_of_the_same_name(compared) -> None:
    found = ours_of(compared["against_published"])
    sd = 0.0002**0.5
    assert found["standard deviation of the means of training clips", "holden"] == pytest.approx(sd)
    assert found["eq. 3.2, error", "holden to holden-xl"] == pytest.approx(0.01 / (sd + 0.00005**0.5))
    assert found["eq. 3.2, error", "holden to holden-xt"] is None
    assert found[f"relative error, {RELEASED}", "holden"] == 0.04
    assert found["database", "holden"] == 300, "of its rows, not of the stage"
    parameters = parameter_counts(SIZES["ava"])["true"]
    assert found["weights of 50 phases", "ava"] == 4 * 50 * parameters
    people = [value for (measure, _), value in found.items() if measure.startswith("hurt part")]
    assert people == [0.5, 0.8, 0.9]
    times = ours_of(compared["milliseconds"]["against_published"])
    ms = 0.1 + 1e-6 * 597_815  # mean of two laps of .75 and 1.25 times it, in the mode constant
    assert times["a frame", "holden"] == pytest.approx(ms)
    assert times["standard deviation of the means of laps", "holden"] == pytest.approx(0.5 * ms / 2**0.5)
    assert times["training, time", "holden"] == 60


def test_the_published_data_are_consistent_with_what_the_text_says_of_them(published) -> None:
    """Means and deviations of Tables 5.1 and 5.2 follow from those of the appendix, but for AVA and AVA-M."""
    series = {
        "accuracy": ("clip_means", "mean", 80, 6e-5),
        "responsivity": ("laps", "milliseconds", 19, 6e-4),
    }
    for name, (values, key, count, rounding) in series.items():
        for row in published[name]:
            means = np.array(published[values][row["configuration"]])
            assert len(means) == count
            same = np.allclose((means.mean(), means.std(ddof=1)), (row[key], row["sd"]), atol=rounding)
            assert same != ("other_figure" in row), row
    of = {name: {r["configuration"]: r for r in published[name]} for name in series}
    for row in published["differences"]:
        name = "accuracy" if row["over"] == "error" else "responsivity"
        (a, b), key = (of[name][row[side]] for side in "ab"), series[name][1]
        value = 2 * abs(a[key] - b[key]) / (a["sd"] + b["sd"])
        assert (abs(value - row["value"]) < 0.03 * row["value"]) != ("slip" in row), row
    assert {len(curve) for curve in published["curves"].values()} == {200}
