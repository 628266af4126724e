"""Comparison of configurations: eq. 3.2, fitted lines, published counts, different data sets."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hobble.core.errors import InputError
from hobble.core.files import write_csv
from hobble.measures.compare import compare_configurations, comparison_tables, read_results
from hobble.measures.responsivity_run import parameter_counts

SIZES = {
    "holden": (342, 512, 512, 311),
    "holden-xl": (342, 512, 512, 512, 311),
    "ava": (1302, 512, 512, 1751),
}
MODES = ("constant", "cubic")
ROLLED = {split: {"frames": 5, "last_cm": 2.0} for split in ("train", "held_out")}
JUDGED = {
    "windows": 4,
    "right": 0.75,
    "right_without_side": 0.8,
    "confusion": {"knee": {"knee": 3, "healthy": 1}},
}
RECOGNISED = {
    "applies": True,
    "captured": {"cross_validated": JUDGED, "held_out": JUDGED},
    "generated": {**JUDGED, "right": 0.5, "by_severity": [{"severity": 10.0, "right": 0.9}]},
}


@pytest.fixture
def published(root: Path) -> dict[str, Any]:
    return yaml.safe_load((root / "src/hobble/report/published.yaml").read_text(encoding="utf-8"))


def spread(mean: float, sd: float, frames: int = 100) -> dict[str, Any]:
    return {"frames": frames, "mean": mean, "sd": sd, "position_error_cm": 1.0, "mean_of_clips": mean}


def timed(ms: float) -> dict[str, Any]:
    steps = dict.fromkeys(("prepare", "input", "insert", "output", "update"), 0.0)
    return {
        **steps,
        "predict": ms / 2,
        "total": ms,
        "spread": {"sd": 0.1, "median": ms / 4, "p99": ms, "whole_call": ms},
        "sd": {**steps, "predict": 0.1},
    }


def left_behind(folder: Path, name: str, clips: dict[str, float], sizes: tuple[int, ...]) -> list[Any]:
    """The arguments of `read_results` for a configuration whose frame takes .1 ms plus 1 ns a computation."""
    counts = parameter_counts(sizes)
    modes = []
    for k, mode in enumerate(MODES, 1):
        ms = timed(k * (0.1 + 1e-6 * counts["true"]))
        laps = [
            {
                "lap": n,
                "milliseconds": {**ms, "total": (n + 0.5) * ms["total"] / 2},
            }
            for n in (1, 2)
        ]
        modes.append({"mode": mode, "laps": laps, "milliseconds": ms, "laps_finished": 1})
    files: dict[str, Any] = {
        "accuracy": {
            "joints": 31,
            "train": spread(np.mean(list(clips.values())), 0.02),
            "held_out": {"frames": 0, "mean": None, "sd": None, "mean_of_clips": None},
            "clips": [{"clip": c, "split": "train", **spread(m, 0.01)} for c, m in clips.items()],
        },
        "responsivity": {
            "parameters": counts,
            "bytes_each": 4,
            "stored": {
                "constant": 50 * counts["true"],
                "linear": 10 * counts["true"],
                "cubic": 4 * counts["true"],
            },
            "exact": MODES[-1],
            "modes": modes,
            **modes[-1],
        },
        "rollouts": {"lengths": [{"length": n, **ROLLED, "clips": []} for n in (1, 60)]},
        "injury": {"applies": False, "reason": "none"},
        "recognition": RECOGNISED if name == "ava" else {"applies": False, "reason": "none"},
        "pipeline": {
            "stages": [
                {"stage": "training", "seconds": 60.0, "bytes": 9, "rules": []},
                {"stage": "database", "seconds": 7.0, "bytes": 500, "rules": []},
            ],
            "database": {"bytes": 300},
        },
    }
    folder = folder / name
    folder.mkdir()
    paths = {key: folder / f"{key}.json" for key in files}
    for key, value in files.items():
        paths[key].write_text(json.dumps(value))
    paths["configuration"], paths["history"] = folder / "configuration.yaml", folder / "history.csv"
    network = {"hidden_layers": len(sizes) - 2, "units": 512, "control_points": 4}
    model = {"dataset": f"of-{name}", "channels": [], "network": network, "training": {"passes": 20}}
    paths["configuration"].write_text(yaml.safe_dump({"configuration": model}))
    blocks = "pass,train_mse,held_out_turn" if name == "ava" else "pass,train_mse,held_out_mse"
    paths["history"].write_text(f"{blocks}\n1,0.5,0.25\n2,0.4,\n")
    folders = [paths.pop(key) for key in ("configuration", "pipeline", "history")]
    return [name, *folders, list(paths.values())]


@pytest.fixture
def compared(tmp_path: Path, published: dict[str, Any]) -> dict[str, Any]:
    clips = {"holden": {"a": 0.04, "b": 0.02}, "holden-xl": {"a": 0.03, "b": 0.02}, "ava": {"b": 0.05}}
    found = [read_results(*left_behind(tmp_path, n, clips[n], s)) for n, s in SIZES.items()]
    return compare_configurations(found, published)


def test_the_fit_recovers_the_line_of_the_frame_times(compared) -> None:
    fits = {(f["whose"], f["mode"], f["step"], f["computations"]): f for f in compared["milliseconds"]["fit"]}
    ours = fits["hobble", "cubic", "median", "true"]  # a quarter of twice .1 ms and 1 ns a computation
    assert (ours["slope"], ours["intercept"]) == pytest.approx((0.5e-6, 0.05))
    assert (ours["r2"], ours["points"]) == (pytest.approx(1), 3)
    theirs = fits["published", None, "total", "table_6_1_as_printed"]
    slope, intercept = np.polyfit([335501, 598157, 335501, 1566701], [0.376, 0.499, 0.382, 1.55], 1)
    assert (theirs["slope"], theirs["intercept"]) == pytest.approx((slope, intercept))
    assert theirs["points"] == 4


def test_a_pair_is_compared_on_the_clips_that_both_have(compared) -> None:
    found = {(d["a"], d["b"], d["over"]): d["difference"] for d in compared["difference"]}
    # No clip is held out, and `ava` has no clip `a`.
    assert set(found) == {
        *(("holden", "holden-xl", over) for over in ("train", "a", "b")),
        *((a, "ava", over) for a in ("holden", "holden-xl") for over in ("train", "b")),
    }
    assert found["holden", "holden-xl", "a"] == pytest.approx(2 * 0.01 / 0.02)
    assert found["holden", "holden-xl", "b"] == 0
    assert found["holden", "ava", "train"] == pytest.approx(2 * 0.02 / 0.04)
    times = {(d["a"], d["b"], d["over"]): d["difference"] for d in compared["milliseconds"]["difference"]}
    assert len(times) == 3 * len(MODES)
    apart = 1e-6 * (860_471 - 597_815)
    assert times["holden", "holden-xl", "cubic"] == pytest.approx(2 * 2 * apart / 0.2)


def test_equation_3_2_divides_by_the_deviations_of_frames_and_of_means(compared) -> None:
    found = {(d["a"], d["b"], d["over"]): d for d in compared["difference"]}
    row = found["holden", "holden-xl", "train"]  # clips of .04 and .02, and of .03 and .02
    assert (row["sd_of_means_a"], row["sd_of_means_b"]) == pytest.approx((0.0002**0.5, 0.00005**0.5))
    assert row["difference"] == pytest.approx(2 * 0.005 / 0.04)
    assert row["difference_of_means"] == pytest.approx(2 * 0.005 / (0.0002**0.5 + 0.00005**0.5)), "n - 1"
    assert found["holden", "ava", "train"]["difference_of_means"] is None, "one clip does not spread"
    ours = {
        (r["measure"], r["configuration"]): (r["published"], r["ours"]) for r in compared["against_published"]
    }
    what = "standard deviation of the means of training clips"
    assert ours[what, "holden"] == (0.00954, pytest.approx(0.0002**0.5))
    assert ours["eq. 3.2, error", "holden to holden-xl"] == (0.0093, row["difference_of_means"])
    assert ours["eq. 3.2, error", "holden to holden-xt"] == (0.072, None)
    assert ours["database", "holden"] == (7.12e9, 300), "of its rows, not of the stage"
    parameters = parameter_counts(SIZES["ava"])["true"]
    assert ours["weights of 50 phases", "ava"] == (374e6, 4 * 50 * parameters)
    assert ours["parameters of a phase", "ava"] == (parameters, parameters)


def test_published_times_are_those_of_whole_laps_in_the_mode_constant(compared) -> None:
    """Two laps of .75 and 1.25 times .1 ms plus 1 ns a computation."""
    rows = {(r["measure"], r["configuration"]): r for r in compared["milliseconds"]["against_published"]}
    ms = 0.1 + 1e-6 * 597_815
    assert rows["a frame", "holden"]["ours"] == pytest.approx(ms)
    what = "standard deviation of the means of laps"
    assert rows[what, "holden"]["ours"] == pytest.approx(0.5 * ms / 2**0.5)
    assert rows["eq. 3.2, milliseconds", "holden-xt to ava"]["other_figure"] == "39; 36 is of XL"
    regression = rows["milliseconds for each computation of Table 6.1", "all"]
    assert (regression["published"], regression["unit"]) == (9.6e-7, "")
    counts = [335_501, 598_157, 1_566_701]
    times = [0.1 + 1e-6 * parameter_counts(sizes)["true"] for sizes in SIZES.values()]
    assert regression["ours"] == pytest.approx(np.polyfit(counts, times, 1)[0])


def test_the_published_data_are_consistent_with_what_the_text_says_of_them(published) -> None:
    """Means and deviations of Tables 5.1 and 5.2 follow from those of the appendix, but for AVA and AVA-M."""
    for row in published["accuracy"]:
        means = np.array(published["clip_means"][row["configuration"]])
        assert len(means) == 80
        same = np.allclose((means.mean(), means.std(ddof=1)), (row["mean"], row["sd"]), atol=6e-5)
        assert same != ("other_figure" in row)
    for row in published["responsivity"]:
        laps = np.array(published["laps"][row["configuration"]])
        same = np.allclose((laps.mean(), laps.std(ddof=1)), (row["milliseconds"], row["sd"]), atol=6e-4)
        assert same != ("other_figure" in row)
        assert len(laps) == 19
    of = {name: {r["configuration"]: r for r in published[name]} for name in ("accuracy", "responsivity")}
    for row in published["differences"]:
        a, b = (of["accuracy" if row["over"] == "error" else "responsivity"][row[key]] for key in "ab")
        key = "mean" if row["over"] == "error" else "milliseconds"
        value = 2 * abs(a[key] - b[key]) / (a["sd"] + b["sd"])
        assert (abs(value - row["value"]) < 0.03 * row["value"]) != ("slip" in row), row
    assert {len(curve) for curve in published["curves"].values()} == {200}


def test_tables_with_different_columns_survive_csv(compared, tmp_path) -> None:
    found = comparison_tables(compared)
    rows = {}
    for name, table in found.items():
        write_csv(tmp_path / f"{name}.csv", table)
        with open(tmp_path / f"{name}.csv", newline="") as file:
            rows[name] = list(csv.DictReader(file))
        assert len(rows[name]) == len(table), name
        assert table or name == "field", f"{name} is empty"
    assert [r["configuration"] for r in rows["configurations"]] == list(SIZES)
    assert [r["computations_true"] for r in rows["configurations"]] == ["597815", "860471", "1828055"]
    clips = [(r["configuration"], r["clip"]) for r in rows["accuracy"]]
    assert clips[2:] == [("holden-xl", "a"), ("holden-xl", "b"), ("ava", "b")]
    assert [(r["mode"], r["lap"]) for r in rows["responsivity"]] == [
        (m, lap) for _ in SIZES for m in MODES for lap in "12"
    ]
    assert float(rows["responsivity"][0]["milliseconds_sd_predict"]) == 0.1
    lengths = [(r["length"], r["split"]) for r in rows["rollouts"]]
    assert lengths == 3 * [("1", "train"), ("1", "held_out"), ("60", "train"), ("60", "held_out")]
    last = rows["training"][-2:]
    assert [r["held_out_turn"] for r in last] == ["0.25", ""]
    assert [r["held_out_mse"] for r in last] == ["", ""]
    json.dumps(compared, allow_nan=False)


def test_published_clips_are_listed_with_ours_of_the_same_name(tmp_path, published) -> None:
    clips = {"LocomotionFlat04_000": 0.03, "LocomotionFlat04_000_mirror": 0.07, "walk": 0.05}
    found = compare_configurations(
        [read_results(*left_behind(tmp_path, "a", clips, SIZES["holden"]))], published
    )
    rows = [r for r in found["against_published"] if "LocomotionFlat04" in r["measure"]]
    assert [(r["source"], r["published"], r["ours"]) for r in rows] == [("release", 0.0396, 0.03)]


def test_a_damaged_history_is_named(tmp_path) -> None:
    files = left_behind(tmp_path, "holden", {"a": 0.1}, SIZES["holden"])
    Path(files[3]).write_text("pass,train_mse\n1,half\n")
    with pytest.raises(InputError, match=r"history\.csv"):
        read_results(*files)
