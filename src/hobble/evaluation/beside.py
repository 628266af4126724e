"""The published figures as rows, each with ours beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hobble.evaluation.measured import COUNTS, Measured, by_mode, describe, of_stage


def beside(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Published figures with ours, where a configuration of the name is among those compared."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["accuracy"]:
        m = found.get(row["configuration"])
        for split in ("train", "held_out"):
            ours = m.accuracy[split]["mean_of_clips"] if m else None
            out.append(_row(f"relative error, {split} clips", row, row["mean"], ours, ""))
    for row in published["clips"]:
        for m in all_measured:
            for clip in m.accuracy["clips"]:
                if clip["clip"].removesuffix("_000") == row["clip"]:
                    for source in ("segerstedt", "release"):
                        named = {"configuration": m.name, "source": source}
                        out.append(
                            _row(f"relative error, {clip['clip']}", named, row[source], clip["mean"], "")
                        )
    for row in published["computations"]:
        counts = (
            found[row["configuration"]].responsivity["parameters"] if row["configuration"] in found else {}
        )
        out.append(_row("computations of Table 6.1", row, row["table_6_1"], counts.get(COUNTS[2]), ""))
        out.append(_row("parameters of a phase", row, row["parameters"], counts.get("true"), ""))
    for row in published["sizes"]:
        m = found.get(row["configuration"])
        ours = describe(m)["weights_bytes"]["constant"] if m else None
        out.append(_row("weights of 50 phases", row, row["weights"], ours, "bytes"))
        if "database" in row:
            ours = (m.pipeline.get("database") or {}).get("bytes") if m else None
            out.append(_row("database", row, row["database"], ours, "bytes"))
    for row in published["stages"]:
        for m in all_measured if row["stage"] == "terrain" else ():
            named = {**row, "configuration": m.name}
            out.append(_row("patches", named, row["bytes"], of_stage(m, row["stage"], "bytes"), "bytes"))
    people = published["recognition"]
    for m in all_measured:
        if m.recognition["applies"]:
            named = {**people, "configuration": m.name}
            found = m.recognition["generated"]
            shares = {"all severities": found["right"]}
            hurt = [row for row in found["by_severity"] if row["severity"] > 0]
            shares |= {f"severity {row['severity']:g}": row["right"] for row in hurt}
            for which, ours in shares.items():
                out.append(_row(f"hurt part named right, {which}", named, people["share"], ours, ""))
    return out


def beside_times(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Likewise, of what a clock decides: milliseconds of a frame and a prediction, seconds of a stage."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["responsivity"]:
        m = found.get(row["configuration"])
        ours = m.responsivity["milliseconds"]["total"] if m else None
        out.append(_row("a frame", row, row["milliseconds"], ours, "ms"))
    for row in published["modes"]:
        for m in all_measured:
            times = {entry["mode"]: entry["milliseconds"]["predict"] for entry in by_mode(m)}
            if row["mode"] in times:
                named = {**row, "configuration": m.name}
                out.append(
                    _row(f"a prediction, {row['mode']}", named, row["milliseconds"], times[row["mode"]], "ms")
                )
    for row in published["stages"]:
        for m in all_measured:
            named = {**row, "configuration": m.name}
            seconds = of_stage(m, row["stage"], "seconds")
            out.append(_row(f"{row['stage']}, time", named, row["seconds"], seconds, "s"))
    return out


def _row(
    measure: str, row: Mapping[str, Any], theirs: float, ours: float | None, unit: str
) -> dict[str, Any]:
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
    }
