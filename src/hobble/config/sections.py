"""The typed sections of a data set and of a configuration: every key, its default, its unit and its range.

These models are read once, before the DAG is built. Jobs get plain dicts of the values, so that editing a
description here re-runs nothing.
"""

from __future__ import annotations

import re
from pathlib import Path
from string import Formatter
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator


def _inside(path: str) -> str:
    """A path that stays in the folder that it is relative to."""
    if Path(path).is_absolute() or ".." in Path(path).parts or not path.isprintable():
        raise ValueError("must be relative to the mocap folder and stay in it")
    return path


def _sixty(fps: float) -> float:
    """The rate in which all that follows counts: windows, speeds, thresholds, the character's own frames."""
    if fps != 60.0:
        raise ValueError("clips are made at 60 frames a second, whatever the rate of their files")
    return fps


def _some(lengths: tuple[int, ...]) -> tuple[int, ...]:
    """At least one length: of none there is nothing to measure."""
    if not lengths:
        raise ValueError("must name at least one number of frames")
    return lengths


# Upper bounds keep a mistyped or a stranger's configuration from asking for more memory than machines have.
Positive = Annotated[int, Field(gt=0, le=1_000_000)]
PositiveFloat = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1)]
SixtyHz = Annotated[float, AfterValidator(_sixty)]
Inside = Annotated[str, AfterValidator(_inside)]
Ground = Literal["flat", "rocky", "jumpy", "beam"]
Gait = Literal["stand", "walk", "jog", "crouch", "jump", "bump"]
PhaseMode = Literal["constant", "linear", "cubic"]
# What results/compare/ sets side by side where --config compare names nothing else: the published sizes and
# passes, and the figure that can be hurt.
COMPARED = ("holden", "holden-xl", "holden-xt", "injured")


class Section(BaseModel):
    """A part of a YAML file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True)


class Synthetic(Section):
    """The embedded data set: how much of it, and from which seed."""

    frames: Annotated[int, Field(ge=600, le=1_000_000_000)] = Field(
        20_000, description="frames at 60 Hz over all clips together"
    )
    fps: Literal[60, 120] = Field(120, description="frames a second in the files written")
    seed: int = 1


class Download(Section):
    """Where clips come from that the user's folder lacks."""

    url: str = Field(
        description="of a clip's file: {clip} its name, {subject} what stands before its first _"
    )
    checksums: Inside = Field(
        description="SHA-256 of each file, as sha256sum writes them; beside the data set's own file"
    )

    @model_validator(mode="after")
    def _url_of_a_clip(self) -> Download:
        try:
            fields = {name for _, name, _, _ in Formatter().parse(self.url) if name is not None}
            made = self.url.format(clip="02_01", subject="02")
        except (ValueError, LookupError, AttributeError) as error:
            raise ValueError(f"url: {error}") from None
        if not fields <= {"clip", "subject"} or "clip" not in fields:
            raise ValueError("url: {clip} must stand in it, {subject} may, and nothing else in braces")
        if not re.fullmatch(r"https?://[^/\s]+/\S+", made):
            raise ValueError("url: must be an address like https://host/{subject}/{clip}.bvh")
        return self


class Motion(Section):
    """How BVH files are read and checked. `auto` is found from the rig; anything else overrules it."""

    fps: SixtyHz = Field(60.0, description="frames a second of the clips made: what follows counts in 60ths")
    source_fps: PositiveFloat | None = Field(None, description="overrules the files' Frame Time")
    unit: Literal["auto"] | PositiveFloat = Field("auto", description="centimetres per unit of the file")
    up: Literal["auto", "Y", "Z"] = "auto"
    handedness: Literal["auto", "right", "left"] = Field(
        "auto", description="of the file's coordinates; a left-handed file has x negated"
    )
    facing: Finite | None = Field(
        None, description="where the figure faces first, degrees from +Z towards +X; else as in the file"
    )
    proportions: Literal["skeleton", "clip"] = Field(
        "skeleton", description="retarget onto the skeleton's bone lengths, or keep each clip's own"
    )
    defects: Literal["repair", "refuse"] = Field(
        "repair", description="what to do with frames that are plainly broken; repairs are reported"
    )
    loops: Positive = Field(1, description="how often a clip that is one short cycle is repeated")
    heading: Finite | None = Field(
        None, description="where a looped clip leads, degrees from +Z towards +X; as in the file by default"
    )


class Labels(Section):
    """Contacts, phase and gait. Speeds are those of the facts page: centimetres a frame at 120 Hz."""

    files: bool = Field(True, description="use hand-made label files where they lie beside the clip")
    contact_threshold: PositiveFloat = Field(0.02, description="squared displacement, cm2 per 60 Hz frame")
    phase_zero: Literal["right", "left"] = Field("right", description="the foot that lands at phase 0")
    heel_speed: PositiveFloat = 0.375
    toe_speed: PositiveFloat = 0.0875
    valley_factor: PositiveFloat = 2.875
    margins: Literal["extend", "drop"] = Field(
        "extend",
        description="what becomes of a cycle with less than a second of clip before or after it: the path "
        "goes on straight past the clip's end, or, as in the original, the cycle is dropped",
    )
    shortest_step: Positive = Field(5, description="steps of this many 120 Hz frames or fewer are dropped")


class Terrain(Section):
    """Patches of ground and their fits under the clips."""

    heightmaps: tuple[Heightmap, ...] = Field(
        default_factory=lambda: tuple(
            Heightmap(kind=kind, seed=i)
            for i, kind in enumerate(("fractal", "fractal", "hills", "stairs", "slope", "boxes", "beams"))
        )
    )
    patches: Positive = 20_000
    fits: Positive = Field(10, description="fits kept for each cycle; a flat cycle has one, counted so often")
    cell: PositiveFloat = Field(3.937007874, description="centimetres a cell")
    size: Annotated[int, Field(gt=0, le=2048)] = Field(128, description="cells a side of a patch")
    height_scale: PositiveFloat = 3.0
    highest: PositiveFloat = Field(50.0, description="a patch that goes further from its mean is dropped")
    smoothing: Annotated[float, Field(ge=0)] = Field(0.1, description="regularisation of the residual's RBF")
    heel_height: Literal["auto"] | Finite = Field(
        "auto", description="of the heel joint above its sole, cm; the original has 5, `auto` asks the clip"
    )
    toe_height: Literal["auto"] | Finite = Field("auto", description="likewise; the original has 4")
    sole: Finite = Field(4.0, description="`auto` on ground that is not flat: below the toe joint, cm")
    deepest: PositiveFloat | None = Field(
        1.0, description="no foot goes further below the ground, cm; null as in the original: not looked at"
    )
    bend_flat: bool = Field(
        True, description="let flat ground give way where feet are off by more than `deepest`; else level"
    )
    flat_level: Literal["zero", "feet"] = Field(
        "zero",
        description="where flat ground lies; `feet` as in the original: at the mean height of the soles in "
        "contact, for each cycle",
    )
    held_up: PositiveFloat | None = Field(
        2.0,
        description="a heel that keeps still so far above its standing toe is not on flat ground, cm; null "
        "as in the original: not looked at",
    )
    seed: int = 1

    @model_validator(mode="after")
    def _enough_patches(self) -> Terrain:
        if not self.heightmaps:
            raise ValueError("`heightmaps` names none, so that there is no ground to draw patches from")
        if self.patches < self.fits:
            raise ValueError(f"`patches` ({self.patches}) are fewer than the `fits` of a cycle ({self.fits})")
        return self


class Heightmap(Section):
    """One source of ground: generated, matplotlib's real elevation model, or a file."""

    kind: Literal["fractal", "hills", "stairs", "slope", "boxes", "beams", "elevation", "file"]
    path: Inside | None = Field(None, description="for kind: file; relative to the mocap folder")
    seed: int = 0
    cell: PositiveFloat | None = Field(None, description="centimetres a cell, where not terrain.cell")
    height_scale: PositiveFloat | None = Field(
        None, description="for files instead of terrain.height_scale; other kinds are multiplied by it"
    )

    @model_validator(mode="after")
    def _path_for_files(self) -> Heightmap:
        if (self.kind == "file") != (self.path is not None):
            raise ValueError("`path` goes with `kind: file`, and only with it")
        return self


class Database(Section):
    """What a row holds and how rows lie on disk."""

    window: Annotated[int, Field(gt=0, le=3600)] = Field(
        60, description="frames to each side of the present one"
    )
    step: Positive = Field(10, description="frames between trajectory samples")
    facing_sigma: PositiveFloat = Field(20.0, description="smoothing of the facing direction, frames")
    joint_weight: PositiveFloat = 0.1
    terrain_side: PositiveFloat = Field(25.0, description="centimetres from the path to the side heights")
    dtype: Literal["float32", "float16", "bfloat16"] = Field(
        "float32", description="of the rows on disk; the others take half the bytes, float16 more exactly"
    )
    seed: int = 1

    @model_validator(mode="after")
    def _whole_steps(self) -> Database:
        if self.window % self.step:
            raise ValueError(f"window ({self.window}) must be a multiple of step ({self.step})")
        return self


class Network(Section):
    """The phase-functioned network. Two hidden layers is what the published weight sizes show."""

    hidden_layers: Annotated[int, Field(ge=1, le=8)] = 2
    units: Annotated[int, Field(gt=0, le=8192)] = 512
    control_points: Annotated[int, Field(ge=4, le=16)] = 4


class Training(Section):
    """The original recipe; a pass is every (frame, fit) pair once, in `sections` sections."""

    passes: Positive = 20
    sections: Positive = 10
    batch: Positive = 32
    learning_rate: PositiveFloat = 1e-4
    schedule: Literal["constant", "cosine"] = Field(
        "constant", description="of the learning rate; cosine falls to 0 at the end of the last pass"
    )
    warm_up: Annotated[float, Field(ge=0)] = Field(0.0, description="passes in which the rate rises from 0")
    beta1: Share = 0.9
    beta2: Share = 0.999
    dropout: Share = Field(0.3, description="share of units dropped before each layer, the input included")
    l1: Annotated[float, Field(ge=0)] = Field(0.01, description="weight of the mean absolute weights")
    rollout: Positive = Field(
        1, description="frames over which errors of the network stay in the pose that it is given; 1: none"
    )
    seed: int = 1
    memory_mb: Positive = Field(512, description="largest part of the database held in memory")
    continues: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")] | None = Field(
        None, description="a configuration whose last checkpoint is the start"
    )
    device: Literal["auto", "cpu", "cuda"] = "auto"
    precision: Literal["auto", "float32", "tf32", "bfloat16"] = Field(
        "auto",
        description="factors of the products; auto: bfloat16 from batch 256 on where it is fast, below "
        "it tf32 on CUDA; a CPU has no tf32 and takes float32",
    )

    @model_validator(mode="after")
    def _can_go_on(self) -> Training:
        if self.continues and self.schedule != "constant":
            raise ValueError(
                "`continues` needs `schedule: constant`; after another there is nothing to go on with"
            )
        return self


class Runtime(Section):
    """The character."""

    mode: PhaseMode = Field("cubic", description="how phase is looked up")
    severity_rate: PositiveFloat = Field(10.0, description="largest change of a severity in a second")
    severity_scale: PositiveFloat = Field(1.0, description="severities are divided by this")
    foot_locking: bool = True
    steering: Annotated[float, Field(ge=0)] = Field(
        2.0, description="how hard a velocity that is not reached is asked for; 0 is the original runtime"
    )


class Evaluation(Section):
    """The measurements."""

    joints: Literal["all", "equivalent"] = Field(
        "all", description="`equivalent`: only the joints that the 31-joint skeleton has too"
    )
    rollouts: Annotated[tuple[Positive, ...], AfterValidator(_some)] = Field(
        (1, 10, 60, 300), description="frames for which the network is fed its own pose"
    )
    laps: Positive = 19
    lap_seconds: Annotated[float, Field(ge=1, allow_inf_nan=False)] = Field(
        400.0, description="a lap that takes longer is ended there"
    )
    modes: tuple[PhaseMode, ...] = Field(
        ("constant", "linear", "cubic"),
        description="phase modes that laps are run in, beside the runtime's own",
    )
    seconds: PositiveFloat = Field(4.0, description="at each severity of the injury sweeps")


class Report(Section):
    """The page."""

    title: str | None = None


Terrain.model_rebuild()
