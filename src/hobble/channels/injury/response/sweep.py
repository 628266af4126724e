"""Measures one gait while the severity of one link rises and falls.

A link is the piece of the body between two neighbouring joints. There is a figure (a copy of the character)
for each link. The figures walk at the same time, as a crowd. Each walks healthy until it has reached its
speed. Then the severity of its link is 0, 1, ..., 10, 9, ..., 0, each for the same time (a stretch). A second
crowd shows how fast the walk changes: the severity of each figure's link jumps from 0 to 10 and later back
to 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import cast

import numpy as np

from hobble.channels.injury.crowd_severities import severity_inputs
from hobble.channels.injury.response.results import Response, SweepRow
from hobble.core.skeleton import Skeleton
from hobble.measures.walks import (
    FPS,
    CrowdTarget,
    Walks,
    cycle_frames,
    distance_to_cycle,
    gait_measures,
    generate_walks,
    mean_cycle,
    settling_seconds,
    spearman,
)
from hobble.models.network import Network
from hobble.runtime.options import Runtime

SEVERITIES = np.arange(11.0)
STEPS = [*SEVERITIES, *SEVERITIES[-2::-1]]  # severity in each stretch: 0, 1, ..., 10, 9, ..., 0
WORST = len(SEVERITIES) - 1  # index in STEPS of the highest severity
WALK_IN = 0.75  # time at the beginning in which figures reach their speed, as a share of a stretch's time
# In the second crowd, a link hurts for the time of this many stretches, and then is healthy for as long.
JUMP_STRETCHES = 2
# Keys of a row that are not measures of the walk.
LABELS = ("gait", "link", "direction", "severity")


class SeveritySweep:
    """The walks of one gait, with a figure for each of `links`.

    steps: the severity in each stretch. walks: the motion of the figures whose severity rises and falls. In
    its stretch 0 the figures reach their speed, so its stretch 1 + i has the severity `steps[i]`. at_once:
    the motion of the second crowd, in which severities jump to 10 and back to 0.
    """

    def __init__(
        self, skeleton: Skeleton, links: Sequence[str], gait: str, walks: Walks, at_once: Walks
    ) -> None:
        self.skeleton, self.links, self.gait = skeleton, list(links), gait
        self.steps = STEPS
        self.walks, self.at_once = walks, at_once

    def rows(self, figure: int) -> list[SweepRow]:
        """One row for each of `steps`; `hobble.channels.injury.response.results.SweepRow` explains its keys.

        figure: index of the figure.
        """
        walks = self.walks
        # The frames to measure in each stretch of `steps`, and the mean gait cycle of these frames.
        spans = [walks.measured_frames(1 + step, figure) for step in range(len(self.steps))]
        cycles = [mean_cycle(walks.local[s, figure], walks.phase[s, figure]) for s in spans]
        rows = []
        for step, (span, severity) in enumerate(zip(spans, self.steps, strict=True)):
            local, phase = walks.local[span, figure], walks.phase[span, figure]
            row: dict[str, float | str | None] = {
                "gait": self.gait,
                "link": self.links[figure],
                "direction": "rising" if step <= WORST else "falling",
                "severity": float(severity),
            }
            row |= gait_measures(self.skeleton, local, walks.contacts[span, figure], walks.root[span, figure])
            row["from_healthy"] = float(np.mean(distance_to_cycle(local, phase, cycles[0])))
            row["from_worst"] = float(np.mean(distance_to_cycle(local, phase, cycles[WORST])))
            # The mean cycle at the same severity while the severity rose.
            rising_cycle = cycles[step if step <= WORST else 2 * WORST - step]
            row["from_rising"] = float(np.mean(distance_to_cycle(local, phase, rising_cycle)))
            row["largest_acceleration"] = float(walks.acceleration[span, figure].max())
            rounded = {k: round(v, 5) if isinstance(v, float) else v for k, v in row.items()}
            rows.append(cast(SweepRow, rounded))
        return rows

    def response(self, figure: int, rows: Sequence[SweepRow]) -> Response:
        """How the walk responds to severity.

        figure: index of the figure. rows: the figure's rows, from `rows`.

        Keys of the result. spearman, spearman_falling: measure of the walk -> its rank correlation with
        rising and with falling severity, None if the measure is constant. from_healthy_cm: distance from the
        healthy walk at severity 10. after_healing_cm: the same distance at the end, when severity is 0 again.
        hysteresis_cm: largest distance between two walks at the same severity, one while severity rises and
        one while it falls. From each of these three distances, the distance of the healthy walk from its own
        mean cycle is subtracted. speed_share: speed at severity 10, divided by the healthy speed; None if the
        healthy figure stands still. settle_seconds, heal_seconds: time until the walk no longer changes,
        after the severity has jumped to 10 and after it has jumped back to 0; None if the walk does not
        change. largest_acceleration: of any joint in the whole sweep, cm per frame squared.
        acceleration_share: `largest_acceleration`, divided by the largest acceleration in the healthy walk.
        """
        rising, falling = rows[: WORST + 1], rows[WORST:]
        names = [k for k in rows[0] if k not in (*LABELS, "from_rising")]
        numbers = cast(Sequence[Mapping[str, float | None]], rows)
        measures = {name: [row[name] for row in numbers] for name in names}
        healthy_cm = rows[0]["from_healthy"]  # distance of the healthy walk from its own mean cycle
        largest = float(self.walks.acceleration[int(self.walks.starts[1]) :, figure].max())
        settle_seconds, heal_seconds = self._settling_times(figure)
        return {
            "spearman": {n: spearman(SEVERITIES, values[: WORST + 1]) for n, values in measures.items()},
            "spearman_falling": {
                n: spearman(SEVERITIES[::-1], values[WORST:]) for n, values in measures.items()
            },
            "from_healthy_cm": round(rising[-1]["from_healthy"] - healthy_cm, 5),
            "after_healing_cm": round(rows[-1]["from_healthy"] - healthy_cm, 5),
            "hysteresis_cm": round(max(row["from_rising"] for row in falling[1:]) - healthy_cm, 5),
            "speed_share": round(rising[-1]["speed"] / rising[0]["speed"], 5)
            if rising[0]["speed"] > 0
            else None,
            "settle_seconds": settle_seconds,
            "heal_seconds": heal_seconds,
            "largest_acceleration": round(largest, 5),
            "acceleration_share": round(largest / max(rows[0]["largest_acceleration"], 1e-9), 5),
        }

    def _settling_times(self, figure: int) -> tuple[float | None, float | None]:
        """`settle_seconds` and `heal_seconds` of `response`. figure: index of the figure."""
        walks: Walks = self.at_once
        local, phase = walks.local[:, figure], walks.phase[:, figure]
        healthy = walks.measured_frames(1, figure)
        cycle = mean_cycle(local[healthy], phase[healthy])
        distance = distance_to_cycle(local, phase, cycle)
        healthy_cm = float(np.mean(distance[healthy]))
        # Stretch 2 is hurt, stretch 3 is healthy again. The second half of each shows the settled walk.
        hurt_start, heal_start, end = walks.starts[2:5]
        late_hurt = slice((hurt_start + heal_start) // 2, heal_start)
        late_healed = slice((heal_start + end) // 2, end)
        hurt_cm = float(np.mean(distance[late_hurt]))
        return (
            settling_seconds(distance[hurt_start:heal_start], healthy_cm, cycle_frames(phase[late_hurt])),
            settling_seconds(distance[heal_start:end], hurt_cm, cycle_frames(phase[late_healed])),
        )


def sweeps(
    network: Network, links: Sequence[str], gaits: Sequence[str], seconds: float, runtime: Runtime
) -> Iterator[SeveritySweep]:
    """Yield the sweep of each gait. seconds: time at each severity.

    The figures of all gaits walk in one crowd: first those of the first gait, one for each link, then those
    of the next.
    """
    assert network.skeleton is not None
    gait_of_figure = [gait for gait in gaits for _ in links]

    def stretch(share: float, severity: float) -> CrowdTarget:
        """`share` times `seconds` in which the link of each figure has `severity`."""
        hurt = severity_inputs(network, [{link: severity} for link in links] * len(gaits))
        return CrowdTarget(max(4, round(share * seconds * FPS)), gait_of_figure, hurt)

    walks = generate_walks(network, [stretch(WALK_IN, 0), *(stretch(1, s) for s in STEPS)], runtime)
    jump = [stretch(WALK_IN, 0), stretch(1, 0), stretch(JUMP_STRETCHES, 10), stretch(JUMP_STRETCHES, 0)]
    at_once = generate_walks(network, jump, runtime)
    for number, gait in enumerate(gaits):
        figures = slice(number * len(links), (number + 1) * len(links))
        yield SeveritySweep(
            network.skeleton, links, gait, walks.of_figures(figures), at_once.of_figures(figures)
        )
