"""The base class of channels. A channel is an input of the network besides motion and ground.

In each frame of a clip, a channel has a value in each of its columns. Values are 0 or more. 0 has no effect.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, load_declared, read_declared
from hobble.core.errors import InputError
from hobble.core.files import save_npz, write_json
from hobble.core.quat import Array
from hobble.core.section import Section

SILENCING_STD = 1e10  # divisor of an input that must have no effect
CONSTANT_BELOW = 1e-6  # a column with a smaller standard deviation counts as constant


class HasLinks(Protocol):
    """A clip's skeleton or a skeleton file. The columns of a channel may depend on its links.

    A link is a pair of neighbouring joints.
    """

    @property
    def links(self) -> Sequence[tuple[str, str]]:
        """The links, as (parent joint, child joint). A channel may have a column for each link."""


@dataclass(frozen=True)
class ClipSource:
    """Where the values of one clip come from.

    clip: the clip's name; for a mirrored clip, the name of its original. value: what the clip's entry in the
    data set says for this channel; None if it says nothing. options: the data set's section
    `channels.<name>`, read by the channel's `Options`. files: the channel's file beside the clip, if it
    exists, and the channel's tables (`Channel.table_files`).
    """

    clip: str
    value: Any = None
    options: Section | None = None
    files: Sequence[str | Path] = ()


class Channel(ABC):
    """A channel. Each channel is a subclass in channels/<name>/.

    name: the name of the channel's folder. It is also used in configurations and as a keyword argument of
    `next_pose`. default: the value of all columns until `next_pose` is told another one. title: the page's
    word for the channel. value_word: the page's word for one of its values.
    highest: the highest value. rate: how much a value may change in a second at run time, unless the
    configuration says otherwise. suffix: a file <clip><suffix> beside a clip holds the clip's values; None if
    the channel has no such files. Options: pydantic model of the data set's section `channels.<name>`. If
    `Options` is None, every data set has the channel, else only data sets with this section have it. slows:
    whether values above 0 make the body slower. If so, `hobble.channels.speed_limits` learns from the
    database how fast such a body goes. manner: whether each column is a way of walking that
    lasts for a whole clip, such as a mood. If so, `hobble.measures.recognition` measures whether a recogniser
    finds it in generated walks. exponent: of the curve through which a network reads the values, see
    `read_through_curve`. targets: folders of results/<configuration>/ that
    only a configuration with this channel can have.
    """

    name: str
    title: str
    value_word: str = "value"
    highest: float = 1.0
    default: float = 0.0
    rate: float = 1.0
    suffix: str | None = None
    Options: type[Section] | None = None
    slows: bool = False
    manner: bool = False
    exponent: float = 1.0
    targets: Sequence[str] = ()

    @abstractmethod
    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """Labels of the channel's C columns for a skeleton. No label appears twice."""

    @abstractmethod
    def is_neutral(self, source: ClipSource) -> bool:
        """Whether all values of the clip are 0.

        A network without this channel trains only on clips whose values are all 0. Raises InputError if the
        source cannot be read.
        """

    @abstractmethod
    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Values (F, C) float32 of a clip with F frames, columns in the order of `columns`, and warnings.

        motion: the report on how the clip was made from its BVH file. Raises InputError if the source cannot
        be read.
        """

    def read_checked(
        self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]
    ) -> tuple[Array, list[str]]:
        """As `read`. Also raises InputError, which names the frame, for a value outside the range."""
        values, warnings = self.read(clip, source, motion)
        wrong = ~((values >= 0) & (values <= self.highest))
        if wrong.any():
            frame, column = (int(i) for i in np.argwhere(wrong)[0])
            value = f"{self.value_word} {values[frame, column]:g} of {self.columns(clip.skeleton)[column]}"
            raise InputError(clip.name, f"{value} is not between 0 and {self.highest:g}", frame=frame)
        return values, warnings

    def check(self, source: ClipSource, rig: HasLinks) -> None:  # noqa: B027 - most channels check nothing
        """Raise InputError if the clip's entry or the options are wrong. Called before any job runs."""

    def make_source(self, fields: Mapping[str, Any], files: Sequence[str | Path] = ()) -> ClipSource:
        """A `ClipSource` from plain data.

        fields: the fields of `ClipSource` without `files`; its `options` are a plain mapping. Raises
        pydantic.ValidationError for options that the channel does not have.
        """
        return ClipSource(**{**fields, "options": self.options_of(fields.get("options", {}))}, files=files)

    def options_of(self, section: Mapping[str, Any]) -> Section | None:
        """The data set's section for this channel, read by `Options`; None without section or `Options`."""
        return self.Options.model_validate(section) if self.Options is not None and section else None

    def table_files(self, options: Section | None) -> Sequence[str]:
        """Names of files in the mocap folder that the options refer to, such as a table of all clips."""
        return ()

    def mirror(self, values: Array, rig: Any) -> Array:
        """Values (F, C) of the mirrored clip. By default they stay the same."""
        return values

    def divisors(self, std: Array) -> Array:
        """The divisors (C,) by which the channel's columns are divided before the network reads them.

        std: (C,) standard deviations of the columns over the training rows.

        The columns that vary all get the same divisor, which is the length of the vector `std`, but at least
        a tenth of `highest`. If each column were divided by its own deviation, a column that is above 0 in 1
        frame of 1,000 would reach 30 in this frame. A column that never varies gets a divisor so large that
        the column has no effect, because the network cannot learn what it means.
        """
        length = float(np.sqrt(np.sum(std**2)))
        return np.where(std > CONSTANT_BELOW, max(self.highest / 10, length), SILENCING_STD)


class ClipChannel(Channel):
    """A channel whose values are the same in all frames of a clip.

    Value: the type of what the clip's entry says, for pydantic.
    """

    Value: Any

    @abstractmethod
    def values_of(self, source: ClipSource) -> Sequence[float] | None:
        """The clip's C values; None if nothing says them."""

    def is_neutral(self, source: ClipSource) -> bool:
        """As in `Channel`."""
        return not any(self.values_of(source) or ())

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """As in `Channel`."""
        if source.value is not None:
            read_declared(f"{source.clip}.channels.{self.name}", "the value", self.Value, source.value)

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Values (F, C) of a clip with F frames, all 0 with a warning if nothing says them."""
        values = self.values_of(source)
        warnings = [f"nothing says the {self.name} of {source.clip}; it counts as neutral."]
        row = np.zeros(len(self.columns(clip.skeleton)), np.float32) if values is None else values
        return np.tile(np.asarray(row, np.float32), (len(clip), 1)), warnings * (values is None)


def read_through_curve(values: Any, highest: Any, exponent: Any) -> Any:
    """What a network reads of values from 0 to `highest`: highest * (value / highest) ** exponent.

    An effect that grows with this power of the value is a straight line for the network. It learns a line
    from few clips, but a curve only from many.
    """
    return highest * (values / highest) ** exponent


# Files with the values of a channel in each of the F frames of a clip, and what was odd about them.


def save_values(path: str | Path, values: Array, labels: Sequence[str]) -> None:
    """Write values (F, C) and the labels of their columns as one npz file."""
    save_npz(path, values=values, labels=np.array(list(labels), dtype=np.str_))


def load_values(path: str | Path) -> tuple[Array, tuple[str, ...]]:
    """Read a file of `save_values`. Returns the values (F, C) and the labels of their columns."""
    data = load_declared(path, {"values": ArrayOf(("F", "C"), low=0), "labels": ArrayOf(("C",), "U")})
    return data["values"], tuple(str(label) for label in data["labels"])


def write_report(path: str | Path, name: str, clip: str, warnings: Sequence[str]) -> None:
    """Write the warnings about the values of channel `name` in a clip as JSON."""
    write_json(path, {"clip": clip, "channel": name, "warnings": list(warnings)})
