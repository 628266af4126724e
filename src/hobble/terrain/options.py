"""The keys of a data set's `terrain` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Finite, Inside, Positive, PositiveFloat, Section


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


class Drawing(Section):
    """How patches are drawn from heightmaps: what the rule `terrain_patches` reads."""

    heightmaps: tuple[Heightmap, ...] = Field(
        default_factory=lambda: tuple(
            Heightmap(kind=kind, seed=i)
            for i, kind in enumerate(("fractal", "fractal", "hills", "stairs", "slope", "boxes", "beams"))
        )
    )
    patches: Positive = 20_000
    cell: PositiveFloat = Field(3.937007874, description="centimetres a cell")
    size: Annotated[int, Field(gt=0, le=2048)] = Field(128, description="cells a side of a patch")
    height_scale: PositiveFloat = 3.0
    highest: PositiveFloat = Field(50.0, description="a patch that goes further from its mean is dropped")
    seed: int = 1

    @model_validator(mode="after")
    def _some_ground(self) -> Drawing:
        if not self.heightmaps:
            raise ValueError("`heightmaps` names none, so that there is no ground to draw patches from")
        return self


class Fitting(Section):
    """How patches are fitted under the cycles of a clip: what the rule `terrain_fits` reads."""

    fits: Positive = Field(10, description="fits kept for each cycle; a flat cycle has one, counted so often")
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


class Terrain(Drawing, Fitting):
    """Patches of ground and their fits under the clips."""

    @model_validator(mode="after")
    def _enough_patches(self) -> Terrain:
        if self.patches < self.fits:
            raise ValueError(f"`patches` ({self.patches}) are fewer than the `fits` of a cycle ({self.fits})")
        return self


class Sampling(Section):
    """Where rows want heights: those keys of the section `database` that decide it."""

    window: Positive
    step: Positive
    facing_sigma: PositiveFloat
    terrain_side: PositiveFloat
