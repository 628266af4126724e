"""The keys of a data set's `terrain` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Finite, MocapPath, Positive, PositiveFloat, Section


class HeightmapOptions(Section):
    """One source of ground: generated, matplotlib's elevation model of a real landscape, or a file."""

    kind: Literal["fractal", "hills", "stairs", "slope", "boxes", "beams", "elevation", "file"]
    path: MocapPath | None = Field(None, description="for kind: file; relative to the mocap folder")
    seed: int = 0
    cell: PositiveFloat | None = Field(None, description="width of a cell, cm, instead of terrain.cell")
    height_scale: PositiveFloat | None = Field(
        None, description="factor on the heights; for files it replaces terrain.height_scale"
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
    cell: PositiveFloat = Field(3.937007874, description="width of a cell, cm")
    size: Annotated[int, Field(gt=0, le=2048)] = Field(128, description="width of a patch, cells")
    height_scale: PositiveFloat = Field(3.0, description="factor that converts the heights in files to cm")
    highest: PositiveFloat = Field(
        50.0, description="patches with a height that is further than this from their mean are dropped, cm"
    )
    seed: int = 1

    @model_validator(mode="after")
    def _some_ground(self) -> Drawing:
        if not self.heightmaps:
            raise ValueError("`heightmaps` is empty, so there is no ground to draw patches from")
        return self


class Fitting(Section):
    """How patches are fitted under the cycles of a clip, for the rule `terrain_fits`."""

    fits: Positive = Field(
        10, description="fits of each cycle; a flat cycle has one, which is used this many times"
    )
    smoothing: Annotated[float, Field(ge=0)] = Field(
        0.1, description="regularisation of the radial basis functions"
    )
    heel_height: Literal["auto"] | Finite = Field(
        "auto", description="height of the heel joint above its sole, cm; `auto`: from the clip; original: 5"
    )
    toe_height: Literal["auto"] | Finite = Field(
        "auto", description="height of the toe joint above its sole, cm; `auto`: from the clip; original: 4"
    )
    sole: Finite = Field(
        4.0, description="what `auto` takes for the toe joint on ground that is not flat, cm"
    )
    deepest: PositiveFloat | None = Field(
        1.0, description="how far a foot may be below the ground, cm; null: no limit, as in the original"
    )
    bend_flat: bool = Field(
        True, description="correct flat ground if feet are more than `deepest` from it; false: keep it level"
    )
    flat_level: Literal["zero", "feet"] = Field(
        "zero",
        description="height of flat ground: zero, or the mean height of the soles in contact in each cycle, "
        "as in the original",
    )
    held_up: PositiveFloat | None = Field(
        2.0,
        description="on flat ground a heel in contact does not count if it is more than this above its toe, "
        "which is in contact, too (cm), and the other way round; null: no such rule, as in the original",
    )


class Terrain(Drawing, Fitting):
    """Patches of ground and their fits under the clips."""

    @model_validator(mode="after")
    def _enough_patches(self) -> Terrain:
        if self.patches < self.fits:
            raise ValueError(f"`patches` ({self.patches}) must not be fewer than `fits` ({self.fits})")
        return self


class HeightSampling(Section):
    """The keys of the section `database` that decide at which points rows need ground heights."""

    window: Positive
    step: Positive
    facing_sigma: PositiveFloat
    terrain_side: PositiveFloat
