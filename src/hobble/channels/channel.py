"""What a channel says of itself. The body is told values of 0 or more, 0 where there is nothing to tell."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

# What brings numpy is imported by the methods that compute: the list of clips is read without it.
if TYPE_CHECKING:
    from hobble.core.clip import Clip
    from hobble.core.quat import Array
    from hobble.core.section import Section


class Rig(Protocol):
    """What the columns of a channel may depend on: the skeleton of a clip, or the file that describes it."""

    @property
    def links(self) -> Sequence[tuple[str, str]]:
        """Pairs of joints (parent, child) that can be told something."""


@dataclass(frozen=True)
class Source:
    """Where the values of one clip come from, as a data set has it; plain data, but for the files.

    clip: its name (a mirror's original). entry: its entry in the data set, and `value` what stands there for
    this channel. options: the data set's section `channels.<name>`. files: those beside the clip and the
    tables of the data set, as far as they are there.
    """

    clip: str
    entry: Mapping[str, Any] = field(default_factory=dict)
    value: Any = None
    options: Mapping[str, Any] = field(default_factory=dict)
    files: Sequence[str | Path] = ()


class Channel(ABC):
    """One thing that the body is told. A subclass in channels/<name>/ says what differs from this.

    name: of the folder, in configurations, and the keyword of `next_pose`. title, value: for people: the
    channel and one of its values. highest: values are 0 to this. rate: most that a value may change in a
    second at run time, unless the configuration says otherwise. suffix: of a file beside a clip that holds
    values, or None. former: keys that older files have for this channel. Options: the data set's section
    `channels.<name>`; a channel that has one is known of a data set that gives it, any other of every data
    set. slows: whether values above 0 make the body slower; then its speed limits are learnt from the rows
    (see `hobble.channels.limits`). targets: folders of results/<configuration>/ that only a configuration
    with this channel can have.
    """

    name: str
    title: str
    value: str = "value"
    highest: float = 1.0
    rate: float = 1.0
    suffix: str | None = None
    former: Sequence[str] = ()
    Options: type[Section] | None = None
    slows: bool = False
    targets: Sequence[str] = ()

    @abstractmethod
    def columns(self, rig: Rig) -> tuple[str, ...]:
        """The labels of its columns for a figure, each once."""

    @abstractmethod
    def is_neutral(self, source: Source) -> bool:
        """Whether nothing is told in any frame, by what the data set says: a clip for every network.

        Raises InputError where the data set cannot be understood.
        """

    @abstractmethod
    def read(self, clip: Clip, source: Source, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Values (F, C) float32 of a clip, a column for each label, and warnings.

        motion: the report of the motion stage. Raises InputError where the source cannot be understood.
        """

    def check(self, source: Source, rig: Rig) -> None:  # noqa: B027 - most have nothing to check
        """Raise InputError for what a clip's entry or the options say that cannot be, before any job runs."""

    def tables(self, options: Mapping[str, Any]) -> Sequence[str]:
        """Files inside the mocap folder that the options name."""
        return ()

    def mirror(self, values: Array, rig: Any) -> Array:
        """Values (F, C) of the mirrored clip; the same, unless a channel tells left from right."""
        return values

    def deviation(self, std: Array) -> Array:
        """What columns of these standard deviations (C,) are divided by, for the network's input.

        All by one: the length of the vector of deviations, never less than a tenth of `highest`. Taking each
        column's own would turn what is told in 1 frame of 1,000 into an input of 30 deviations. A column that
        never varies is silenced: the network cannot know what it does.
        """
        import numpy as np

        whole = float(np.sqrt(np.sum(std**2)))
        return np.where(std > LEAST, max(self.highest / 10, whole), SILENT)

    def told(self, values: Array, labels: Sequence[str], fps: float) -> dict[str, Any]:
        """For the clip's report: label -> `seconds` above 0, `highest` value and `spells`, where any is."""
        import numpy as np

        return {
            label: {
                "seconds": float(np.sum(column > 0) / fps),
                "highest": float(column.max()),
                "spells": spells(column, fps, self.highest),
            }
            for label, column in zip(labels, values.T, strict=True)
            if column.any()
        }


SILENT = 1e10  # the deviation of an input that is to have no effect: it standardises to nothing
JUMP = 0.05  # of a channel's highest value, from one frame to the next
LEAST = 1e-6  # below this a column does not vary at all


def spells(column: Array, fps: float, highest: float) -> list[list[float]]:
    """[from, to, highest value] in seconds of each stretch above 0; a jump of the value begins another.

    A value that rises or falls over many frames makes no jump.
    """
    import numpy as np

    on = column > 0
    jumps = (np.abs(np.diff(column)) > JUMP * highest) | (on[1:] != on[:-1])
    edges = np.concatenate([[0], np.flatnonzero(jumps) + 1, [len(column)]])
    return [
        [round(float(a / fps), 3), round(float(b / fps), 3), float(column[a:b].max())]
        for a, b in itertools.pairwise(edges)
        if on[a]
    ]
