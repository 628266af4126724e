"""Creates clips of a synthetic walker (BVH, footsteps, gait). A recipe says what the walker does."""

from pathlib import Path

from hobble.core.untrusted import read_yaml
from hobble.synthetic.generate_clip import write_clip
from hobble.synthetic.options import Synthetic
from hobble.workflow.batch_job import make_each


def make_synthetic_clip(piece, log):
    """Write a clip and the label files beside it.

    piece: the clip with its params and files, a `JobPiece`.
    """
    source = Path(piece.input["skeleton"])
    write_clip(
        piece.name,
        {"name": source.stem, **read_yaml(source)},
        piece.params["frames"],
        piece.params["recipe"],
        Synthetic.model_validate(piece.params["options"]),
        bvh=piece.output["bvh"],
        footsteps=piece.output["footsteps"],
        gait=piece.output["gait"],
    )


make_each(snakemake, make_synthetic_clip)
