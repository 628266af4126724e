"""Errors of roll-outs: the network continues from its own poses, with the path and inputs of a clip.

A roll-out starts at a captured frame and continues for n frames like the runtime. Its input has the joints
that it predicted itself. Each new position is the mean of the predicted position and of the last position
plus the predicted velocity. The phase advances by its predicted change. Trajectory, gait, ground and channels
come from the clip. All roll-outs of a stretch are computed together.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.character.rule import joint_place, moving, phase_change
from hobble.core.quat import Array
from hobble.database.statistics import Moments
from hobble.evaluation.captured import rotate_by_yaw, unbroken
from hobble.measures.accuracy.run import (
    SPLITS,
    check_layout,
    chosen_joints,
    joint_indices,
    relative_and_distance,
)
from hobble.measures.given import Given, Outcome
from hobble.measures.rollouts import Options
from hobble.measures.sample import Sample, drawn
from hobble.models.load import load_network
from hobble.models.network import Predictor
from hobble.rows.clip_rows import ClipRows, load_clip_rows, pairs
from hobble.rows.facts import load_facts
from hobble.rows.layout import GAITS, RowLayout

LENGTHS = (1, 10, 60, 300)  # frames
OVERLAP = 4  # roll-outs of one length that contain each frame
BATCH = 1024  # roll-outs computed at once

log = logging.getLogger("hobble")


@dataclass(frozen=True)
class RollOutErrors:
    """Relative error and position error (cm) over `frames` frames of roll-outs.

    last: position error and phase error (cycles) in the last frame, over the `ended` roll-outs that reached
    their full length.
    """

    frames: int = 0
    starts: int = 0
    moments: Moments = field(default_factory=lambda: Moments.nothing(2), repr=False)
    last: Moments = field(default_factory=lambda: Moments.nothing(2), repr=False)
    ended: int = 0

    def __add__(self, other: RollOutErrors) -> RollOutErrors:
        return RollOutErrors(
            self.frames + other.frames,
            self.starts + other.starts,
            self.moments + other.moments,
            self.last + other.last,
            self.ended + other.ended,
        )

    def weighing(self, weight: float) -> RollOutErrors:
        """The same, with each frame counted `weight` times."""
        if weight == 1:
            return self
        return RollOutErrors(self.frames, self.starts, self.moments * weight, self.last * weight, self.ended)

    def to_dict(self, phase: bool = True) -> dict[str, Any]:
        """Plain data, with None if there were no frames, or if no roll-out reached its full length.

        phase: whether the network uses the phase. If not, the phase error has no meaning and is None.
        """
        known, ended = self.frames > 0, self.ended > 0
        return {
            "frames": self.frames,
            "mean": float(self.moments.mean[0]) if known else None,
            "sd": float(self.moments.std[0]) if known else None,
            "position_error_cm": float(self.moments.mean[1]) if known else None,
            "ended": self.ended,
            "last_cm": float(self.last.mean[0]) if ended else None,
            "last_phase": float(self.last.mean[1]) if ended and phase else None,
        }


@dataclass(frozen=True)
class Inputs:
    """The inputs and targets of F consecutive frames of a clip, on one terrain fit.

    x: (F, X) with the captured joints; y: (F, Y) targets; both in raw units, with heights minus `mean` (F,).
    phase: (F,). turn: (F,) and velocity: (F, 2) of the root until the next frame. moving: (F,) the share of
    the predicted movement that is applied, see `hobble.character.rule.moving`.
    """

    x: Array
    y: Array
    mean: Array
    phase: Array
    turn: Array
    velocity: Array
    moving: Array


def inputs(rows: ClipRows, chosen: np.ndarray, layout: RowLayout) -> Inputs:
    """The inputs of the rows `chosen` (F,), on the first fit of each, in the network's `layout`."""
    fit = rows.first_fit[chosen]
    x, y, *_ = pairs(rows, layout, chosen, fit)
    gait = x[:, layout.x_gait].reshape(len(x), len(GAITS), layout.samples)
    stand = gait[:, GAITS.index("stand"), layout.samples // 2]
    return Inputs(
        x,
        y,
        rows.mean[fit].astype(np.float32),
        rows.p[chosen].astype(float),
        y[:, layout.y_turn][:, 0].astype(float),
        y[:, layout.y_root_velocity].astype(float),
        moving(stand),
    )


def roll_out(
    predictor: Predictor, clip_inputs: Inputs, starts: np.ndarray, length: int
) -> tuple[list[Array], Array]:
    """The joints of roll-outs that begin at frames `starts` (n,), which rise, and their last phases (n,).

    For each age from 1 to `length` there is an array (n', J, 3), in the root frame of frame start + age - 1,
    with heights minus that frame's mean. It holds the first n' roll-outs, those still inside the stretch.
    """
    layout = predictor.network.layout
    joints = (len(starts), layout.joints, 3)
    x = clip_inputs.x[starts]
    place = x[:, layout.x_joint_position].reshape(joints).astype(float)
    phase = clip_inputs.phase[starts].copy()
    speed = np.zeros(joints)
    memory = np.zeros((len(starts), predictor.network.memory))
    made = []
    for age in range(length):
        alive = int(np.searchsorted(starts, len(clip_inputs.x) - age))
        at = starts[:alive] + age
        if not alive:
            break
        row = clip_inputs.x[at].copy()
        if age:
            # The predicted pose, still in the last frame's root. Heights are made relative to this frame's
            # mean.
            lower = place[:alive].copy()
            lower[..., 1] += (clip_inputs.mean[at - 1] - clip_inputs.mean[at])[:, None]
            row[:, layout.x_joint_position] = lower.reshape(alive, -1)
            row[:, layout.x_joint_velocity] = speed[:alive].reshape(alive, -1)
        kept = {"memory": memory[:alive]} if predictor.network.memory else {}
        y = predictor.predict(row, phase[:alive], **kept)
        before = row[:, layout.x_joint_position].reshape(alive, -1, 3).astype(float)
        speed[:alive] = y[:, layout.y_joint_velocity].reshape(alive, -1, 3)
        guess = y[:, layout.y_joint_position].reshape(alive, -1, 3)
        place[:alive] = joint_place(_carried(before, clip_inputs, at) + speed[:alive], guess)
        made.append(place[:alive].copy())
        moved = phase_change(clip_inputs.moving[at], y[:, layout.y_phase_change][:, 0])
        phase[:alive] = np.mod(phase[:alive] + moved, 1.0)
    return made, phase


def _carried(place: Array, clip_inputs: Inputs, at: np.ndarray) -> Array:
    """Joints (n, J, 3) moved from the root frame of frames at - 1 to that of frames `at`."""
    out = place.copy()
    level = place[..., ::2] - clip_inputs.velocity[at - 1][:, None]
    out[..., ::2] = rotate_by_yaw(level, clip_inputs.turn[at - 1][:, None])
    return out


def clip_roll_outs(
    predictor: Predictor, rows: ClipRows, joints: Sequence[int], lengths: Sequence[int]
) -> dict[int, RollOutErrors]:
    """Length -> errors of roll-outs over every frame of the clip.

    No roll-out begins at the first frame of a stretch, because the movement of the root to it is unknown.
    Each frame is in OVERLAP roll-outs of a length, or in one if they are one frame long.
    """
    layout = predictor.network.layout
    out = {length: RollOutErrors() for length in lengths}
    for chosen in unbroken(rows.frame):
        clip_inputs = inputs(rows, chosen, layout)
        for length in lengths:
            all_starts = np.arange(1, len(chosen), max(1, length // OVERLAP))
            for first in range(0, len(all_starts), BATCH):
                starts = all_starts[first : first + BATCH]
                out[length] += _errors(predictor, clip_inputs, starts, length, joints)
    return out


def _errors(
    predictor: Predictor, clip_inputs: Inputs, starts: np.ndarray, length: int, joints: Sequence[int]
) -> RollOutErrors:
    layout = predictor.network.layout
    truth = clip_inputs.y[:, layout.y_joint_position].reshape(len(clip_inputs.y), -1, 3)[:, joints]
    made, phase = roll_out(predictor, clip_inputs, starts, length)
    frames, moments = 0, Moments.nothing(2)
    errors: Array = np.zeros((0, len(joints), 2))
    for age, place in enumerate(made):
        at = starts[: len(place)] + age
        errors = relative_and_distance(truth[at].astype(float), place[:, joints])
        weights = np.full(errors[..., 0].size, 1 / len(joints))
        moments = moments + Moments.of(errors.reshape(-1, 2), weights)
        frames += len(place)
    # The phase is already that of the next frame, so that one has to be in the stretch too.
    ended = int(np.searchsorted(starts, len(clip_inputs.x) - length))
    if not ended:
        return RollOutErrors(frames, len(starts), moments)
    off = np.abs(np.mod(phase[:ended] - clip_inputs.phase[starts[:ended] + length] + 0.5, 1.0) - 0.5)
    last = np.stack([errors[:ended, :, 1].mean(axis=1), off], axis=1)
    return RollOutErrors(frames, len(starts), moments, Moments.of(last), ended)


def measure_roll_outs(
    weights: str | Path,
    clips: Mapping[str, str | Path],
    splits: Mapping[str, str],
    configuration: str,
    equivalents: Sequence[str] | None = None,
    lengths: Sequence[int] = LENGTHS,
    mode: str = "cubic",
    sample: Sample | None = None,
) -> dict[str, Any]:
    """The content of rollouts.json: for each of `lengths`, the splits and the clips in name order.

    clips: name -> file of rows, one in memory at a time. equivalents: names of the joints to measure. mode:
    how the phase is looked up. sample: measure only these clips; the result then has their number in `sample`
    and 95 % confidence intervals in `interval`. Raises InputError if rows and network have different layouts.
    """
    network = load_network(weights)
    predictor = network.predictor(mode)
    joints = joint_indices(network, equivalents)
    total = {length: dict.fromkeys(SPLITS, RollOutErrors()) for length in lengths}
    entries: dict[int, list[dict[str, Any]]] = {length: [] for length in lengths}
    for name, weight in (sample.weights if sample else dict.fromkeys(sorted(clips), 1.0)).items():
        rows = load_clip_rows(clips[name])
        check_layout(clips[name], rows, network)
        for length, found in clip_roll_outs(predictor, rows, joints, lengths).items():
            total[length][splits[name]] += found.weighing(weight)
            entries[length].append({"clip": name, "split": splits[name], **found.to_dict(network.phase)})
        log.info("%s: %s", name, entries[lengths[-1]][-1])
    result: dict[str, Any] = {
        "configuration": configuration,
        "joints": len(joints),
        "mode": mode,
        "lengths": [
            {
                "length": length,
                **{split: total[length][split].to_dict(network.phase) for split in SPLITS},
                "clips": entries[length],
            }
            for length in lengths
        ],
    }
    return result if sample is None else _with_sample(result, sample)


def _with_sample(result: dict[str, Any], sample: Sample) -> dict[str, Any]:
    """The result with what was drawn, and the half widths of the 95 % intervals of each split and length.

    A clip too short for any roll-out counts as the others of its split.
    """
    for entry in result["lengths"]:
        for split in SPLITS:
            usual = entry[split]["position_error_cm"]
            values = {
                clip["clip"]: usual if clip["position_error_cm"] is None else clip["position_error_cm"]
                for clip in entry["clips"]
                if clip["split"] == split
            }
            if usual is not None:
                entry[split]["interval"] = {"position_error_cm": sample.half_width(split, values)}
    return {**result, "sample": sample.to_dict()}


def roll_out_rows(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The clips' entries, and those of the splits with an empty `clip`, as flat rows."""
    rows = []
    for entry in result["lengths"]:
        for split in SPLITS:
            rows.append({"length": entry["length"], "clip": None, "split": split, **entry[split]})
        rows += [{"length": entry["length"], **clip} for clip in entry["clips"]]
    return rows


def run(given: Given, options: Options) -> Outcome:
    """rollouts.json, and its rows as a table."""
    sample = drawn(map(load_facts, given.facts), given.splits, options.sample_frames)
    result = measure_roll_outs(
        given.weights,
        given.clips,
        given.splits,
        given.configuration,
        chosen_joints(given, options),
        options.rollouts,
        given.runtime.mode,
        sample,
    )
    return Outcome(result, {"lengths": roll_out_rows(result)})
