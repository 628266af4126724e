"""The keys of a data set's `terrain` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Finite, MocapPath, Positive, PositiveFloat, Section


class HeightmapOptions(Section):
    """One heightmap: generated, read from a file, or matplotlib's elevation model of a real landscape."""

    kind: Literal["fractal", "hills", "stairs", "slope", "boxes", "beams", "elevation", "file"]
    path: MocapPath | None = Field(None, description="for kind: file; relative to the mocap folder")
    seed: int = 0
    cell: PositiveFloat | None = Field(
        None, description="width of this map's cells, cm; default: terrain.cell"
    )
    height_scale: PositiveFloat | None = Field(
        None, description="factor on the heights; for `kind: file` it replaces terrain.height_scale"
    )

    @model_validator(mode="after")
    def _path_for_files(self) -> HeightmapOptions:
        if (self.kind == "file") != (self.path is not None):
            raise ValueError("`path` is required for `kind: file` and not allowed for other kinds")
        return self


class Drawing(Section):
    """How patches are drawn from heightmaps, for the rule `terrain_patches`."""

    heightmaps: tuple[HeightmapOptions, ...] = Field(
        default_factory=lambda: tuple(
            HeightmapOptions(kind=kind, seed=i)
            for i, kind in enumerate(("fractal", "fractal", "hills", "stairs", "slope", "boxes", "beams"))
        )
    )
    patches: Positive = 20_000
    cell: PositiveFloat = Field(
        3.937007874, description="width of a patch's cells, and of a heightmap's unless it has its own, cm"
    )
    size: Annotated[int, Field(gt=0, le=2048)] = Field(128, description="width of a patch, cells")
    height_scale: PositiveFloat = Field(3.0, description="factor that converts the heights in files to cm")
    highest: PositiveFloat = Field(
        50.0, description="a patch is dropped if one of its heights is further than this from their mean, cm"
    )
    seed: int = 1

    @model_validator(mode="after")
    def _some_ground(self) -> Drawing:
        if not self.heightmaps:
            raise ValueError("`heightmaps` is empty, so there is no ground to draw patches from")
        return self


class Fitting(Section):
    """How patches are fitted under the gait cycles of a clip, for the rule `terrain_fits`."""

    fits: Positive = Field(
        10,
        description="fits of each cycle; on flat ground a cycle has only one, which counts this many times",
    )
    smoothing: Annotated[float, Field(ge=0)] = Field(
        0.1, description="regularisation of the radial basis functions"
    )
    heel_height: Literal["auto"] | Finite = Field(
        "auto",
        description="height of the heel joint above its sole, cm; `auto`: from the clip; Holden et al.: 5",
    )
    toe_height: Literal["auto"] | Finite = Field(
        "auto",
        description="height of the toe joint above its sole, cm; `auto`: from the clip; Holden et al.: 4",
    )
    sole: Finite = Field(
        4.0, description="`toe_height: auto` means this height on ground that is not flat, cm"
    )
    deepest: PositiveFloat | None = Field(
        1.0,
        description="how far a foot may be below the ground, cm; null: no limit, as in Holden et al. (2017)",
    )
    bend_flat: bool = Field(
        True,
        description="correct flat ground that is on average more than `deepest` from the feet in contact, or "
        "more than `deepest` above a foot; false: keep it level",
    )
    flat_level: Literal["zero", "feet"] = Field(
        "zero",
        description="height of flat ground: zero, or the mean height of the soles in contact in each cycle, "
        "as in Holden et al. (2017)",
    )
    held_up: PositiveFloat | None = Field(
        2.0,
        description="on flat ground, a heel does not count as in contact if the toe of its foot does and is "
        "more than this lower, cm; likewise for a toe above its heel; null: no such rule, as in Holden "
        "et al. (2017)",
    )


class Terrain(Drawing, Fitting):
    """Patches of ground and their fits under the clips."""

    @model_validator(mode="after")
    def _enough_patches(self) -> Terrain:
        if self.patches < self.fits:
            raise ValueError(f"`patches` ({self.patches}) must not be fewer than `fits` ({self.fits})")
        return self


class HeightSampling(Section):
    """The keys of the section `database` that decide at which points rows need ground heights.

    window: frames of the trajectory before and after the present one. step: frames between its samples.
    facing_sigma: smoothing of the facing direction, frames. terrain_side: cm from the path to the points
    beside it.
    """

    window: Positive
    step: Positive
    facing_sigma: PositiveFloat
    terrain_side: PositiveFloat
