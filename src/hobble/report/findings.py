"""The minute's summary: key figures, and what the numbers suggest to do next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hobble.report.formats import duration, number, size
from hobble.report.gather import Material

FRAME_BUDGET_MS = 1000 / 60


@dataclass(frozen=True)
class Figure:
    """A number that a reader should take away, and what it stands beside."""

    label: str
    value: str
    unit: str = ""
    beside: str = ""


@dataclass(frozen=True)
class Hint:
    """A plain sentence drawn from the numbers; kind is "good", "warn" or "note"."""

    kind: str
    head: str
    text: str


def published(material: Material, what: str) -> dict | None:
    """The published entry for this configuration's network, if there is one."""
    rows = material.published.get(what, ())
    return next((row for row in rows if row["configuration"] == material.name), None)


def _recipe(material: Material) -> Mapping[str, Any]:
    """The training section of the configuration; empty where that is not known."""
    return (material.resolved.get("configuration") or {}).get("training") or {}


def lead(material: Material) -> str:
    """What was trained on what, in a sentence or two."""
    clips = [report["clip"] for report in material.motion]
    kept = sum(material.split(clip) == "held_out" for clip in clips)
    frames = sum(report.get("frames", 0) for report in material.motion)
    passes = _recipe(material).get("passes")
    network = material.network
    text = (
        f"A phase-functioned network of {len(network['sizes']) - 2} hidden layers and "
        f"{network['control_points']} control points, with {network['sizes'][0]} inputs and "
        f"{network['sizes'][-1]} outputs, trained"
    )
    text += f" for {passes} passes" if passes else ""
    text += f" on {len(clips) - kept} clips of {material.dataset}"
    text += f" and tried on {kept} that it never saw" if kept else ""
    return f"{text}: {frames:,} frames at 60\u00a0Hz in all."


def key_figures(material: Material) -> list[Figure]:
    """The numbers on top of the page, most important first."""
    accuracy, figures = material.accuracy, []
    for split, label in (("held_out", "Error on held-out clips"), ("train", "Error on training clips")):
        part = accuracy.get(split)
        if part and part.get("mean") is not None:
            error = part.get("position_error_cm")
            beside = f"{number(error)} cm a joint on average" if error is not None else ""
            theirs = published(material, "accuracy") if split == "held_out" else None
            if theirs:
                beside += f"; {theirs['label']} was published at {100 * theirs['mean']:.2f} %"
            figures.append(Figure(label, f"{100 * part['mean']:.2f}", "%", beside))
    milliseconds = frame_milliseconds(material)
    if milliseconds is not None:
        theirs = published(material, "responsivity")
        beside = f"median; {FRAME_BUDGET_MS / milliseconds:,.0f} characters at 60 Hz on one core"
        if theirs:
            beside += (
                f"; mean {number(frame_mean(material), 2)} ms, published mean {theirs['milliseconds']} ms"
            )
        figures.append(Figure("Time for a frame", number(milliseconds, 2), "ms", beside))
    seconds = sum(report.get("seconds", 0) for report in material.motion)
    if seconds:
        kept = sum(material.split(report["clip"]) == "held_out" for report in material.motion)
        beside = f"{len(material.motion)} clips, {kept} of them held out"
        value, _, unit = duration(seconds).partition(" ")
        figures.append(Figure("Motion in all", value, unit, beside))
    network = material.network
    figures.append(
        Figure(
            "Network",
            number(network["parameters"] / 1e6, 3),
            "M",
            f"parameters a phase: {'–'.join(map(str, network['sizes']))}; {size(network['bytes'])} on disk",
        )
    )
    total = material.pipeline.get("total_seconds")
    if total:
        value, _, unit = duration(total).partition(" ")
        beside = f"of computing from clips to figures, {size(material.pipeline.get('total_bytes'))} written"
        figures.append(Figure("Whole pipeline", value, unit, beside))
    return figures


def frame_milliseconds(material: Material) -> float | None:
    """Milliseconds of one frame, all steps together: the median over all laps, which no outlier decides."""
    value = material.responsivity.get("milliseconds")
    median = (value.get("spread") or {}).get("median") if isinstance(value, dict) else None
    return frame_mean(material) if median is None else float(median)


def frame_mean(material: Material) -> float | None:
    """Likewise the mean, which is what was published."""
    value = material.responsivity.get("milliseconds")
    if isinstance(value, dict):
        value = value.get("total", sum(v for v in value.values() if isinstance(v, (int, float))))
    return float(value) if isinstance(value, (int, float)) else None


def hints(material: Material) -> list[Hint]:
    """What to do next, most pressing first."""
    found = [
        *_generalisation(material),
        *_curve(material),
        *_worst_clips(material),
        *_coverage(material),
        *_speed(material),
        *_track(material),
        *_injury(material),
        *_repairs(material),
        *_costs(material),
    ]
    order = {"warn": 0, "note": 1, "good": 2}
    return sorted(found, key=lambda hint: order[hint.kind])


def _generalisation(material: Material) -> Iterator[Hint]:
    train, held_out = (material.accuracy.get(split) or {} for split in ("train", "held_out"))
    if held_out.get("mean") is None:
        yield Hint(
            "warn",
            "Nothing was held out.",
            "The accuracy below says how well the clips were memorised. Name a few under held_out in the "
            "data set.",
        )
        return
    ratio = held_out["mean"] / train["mean"] if train.get("mean") else float("nan")
    if ratio > 1.5:
        yield Hint(
            "warn",
            f"Held-out clips are predicted {ratio:.1f} times worse than training clips.",
            "The network has learnt these clips more than motion as such: add clips that differ "
            "(speeds, turns, performers) before adding units or passes.",
        )
    elif ratio < 1.2:
        yield Hint(
            "good",
            f"Held-out clips are predicted about as well as training clips ({ratio:.2f} times the error).",
            "There is room for a larger network.",
        )
    else:
        yield Hint(
            "note", f"Held-out clips have {ratio:.2f} times the error of training clips.", "That is usual."
        )


def _curve(material: Material) -> Iterator[Hint]:
    history = material.history
    curve = zip(history.get("pass", ()), history.get("held_out_mse", ()), strict=False)
    known = [(p, v) for p, v in curve if p is not None and v is not None]
    if len(known) < 8:
        return
    passes, losses = zip(*known, strict=True)
    # One section's error is noisy; a pass's is what has a trend.
    means = {p: np.mean([v for q, v in known if q == p]) for p in passes}
    best = min(means, key=lambda p: means[p])
    if means[passes[-1]] > 1.05 * means[best]:
        yield Hint(
            "warn",
            f"The held-out error was lowest in pass {best:.0f} and has risen since.",
            "Fewer passes, more dropout or more data would serve the held-out clips better.",
        )
        return
    quarter = max(1, len(losses) // 4)
    before, after = np.mean(losses[-2 * quarter : -quarter]), np.mean(losses[-quarter:])
    fall = 1 - after / before
    if _recipe(material).get("schedule", "constant") != "constant":
        return  # it fell with the learning rate, which has come to its end
    if fall > 0.03:
        yield Hint(
            "note",
            f"The held-out error was still falling, by {100 * fall:.0f} % over the last quarter.",
            "More passes will help; a configuration that continues this one starts from its last checkpoint.",
        )
    else:
        yield Hint("good", "Training has settled.", "More passes alone will change little.")


def _worst_clips(material: Material) -> Iterator[Hint]:
    rows = [row for row in material.accuracy.get("clips", ()) if row.get("mean") is not None]
    if len(rows) < 4:
        return
    median = float(np.median([row["mean"] for row in rows]))
    worst = max(rows, key=lambda row: row["mean"])
    if worst["mean"] > 1.8 * median:
        yield Hint(
            "note",
            f"{worst['clip']} is the hardest clip,",
            f"with {worst['mean'] / median:.1f} times the error of the middle one. "
            "See in its label strip whether the labels are right, and among the repairs whether its frames "
            "are whole.",
        )


def _coverage(material: Material) -> Iterator[Hint]:
    totals: dict[str, float] = {}
    for report in material.labels:
        for gait, seconds in (report.get("seconds") or {}).items():
            totals[gait] = totals.get(gait, 0.0) + seconds
    everything = sum(totals.values())
    thin = [g for g, s in totals.items() if 0 < s < 0.03 * everything and g not in ("jump", "bump")]
    if thin:
        yield Hint(
            "note",
            f"There is little data of {' and '.join(sorted(thin))}:",
            "under three per cent of the seconds. Expect those gaits to be the least steady.",
        )


def _speed(material: Material) -> Iterator[Hint]:
    milliseconds = frame_milliseconds(material)
    if milliseconds is None:
        return
    if milliseconds > FRAME_BUDGET_MS:
        yield Hint("warn", f"A frame takes {milliseconds:.1f} ms, too long for 60 Hz.", "Try mode: linear.")
    else:
        share = milliseconds / FRAME_BUDGET_MS
        yield Hint(
            "good", f"A frame uses {100 * share:.1f} % of its time at 60 Hz.", "Fast enough for a game."
        )


def _track(material: Material) -> Iterator[Hint]:
    reached, asked = (material.responsivity.get(key) for key in ("waypoints_reached", "waypoints"))
    if asked and reached is not None and reached < asked:
        yield Hint(
            "warn",
            f"The character reached {reached} of {asked} waypoints.",
            "Where it does not arrive, it circles or stands: look at Speed and response, lap by lap.",
        )
    turn = material.responsivity.get("largest_turn_degrees")
    if turn is not None and turn > 60:
        yield Hint(
            "warn",
            f"A joint turned by {turn:.0f} degrees in one frame.",
            "That is a flip, and will be seen on a skinned figure.",
        )


def _injury(material: Material) -> Iterator[Hint]:
    responses = [r for r in material.injury.get("responses") or () if r["gait"] == "walk"]
    walks = [r for r in responses if r.get("trained", True)]
    if not walks:
        return
    drift, left = (_unhurt(responses, key) for key in ("from_healthy_cm", "after_healing_cm"))
    if drift > 2:
        yield Hint(
            "warn",
            f"A walk in which nothing hurts drifts as well, by {number(drift)} cm a joint.",
            "What severity does can hardly be told from that: train for longer, or measure for longer.",
        )
    deaf = [r["link"] for r in walks if (r.get("from_healthy_cm") or 0) < max(0.5, 2 * drift)]
    if deaf:
        yield Hint(
            "note",
            f"{len(deaf)} of {_plural(len(walks), 'link')} hardly "
            f"{'changes' if len(deaf) == 1 else 'change'} the walk at severity 10",
            "(under half a centimetre a joint, or no different from an unhurt walk): "
            f"{', '.join(deaf[:4])}{' …' if len(deaf) > 4 else ''}.",
        )
    rough = [r["link"] for r in walks if _rho(r) < 0.7 and r["link"] not in deaf]
    if rough:
        yield Hint(
            "note",
            f"The pose does not follow severity steadily for {', '.join(rough[:4])}.",
            "See whether its curve jumps: then in-between severities are missing from the data.",
        )
    stuck = [
        r["link"]
        for r in walks
        if r["link"] not in deaf and (r.get("after_healing_cm") or 0) > max(2, 2 * left)
    ]
    if stuck:
        yield Hint(
            "note",
            f"After healing, the walk does not quite come back for {', '.join(stuck[:4])}.",
            "The network is caught in a limp that it would see as a gait of its own.",
        )
    if not deaf and not rough:
        yield Hint(
            "good",
            "Every link that was hurt in training shifts the walk with its severity, and steadily.",
            "",
        )


def _unhurt(responses: Sequence[Mapping[str, Any]], key: str) -> float:
    """What is measured of links that were never hurt in training: the drift of an unhurt walk."""
    values = [r[key] for r in responses if not r.get("trained", True) and r.get(key) is not None]
    return float(np.mean(values)) if values else 0.0


def _plural(count: int, word: str) -> str:
    """A count with its word.

    >>> _plural(1, "link"), _plural(2, "link")
    ('1 link', '2 links')
    """
    return f"{count} {word}{'' if count == 1 else 's'}"


def _rho(response: Mapping[str, Any]) -> float:
    value = (response.get("spearman") or {}).get("from_healthy")
    return 0.0 if value is None else float(value)


def _repairs(material: Material) -> Iterator[Hint]:
    repaired = [report["clip"] for report in material.motion if report.get("repairs")]
    warned = {r["clip"] for r in (*material.labels, *material.told) if r.get("warnings")}
    if repaired or warned:
        yield Hint(
            "note",
            f"Clips repaired: {len(repaired)}; clips with warnings: {len(warned)}.",
            "They are listed under Data. Look at them before you trust those clips.",
        )


def _costs(material: Material) -> Iterator[Hint]:
    stages = material.pipeline.get("stages") or []
    total = material.pipeline.get("total_seconds") or 0
    if stages and total:
        slowest = max(stages, key=lambda stage: stage["seconds"])
        share = slowest["seconds"] / total
        if share > 0.5:
            yield Hint("note", f"{slowest['stage'].capitalize()} took {100 * share:.0f} % of the time.", "")
