"""Every advice to delete something damaged is followed, and the same command makes the same results again."""

import re
import shutil
from pathlib import Path

import pytest

from tests.faults.same import same

pytestmark = [pytest.mark.workflow, pytest.mark.slow]
DATASET, TEST = "results/datasets/tiny", "results/test"
# A file of the finished run -> what has to be made from it.
DAMAGED = {
    f"{DATASET}/database/injury+guarding/rows-*/statistics.npz": f"{TEST}/network/weights.npz",
    f"{DATASET}/database/injury+guarding/manifest.json": f"{TEST}/network/weights.npz",
    f"{DATASET}/batches/motion/uneven-1/motion/uneven-1.npz": f"{DATASET}/batches/labels/uneven-1",
    f"{DATASET}/batches/database/uneven-1/database/clips/uneven-1.npz": f"{DATASET}/database/injury+guarding",
    f"{DATASET}/terrain/patches.npz": f"{DATASET}/batches/terrain/uneven-1",
    f"{TEST}/network/weights.npz": f"{TEST}/runtime/scenarios.npz",
}


def remove(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()


@pytest.mark.parametrize("damaged", DAMAGED)
def test_the_advice_helps(finished, copied, damaged: str) -> None:
    target = DAMAGED[damaged]
    (path,) = copied.folder.glob(damaged)
    remove(copied.folder / target)
    if target == f"{TEST}/network/weights.npz":
        shutil.rmtree(copied.folder / TEST / "checkpoints")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] + b"x" * (len(data) - len(data) // 2))
    said = copied.run("-c2", target, ok=False)
    advice = re.search(
        r"Delete (results/\S+?); the same command makes it again|Delete the folder of the database", said
    )
    assert advice, said
    remove(copied.folder / (advice[1] or f"{DATASET}/database/injury+guarding"))
    copied.run("-c2", target)
    for made in (path.relative_to(copied.folder), target):
        assert same(copied.folder / made, finished.folder / made), made
