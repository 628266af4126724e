"""The response to injury: every link's severity swept from 0 to 10 while walking and jogging.

Eleven characters walk side by side, one for each severity: healthy until they are up to speed, then hurt, at
the runtime's rate, for `seconds`, of which the last half is measured, then healing for half as long.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.motion_measures import acceleration, gait_measures, in_root_frame
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.network import Network

FPS = 60
SEVERITIES = np.arange(11.0)
GAITS = {"walk": 2.5, "jog": 7.0}  # cm a frame asked for
WALK_IN = 3 * FPS  # frames until a figure that stood is up to speed
PHASES = 24  # bins of the cycle in which poses are compared
SETTLED = 0.1  # share of the final change within which a response counts as settled
REASON = "this network has no severity inputs"


def injury_response(
    network: Network,
    *,
    configuration: str,
    runtime: Mapping[str, Any],
    seconds: float,
    links: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Sweep each of `links` (default: those that were hurt in training).

    runtime: options of ProceduralAnimation; seconds: length of each walk. Returns `rows`, one for each gait,
    link and severity, `responses`, one for each gait and link: how monotonic each measure is with severity
    (Spearman), how fast the pose settles, how rough it is; and `summary`. `applies` is false for a network
    without severities.
    """
    if not network.links:
        return {"configuration": configuration, "applies": False, "reason": REASON}
    links = list(links or network.hurt_links)
    rows: list[dict[str, Any]] = []
    responses = []
    for gait in GAITS:
        for link in links:
            walk = Sweep(network, link, gait, seconds, runtime)
            measured = walk.measures()
            rows += [{"gait": gait, "link": link, **row} for row in measured]
            responses.append({"gait": gait, "link": link, **walk.response(measured)})
    return {
        "configuration": configuration,
        "applies": True,
        "mode": runtime.get("mode"),
        "seconds": seconds,
        "severities": SEVERITIES.tolist(),
        "links": links,
        "rows": rows,
        "responses": responses,
        "summary": _summary(responses),
    }


class Sweep:
    """Eleven walks of one gait that differ in the severity of one link."""

    def __init__(
        self, network: Network, link: str, gait: str, seconds: float, runtime: Mapping[str, Any]
    ) -> None:
        assert network.skeleton is not None
        self.skeleton = network.skeleton
        frames = max(8, round(seconds * FPS))
        self.onset, self.healing = WALK_IN, WALK_IN + frames
        self.late = slice(self.healing - frames // 2, self.healing)
        animation = ProceduralAnimation(network, characters=len(SEVERITIES), **runtime)
        poses = []
        for f in range(self.healing + frames // 2):
            injury = {link: SEVERITIES if self.onset <= f < self.healing else 0.0}
            poses.append(animation.next_pose((0.0, GAITS[gait]), gait=gait, injury=injury))
        self.world = np.array([p.positions for p in poses])
        self.root = np.array([p.root for p in poses])
        yaw = np.array([p.yaw for p in poses])
        self.contacts = np.array([p.contacts for p in poses])
        self.phase = np.array([p.phase for p in poses])
        self.local = in_root_frame(self.world, self.root, yaw)

    def measures(self) -> list[dict[str, Any]]:
        """One row for each severity; distances of the pose are phase-matched means over joints, cm."""
        late = self.late
        cycles = [self._cycle(c) for c in range(len(SEVERITIES))]
        rough = acceleration(self.world[late])
        normal = float(np.mean(self._apart(0, cycles[0])[late]))
        rows = []
        for c, severity in enumerate(SEVERITIES):
            row: dict[str, Any] = {"severity": float(severity)}
            row |= gait_measures(
                self.skeleton, self.local[late, c], self.contacts[late, c], self.root[late, c]
            )
            row["from_healthy"] = float(np.mean(self._apart(c, cycles[0])[late]))
            row["from_worst"] = float(np.mean(self._apart(c, cycles[-1])[late]))
            row["after_healing"] = float(np.mean(self._apart(c, cycles[0])[-self._period(c) :]))
            row["largest_acceleration"] = float(rough[:, c].max())
            row["settle_seconds"] = self._settle(c, self._apart(c, cycles[0]), normal) if c else 0.0
            rows.append({k: None if v is None else round(v, 5) for k, v in row.items()})
        return rows

    def response(self, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """How the measures answer to severity: Spearman's rho, None where a measure does not change.

        At severity 10: distance from healthy when hurt and after healing (cm, less the healthy walk's own),
        share of the healthy speed, settling time in seconds, largest joint acceleration against the healthy
        walk's.
        """
        names = [k for k in rows[0] if k not in ("severity", "settle_seconds", "after_healing")]
        healthy, worst = rows[0], rows[-1]
        return {
            "spearman": {name: spearman(SEVERITIES, [row[name] for row in rows]) for name in names},
            "from_healthy_cm": round(worst["from_healthy"] - healthy["from_healthy"], 5),
            "after_healing_cm": round(worst["after_healing"] - healthy["after_healing"], 5),
            "speed_share": round(worst["speed"] / healthy["speed"], 5) if healthy["speed"] > 0 else None,
            "settle_seconds": worst["settle_seconds"],
            "acceleration_share": round(
                worst["largest_acceleration"] / max(healthy["largest_acceleration"], 1e-9), 5
            ),
        }

    def _cycle(self, c: int) -> Array:
        """(PHASES, J, 3) mean pose of character c in each phase bin of the last half; empty bins are
        bridged."""
        late = self.late
        bins = np.minimum((self.phase[late, c] * PHASES).astype(int), PHASES - 1)
        mean = np.zeros((PHASES, *self.local.shape[2:]))
        seen = np.unique(bins)
        for b in seen:
            mean[b] = self.local[late, c][bins == b].mean(axis=0)
        for b in set(range(PHASES)) - set(seen.tolist()):
            gap = np.abs(seen - b)
            mean[b] = mean[seen[np.argmin(np.minimum(gap, PHASES - gap))]]
        return mean

    def _apart(self, c: int, cycle: Array) -> Array:
        """(F,) mean distance in cm of the joints of character c from a cycle at the same phase."""
        bins = np.minimum((self.phase[:, c] * PHASES).astype(int), PHASES - 1)
        return np.linalg.norm(self.local[:, c] - cycle[bins], axis=-1).mean(axis=-1)

    def _period(self, c: int) -> int:
        """Frames of a cycle of character c in the measured part, at most a second and a half."""
        rate = np.mod(np.diff(self.phase[self.late, c]), 1.0).mean()
        return int(np.clip(round(1 / max(rate, 1e-3)), 10, 3 * FPS // 2))

    def _settle(self, c: int, apart: Array, normal: float) -> float:
        """Seconds from the onset until the pose's distance from healthy, over a cycle, stays near its
        last."""
        window = min(self._period(c), self.late.stop - self.late.start)
        smooth = np.convolve(apart[self.onset : self.healing], np.ones(window) / window, mode="valid")
        out = np.abs(smooth - smooth[-1]) > SETTLED * max(abs(smooth[-1] - normal), 1e-9)
        last = int(np.flatnonzero(out)[-1]) + window if np.any(out) else 0
        return last / FPS


def spearman(x: Sequence[float] | Array, y: Sequence[float | None]) -> float | None:
    """Spearman's rank correlation of the pairs in which y is known; None for fewer than 3 or without any
    change."""
    pairs = [(a, b) for a, b in zip(x, y, strict=True) if b is not None]
    if len(pairs) < 3 or len({b for _, b in pairs}) < 2:
        return None
    ranks = np.array([_ranks(np.array(v)) for v in zip(*pairs, strict=True)])
    return round(float(np.corrcoef(ranks)[0, 1]), 5)


def _ranks(values: Array) -> Array:
    """Ranks from 1 on, equal values sharing the mean of theirs."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - (count - 1) / 2)[place]


def _summary(responses: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means over links, by gait."""
    out = {}
    for gait in GAITS:
        some = [r for r in responses if r["gait"] == gait]
        out[gait] = {
            "spearman_from_healthy": _mean([r["spearman"]["from_healthy"] for r in some]),
            "spearman_speed": _mean([r["spearman"]["speed"] for r in some]),
            "from_healthy_cm": _mean([r["from_healthy_cm"] for r in some]),
            "after_healing_cm": _mean([r["after_healing_cm"] for r in some]),
            "speed_share": _mean([r["speed_share"] for r in some]),
            "settle_seconds": _mean([r["settle_seconds"] for r in some]),
            "acceleration_share": _mean([r["acceleration_share"] for r in some]),
        }
    return out


def _mean(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 5) if known else None
