"""The typed models of the YAML files: configuration, data set and skeleton."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, create_model, field_validator, model_validator

from hobble.channels import CHANNEL_NAMES, channel
from hobble.core.clip_files import CLIP_NAME_RULE, is_valid_clip_name
from hobble.core.section import FrameRange, Gait, Ground, Positive, PositiveFloat, RelativePath, Section
from hobble.core.skeleton import SkeletonData
from hobble.database import DatabaseOptions
from hobble.hurt import Hurt
from hobble.labels import LabelOptions
from hobble.measures.measure import all_measures, joined_options
from hobble.models import DEFAULT_KIND, options_of_kind
from hobble.models.model import Options
from hobble.motion import Download, MotionOptions
from hobble.report import ReportOptions
from hobble.runtime import Runtime
from hobble.synthetic.generate_clip import Synthetic
from hobble.terrain import Terrain
from hobble.training import Training

if TYPE_CHECKING:  # a type checker cannot follow the class that is made below
    Evaluation = Section
else:
    Evaluation = joined_options([measure.options for measure in all_measures()])


def _check_clip_name(name: str) -> str:
    if not is_valid_clip_name(name):
        raise ValueError(f"a clip's name must have {CLIP_NAME_RULE}")
    return name


def _check_channel_name(name: str) -> str:
    if name not in CHANNEL_NAMES:
        raise ValueError(f"must be a channel ({', '.join(CHANNEL_NAMES)})")
    return name


Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")]
ClipName = Annotated[str, AfterValidator(_check_clip_name)]
ChannelName = Annotated[str, AfterValidator(_check_channel_name)]


class ClipEntry(Section):
    """The entry of one clip in a data set."""

    gait: Gait | None = Field(None, description="the main gait of the clip, for automatic labels")
    ground: Ground = "flat"
    channels: dict[ChannelName, Any] = Field({}, description="channel -> its value in all frames of the clip")
    person: Name | None = Field(
        None, description="who walks; needed by measurements that leave out all clips of a person"
    )
    file: ClipName | None = Field(
        None, description="name of the BVH file without .bvh; by default that of the clip"
    )
    frames: FrameRange | None = Field(
        None, description="first and last frame of the file that are used, counted from 1"
    )
    recipe: str | None = Field(
        None,
        description="makes this a generated clip, not one of the folder: what the walker does, a key of "
        "`hobble.synthetic.plan.RECIPES`",
    )
    share: PositiveFloat = Field(1.0, description="of a generated clip: length relative to the other ones")
    source_fps: PositiveFloat | None = Field(None, description="overrides the file's Frame Time")
    hurt: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] | None = Field(
        None,
        description="total length of the clip's hurt versions, as a multiple of the clip's length; overrides "
        "`hurt.versions` and `hurt.longest` of the data set",
    )
    hurt_every: Annotated[int, Field(ge=1, le=60)] | None = Field(
        None, description="training uses every n-th frame of the clip's hurt versions; overrides `hurt.every`"
    )
    loops: Positive | None = Field(None, description="overrides motion.loops")


class Dataset(Section):
    """Clips, their skeleton, and how a database is made from them."""

    extends: Name | None = None
    skeleton: Name
    source: Name | None = Field(
        None, description="use the generated or downloaded BVH files of this data set"
    )
    folder: RelativePath | None = Field(None, description="folder of the BVH files, inside the mocap folder")
    download: Download | None = Field(None, description="where to download clips that are not in the folder")
    clips: dict[ClipName, ClipEntry | None] = Field(
        default_factory=dict, description="clips by name; empty: every .bvh in the folder and its subfolders"
    )
    held_out: tuple[ClipName, ...] = Field(
        (), description="clips that, with their mirror images, are not used for training"
    )
    mirror: bool = False
    channels: dict[ChannelName, dict[str, Any]] = Field(
        {}, description="channel -> its options, for channels that have options"
    )
    synthetic: Synthetic | None = None
    motion: MotionOptions = MotionOptions()
    labels: LabelOptions = LabelOptions()
    hurt: Hurt | None = Field(
        None, description="how to compute hurt versions of healthy clips, which are added as further clips"
    )
    terrain: Terrain = Terrain()
    database: DatabaseOptions = DatabaseOptions()

    @field_validator("channels")
    @classmethod
    def _validate_options(cls, sections: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
        """Validate the options of each channel, and fill in their defaults."""
        validated = {}
        for name, values in sections.items():
            options = channel(name).Options
            if options is None:
                raise ValueError(
                    f"channel {name} has no options; its values are read from files beside the clips"
                )
            validated[name] = options.model_validate(values).model_dump(mode="json")
        return validated

    @model_validator(mode="after")
    def _check_clips(self) -> Dataset:
        if self.synthetic is None and self.folder is None:
            raise ValueError("a data set needs `folder` (BVH files) or `synthetic` (generated clips)")
        if self.synthetic is not None and not self.clips:
            raise ValueError("a data set with generated clips needs a list of its `clips`")
        for name, entry in self.clips.items():
            if entry is not None and entry.recipe is not None and self.synthetic is None:
                raise ValueError(f"clips.{name} has a `recipe`, but the data set no section `synthetic`")
        if self.download is not None and not (self.folder and self.clips):
            raise ValueError("a data set that downloads its clips needs a list of its `clips` and a `folder`")
        unknown = [c for c in self.held_out if self.clips and c not in self.clips]
        if unknown:
            raise ValueError(f"held_out names clips that are not in `clips`: {', '.join(unknown)}")
        return self


class Configuration(Section):
    """One network: its data set, its training, and the options to run, measure and report it."""

    extends: Name | None = None
    dataset: Name = "synthetic"
    channels: tuple[ChannelName, ...] = Field(
        (), description="input channels of the network; clips with values of other channels are left out"
    )
    network_of: Name | None = Field(
        None, description="use the network of this other configuration instead of training one"
    )
    # For other kinds of network, see `configuration_of`.
    network: Options = options_of_kind(DEFAULT_KIND)()
    training: Training = Training()
    runtime: Runtime = Runtime()
    evaluation: Evaluation = Evaluation()
    report: ReportOptions = ReportOptions()

    @field_validator("channels")
    @classmethod
    def _sort_channels(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        """Each channel once, in the order of `hobble.channels.CHANNEL_NAMES`.

        So configurations that name the same channels in different orders share a database.
        """
        return tuple(name for name in CHANNEL_NAMES if name in names)


@functools.cache
def configuration_of(kind: str) -> type[Configuration]:
    """A subclass of `Configuration` whose section `network` has the keys of this kind of network.

    kind: one of `hobble.models.NETWORK_KINDS`.
    """
    options = options_of_kind(kind)
    return create_model("Configuration", __base__=Configuration, network=(options, options()))


class SkeletonFile(SkeletonData):
    """A skeleton file. `hobble.core.skeleton.Skeleton` explains all keys but `maps`."""

    maps: dict[Name, dict[str, str]] = Field(
        {}, description="for retargeting: name of another skeleton -> {joint of this one: joint of the other}"
    )
