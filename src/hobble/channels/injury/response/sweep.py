"""Measures one gait while the severity of one link rises and falls.

A link is the piece of the body between two neighbouring joints. There is a figure (a character) for each
link. It walks healthy until it has reached its speed. Then the severity of its link is 0, 1, ..., 10, 9, ...,
0, each for the same time (a stretch). There is also a second crowd, to measure how fast the walk changes. In
it, the severity of each figure's link jumps from 0 to 10 and later back to 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import cast

import numpy as np

from hobble.channels.injury.crowd_severities import severities
from hobble.channels.injury.response.results import Response, SweepRow
from hobble.core.skeleton import Skeleton
from hobble.evaluation.crowd import FPS, CrowdTarget, Walks, run
from hobble.evaluation.motion_measures import gait_measures
from hobble.evaluation.pose_distance import cycle_frames, distance_to_cycle, mean_cycle, settling_seconds
from hobble.evaluation.spearman import spearman
from hobble.models.network import Network
from hobble.runtime.options import Runtime

SEVERITIES = np.arange(11.0)
STEPS = [*SEVERITIES, *SEVERITIES[-2::-1]]  # severity in each stretch: 0, 1, ..., 10, 9, ..., 0
WALK_IN = 0.75  # length of the beginning, in which figures reach their speed, as a share of a stretch
# The figures of the second crowd are hurt for a time of this many stretches. After it they walk healthy for a
# time of the same length.
HURT = 2
# Columns of a row that are not measures of the walk.
LABELS = ("gait", "link", "direction", "severity")


class SeveritySweep:
    """The walks of one gait, with a figure for each of `links`.

    steps: the severity in each stretch. walks: the motion of the figures whose severity rises and falls.
    Before the stretches of `steps` it has a shorter one, in which the figures reach their speed. at_once: the
    motion of the second crowd, whose severities jump to 10 and back to 0.
    """

    def __init__(
        self, skeleton: Skeleton, links: Sequence[str], gait: str, walks: Walks, at_once: Walks
    ) -> None:
        self.skeleton, self.links, self.gait = skeleton, list(links), gait
        self.steps = STEPS
        self.walks, self.at_once = walks, at_once

    def rows(self, figure: int) -> list[SweepRow]:
        """One row for each of `steps`; `SweepRow` in the module `results` beside this one explains its keys.

        figure: index of the figure. Distances are means over the joints, between poses of the same phase.
        """
        walks = self.walks
        spans = [walks.measured(1 + step, figure) for step in range(len(self.steps))]
        cycles = [mean_cycle(walks.local[s, figure], walks.phase[s, figure]) for s in spans]
        worst = len(SEVERITIES) - 1
        rows = []
        for step, (span, severity) in enumerate(zip(spans, self.steps, strict=True)):
            local, phase = walks.local[span, figure], walks.phase[span, figure]
            row: dict[str, float | str | None] = {
                "gait": self.gait,
                "link": self.links[figure],
                "direction": "rising" if step <= worst else "falling",
                "severity": float(severity),
            }
            row |= gait_measures(self.skeleton, local, walks.contacts[span, figure], walks.root[span, figure])
            row["from_healthy"] = float(np.mean(distance_to_cycle(local, phase, cycles[0])))
            row["from_worst"] = float(np.mean(distance_to_cycle(local, phase, cycles[worst])))
            # The mean cycle at this severity while the severity rose.
            same = cycles[step if step <= worst else 2 * worst - step]
            row["from_rising"] = float(np.mean(distance_to_cycle(local, phase, same)))
            row["largest_acceleration"] = float(walks.acceleration[span, figure].max())
            rounded = {k: round(v, 5) if isinstance(v, float) else v for k, v in row.items()}
            rows.append(cast(SweepRow, rounded))
        return rows

    def response(self, figure: int, rows: Sequence[SweepRow]) -> Response:
        """How the walk responds to severity.

        figure: index of the figure. rows: the figure's rows.

        Keys of the result. spearman, spearman_falling: rank correlation of each measure with rising and with
        falling severity, None if the measure is constant. from_healthy_cm, after_healing_cm: distance from
        the healthy walk at severity 10 and at the end. hysteresis_cm: largest distance between two walks at
        the same severity, one while it rose and one while it fell. From each of these three distances, the
        distance of the healthy walk from its own mean cycle is subtracted. speed_share: speed at severity 10,
        divided by the healthy speed. settle_seconds, heal_seconds: time until the walk no longer changes
        after the severity jumped to 10 or back to 0. largest_acceleration: of any joint in the whole sweep,
        cm per frame squared. acceleration_share: largest_acceleration, divided by the largest acceleration in
        the healthy walk.
        """
        worst = len(SEVERITIES) - 1
        rising, falling = rows[: worst + 1], rows[worst:]
        names = [k for k in rows[0] if k not in (*LABELS, "from_rising")]
        numbers = cast(Sequence[Mapping[str, float | None]], rows)
        measures = {name: [row[name] for row in numbers] for name in names}
        healthy_cm = rows[0]["from_healthy"]  # distance of the healthy walk from its own mean cycle
        largest = float(self.walks.acceleration[int(self.walks.starts[1]) :, figure].max())
        hurt, healed = self._settling(figure)
        return {
            "spearman": {n: spearman(SEVERITIES, values[: worst + 1]) for n, values in measures.items()},
            "spearman_falling": {
                n: spearman(SEVERITIES[::-1], values[worst:]) for n, values in measures.items()
            },
            "from_healthy_cm": round(rising[-1]["from_healthy"] - healthy_cm, 5),
            "after_healing_cm": round(rows[-1]["from_healthy"] - healthy_cm, 5),
            "hysteresis_cm": round(max(row["from_rising"] for row in falling[1:]) - healthy_cm, 5),
            "speed_share": round(rising[-1]["speed"] / rising[0]["speed"], 5)
            if rising[0]["speed"] > 0
            else None,
            "settle_seconds": hurt,
            "heal_seconds": healed,
            "largest_acceleration": round(largest, 5),
            "acceleration_share": round(largest / max(rows[0]["largest_acceleration"], 1e-9), 5),
        }

    def _settling(self, figure: int) -> tuple[float | None, float | None]:
        """`settle_seconds` and `heal_seconds` of `response`."""
        walks: Walks = self.at_once
        local, phase = walks.local[:, figure], walks.phase[:, figure]
        healthy = walks.measured(1, figure)
        cycle = mean_cycle(local[healthy], phase[healthy])
        distance = distance_to_cycle(local, phase, cycle)
        normal = float(np.mean(distance[healthy]))
        (a, b), (c, d) = (walks.starts[2:4], walks.starts[3:5])
        late = slice((a + b) // 2, b)
        hurt = settling_seconds(distance[a:b], normal, cycle_frames(phase[late]))
        healed = settling_seconds(
            distance[c:d], float(np.mean(distance[late])), cycle_frames(phase[(c + d) // 2 : d])
        )
        return hurt, healed


def sweeps(
    network: Network, links: Sequence[str], gaits: Sequence[str], seconds: float, runtime: Runtime
) -> Iterator[SeveritySweep]:
    """The sweep of each gait, with `seconds` at each severity. The figures of all gaits are in one crowd."""
    assert network.skeleton is not None
    gait_of_figure = [gait for gait in gaits for _ in links]

    def stretch(share: float, severity: float) -> CrowdTarget:
        hurt = severities(network, [{link: severity} for link in links] * len(gaits))
        return CrowdTarget(max(4, round(share * seconds * FPS)), gait_of_figure, hurt)

    walks = run(network, [stretch(WALK_IN, 0), *(stretch(1, s) for s in STEPS)], runtime)
    at_once = run(network, [stretch(WALK_IN, 0), stretch(1, 0), stretch(HURT, 10), stretch(HURT, 0)], runtime)
    for number, gait in enumerate(gaits):
        figures = slice(number * len(links), (number + 1) * len(links))
        yield SeveritySweep(network.skeleton, links, gait, walks.of(figures), at_once.of(figures))
