"""The keys of a configuration's `training` section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from hobble.core.section import Positive, PositiveFloat, Section, Share


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
