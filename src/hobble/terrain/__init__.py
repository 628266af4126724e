"""Ground under the clips: heightmaps, patches cut from them, and the ten patches that fit each cycle best.

This file has the keys of the section `terrain` in the YAML file of a data set.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Finite, Positive, PositiveFloat, RelativePath, Section


class HeightmapOptions(Section):
    """One heightmap: generated, or read from a file."""

    kind: Literal["fractal", "hills", "stairs", "slope", "boxes", "beams", "file"]
    path: RelativePath | None = Field(
        None, description="file of the map, only for `kind: file`; relative to the mocap folder"
    )
    seed: int = 0
    cell: PositiveFloat | None = Field(
        None, description="width of this map's cells, cm; default: terrain.cell"
    )
    height_scale: PositiveFloat = Field(3.0, description="factor that converts the heights in the file to cm")

    @model_validator(mode="after")
    def _check_path(self) -> HeightmapOptions:
        if (self.kind == "file") != (self.path is not None):
            raise ValueError("`path` is required for `kind: file` and not allowed for other kinds")
        return self


class PatchOptions(Section):
    """How patches are drawn from heightmaps, for the rule `terrain_patches`."""

    heightmaps: Annotated[tuple[HeightmapOptions, ...], Field(min_length=1)] = Field(
        default_factory=lambda: tuple(
            HeightmapOptions(kind=kind, seed=i)
            for i, kind in enumerate(("fractal", "fractal", "hills", "stairs", "slope", "boxes", "beams"))
        )
    )
    patches: Positive = 20_000
    cell: PositiveFloat = Field(
        3.937007874,
        description="width of the cells of patches, and of heightmaps without their own `cell`, cm",
    )
    size: Annotated[int, Field(gt=0, le=2048)] = Field(128, description="width of a patch, cells")
    highest: PositiveFloat = Field(
        50.0,
        description="a patch is dropped if one of its heights is further than this from its mean height, cm",
    )
    seed: int = 1


class FitOptions(Section):
    """How patches are fitted under the gait cycles of a clip, for the rule `terrain_fits`.

    A fit is a patch that suits the footsteps of a cycle, corrected to meet the feet.
    """

    fits: Positive = Field(
        10,
        description="fits of each cycle; on flat ground a cycle has only one, which counts this many times",
    )
    heel_height: Literal["auto"] | Finite = Field(
        "auto",
        description="height of the heel joint above its sole, cm; `auto`: computed from the clip; Holden et "
        "al. (2017) use 5",
    )
    toe_height: Literal["auto"] | Finite = Field(
        "auto",
        description="height of the toe joint above its sole, cm; `auto`: computed from the clip; Holden et "
        "al. (2017) use 4",
    )
    deepest: PositiveFloat | None = Field(
        1.0,
        description="how far a foot may be below the ground, cm. Flat ground is corrected if the feet in "
        "contact are on average further than this from it. null: no limit, as in Holden et al. (2017)",
    )
    flat_level: Literal["zero", "feet"] = Field(
        "zero",
        description="height of flat ground. zero: 0; feet: the mean height of the soles in contact in each "
        "cycle, as in Holden et al. (2017)",
    )
    held_up: PositiveFloat | None = Field(
        2.0,
        description="on flat ground, a heel in contact does not count if the toe of the same foot is in "
        "contact, too, and lower by more than this, cm; likewise for a toe above its heel; null: every "
        "contact counts, as in Holden et al. (2017)",
    )


class Terrain(PatchOptions, FitOptions):
    """Patches of ground and their fits under the clips."""

    @model_validator(mode="after")
    def _enough_patches(self) -> Terrain:
        if self.patches < self.fits:
            raise ValueError(f"`patches` ({self.patches}) must not be fewer than `fits` ({self.fits})")
        return self


class HeightSampling(Section):
    """The keys of the section `database` that decide at which points rows need ground heights.

    window: frames of the trajectory before and after the present one. step: frames between the samples
    of the trajectory. facing_sigma: smoothing of the facing direction, frames. terrain_side: distance from
    the path to the points at its sides, cm.
    """

    window: Positive
    step: Positive
    facing_sigma: PositiveFloat
    terrain_side: PositiveFloat
