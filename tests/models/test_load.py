"""Reading networks: valid files are read, all others are refused with a message that names the file."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.pfnn.release import PHASES
from hobble.report.character import playable_data
from hobble.rows.layout import GAITS
from hobble.runtime import ProceduralAnimation
from hobble.runtime.options import Runtime
from tests.models.network_content import (
    Change,
    Content,
    array,
    content,
    cut,
    each,
    joint,
    layout,
    meta,
    no,
    no_role,
    put,
    skeleton,
    text,
)

MALFORMED: dict[str, tuple[Change, str]] = {
    "meta is no JSON": (text("{"), "not valid JSON"),
    "meta is a list": (text("[1]"), "meta: "),
    "meta nests without end": (text("[" * 100_000), "not valid JSON"),
    "meta holds a number of 9,000 digits": (text(f'{{"a": {"9" * 9000}}}'), "not valid JSON"),
    "another kind": (meta(kind="diffusion"), "meta: kind: "),
    "a kind that is a path": (meta(kind="../../evil"), "meta: kind: "),
    "no W1": (no("W1"), "no W2|no W1"),
    "no Ystd": (no("Ystd"), "no Ystd"),
    "W0 of text": (array(W0=np.array([[["a"]]])), "W0 has shape"),
    "an empty W1": (array(W1=np.zeros((4, 0, 6), np.float32)), "b1 has shape"),
    "W1 of too few inputs": (cut("W1", 2), "W1 has shape"),
    "other control points in one layer": (cut("W2", 0), "W2 has shape"),
    "one control point": (
        lambda c: c.update({k: v[:1] for k, v in c.items() if k[0] in "Wb"}),
        "control points",
    ),
    "a hundred control points": (
        lambda c: c.update({k: np.repeat(v, 25, axis=0) for k, v in c.items() if k[0] in "Wb"}),
        "control points",
    ),
    "a last layer of too few outputs": (
        lambda c: [cut("W2", 1)(c), cut("b2", 1)(c)],
        r"W2 has shape .* expected \(control points, 311|expected \(4, 311",
    ),
    "seventeen layers": (
        lambda c: c.update({f"W{i}": c["W1"] for i in range(3, 17)}),
        "17 layers",
    ),
    "NaN in W0": (put("W0", (0, 0, 0), np.nan), "not finite"),
    "1e30 in W1": (put("W1", (2, 1, 1), 1e30), "above the limit"),
    "layers that overflow together": (each("W0", "W1", "W2", "b0", factor=3e5), "not predict a finite pose"),
    "infinity in Ystd": (put("Ystd", 0, np.inf), "not finite"),
    "Xstd below 0": (put("Xstd", 9, -1.0), "below the limit of 0"),
    "1e30 in Ymean": (put("Ymean", 4, 1e30), "above the limit"),
    "a window of 6e8 frames": (layout(window=600_000_000), "layout: window"),
    "step 0": (layout(step=0), "layout: step"),
    "a window that is no multiple of the step": (layout(window=65), "not a multiple"),
    "links below 0": (layout(channels=[["injury", -1]]), "layout: channels.0.1"),
    "more links than columns": (layout(channels=[["injury", 31]]), "do not fit"),
    "a layout without joints": (lambda c: c["meta"]["layout"].pop("joints"), "layout: joints"),
    "a layout of another program": (layout(phase=1), "layout: phase"),
    "infinitely many columns": (layout(channels=[["injury", float("inf")]]), "layout: channels.0.1"),
    "a layout that is a list": (meta(layout=[31, 60, 10, 30]), "meta: layout: "),
    "3,000 gaits": (meta(gaits=[f"gait {i}" for i in range(3000)]), "gaits"),
    "seven gaits": (meta(gaits=[*GAITS, "fly"]), "gaits"),
    "one gait six times": (meta(gaits=["walk"] * 6), "gaits"),
    "5 links for 30 columns": (meta(channels={"injury": list("abcde")}), "but 5 labels"),
    "a link with a control character": (
        meta(channels={"injury": ["a\x1b[31m", *"bcdefghijklmnopqrstuvwxyzABCD"]}),
        "channels.injury",
    ),
    "limits of 400 digits": (
        meta(limits={"injury": {"levels": [0, 10**400], "speeds": [1, 10**400]}}),
        "limits of injury",
    ),
    "a side that is NaN": (meta(terrain_side=float("nan")), "terrain_side"),
    "a side of 1e30": (meta(terrain_side=1e30), "terrain_side"),
    "a skeleton that is a list": (meta(skeleton=[1]), "skeleton"),
    "no joints": (skeleton(joints={}), "joints"),
    "no role for a heel": (no_role("left_heel"), "left_heel"),
    "a role for a joint that is not there": (
        lambda c: c["meta"]["skeleton"]["roles"].update(hips="Tail"),
        "Tail",
    ),
    "a parent that comes later": (joint("LHipJoint", parent="LeftLeg"), "must be listed before"),
    "two roots": (joint("LHipJoint", parent=None), "only the first joint"),
    "an offset of two numbers": (joint("LHipJoint", offset=[1, 2]), "offset"),
    "an offset that is NaN": (joint("LHipJoint", offset=[0, float("nan"), 0]), "offset"),
    "links of three joints": (skeleton(links=[["Hips", "LHipJoint", "LeftLeg"]]), "links"),
    "an end without place": (skeleton(end_sites={"Head": None}), "end_sites.Head"),
    "one joint fewer": (
        lambda c: [
            c["meta"]["skeleton"]["joints"].pop("RThumb"),
            c["meta"]["skeleton"].update(links=[], end_sites={}, unseen=[]),
        ],
        "31 joints, but skeleton",
    ),
}


def save(path: Path, made: Content) -> None:
    meta = made["meta"]
    np.savez(path, **{**made, "meta": meta if isinstance(meta, np.ndarray) else np.array(json.dumps(meta))})


def test_a_valid_network_file_is_read(tmp_path: Path, holden31: Skeleton) -> None:
    save(tmp_path / "weights.npz", content(holden31))
    network = load_network(tmp_path)
    assert (network.sizes, network.gaits, network.terrain_side) == ((372, 6, 5, 311), GAITS, 25.0)


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_network_is_refused(name: str, tmp_path: Path, holden31: Skeleton) -> None:
    change, message = MALFORMED[name]
    made = content(holden31)
    change(made)
    save(tmp_path / "weights.npz", made)
    with pytest.raises(InputError, match=message) as error:
        load_network(tmp_path)
    assert str(error.value).startswith(str(tmp_path / "weights.npz"))
    assert len(str(error.value)) < 600
    assert "\x1b" not in str(error.value)


def released(folder: Path, made: Content) -> None:
    """The same network as a folder of .bin files: at every phase the weights of the first control point."""
    for name, values in made.items():
        if name[0] in "Wb":
            for k in range(PHASES):
                (folder / f"{name}_{k:03d}.bin").write_bytes(values[0].astype("<f4").tobytes())
        elif name != "meta":
            (folder / f"{name}.bin").write_bytes(values.astype("<f4").tobytes())


def numbers(*values: float) -> bytes:
    return np.array(values, "<f4").tobytes()


BROKEN_BINS = {
    "no statistics": ("Xmean.bin", None),
    "no phase": ("W1_017.bin", None),
    "no first layer": ("b0_000.bin", None),
    "half a number": ("Ystd.bin", b"\0\0\0"),
    "a row too few": ("W0_003.bin", numbers(1.0)),
    "NaN": ("b0_007.bin", numbers(*[np.nan] * 6)),
    "1e30": ("b0_007.bin", numbers(*[1e30] * 6)),
    "no spline": ("b0_007.bin", numbers(1, 2, 3, 4, 5, 6)),
    "a longer row": ("Xmean.bin", numbers(*[1.0] * 400)),
    "a larger file than any": ("Xmean.bin", b"\0" * (1 << 19)),
}


@pytest.mark.parametrize("name", BROKEN_BINS)
def test_a_malformed_folder_of_bins_is_refused(name: str, tmp_path: Path, holden31: Skeleton) -> None:
    released(tmp_path, content(holden31, links=0))
    assert load_network(tmp_path, holden31).sizes == (342, 6, 5, 311)
    file, written = BROKEN_BINS[name]
    if written is None:
        (tmp_path / file).unlink()
    else:
        (tmp_path / file).write_bytes(written)
    with pytest.raises(InputError) as error:
        load_network(tmp_path, holden31)
    assert str(tmp_path) in str(error.value)


@pytest.mark.parametrize("name", ["weights.npz", "Xmean.bin"])
def test_what_is_not_a_regular_file_is_refused(name: str, tmp_path: Path, holden31: Skeleton) -> None:
    released(tmp_path, content(holden31, links=0))
    (tmp_path / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=f"{name}: a device or a pipe"):
        load_network(tmp_path, holden31)
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(InputError, match=f"{name}: a device or a pipe"):
        load_network(tmp_path, holden31)


def test_the_ground_is_sampled_as_far_to_the_side_as_in_training(tmp_path: Path, holden31: Skeleton) -> None:
    """The runtime and the page look as far to the side as the file says, or 25 cm if it does not say."""
    made = content(holden31)
    del made["meta"]["terrain_side"]
    save(tmp_path / "weights.npz", made)
    assert load_network(tmp_path).terrain_side == 25.0
    made["meta"]["terrain_side"] = 40.0
    save(tmp_path / "weights.npz", made)
    network = load_network(tmp_path)
    assert playable_data(network, Runtime())["side"] == 40.0
    places: list[np.ndarray] = []

    def ground(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        places.append(np.stack([x, z], axis=-1))
        return np.zeros_like(x)

    ProceduralAnimation(network).next_pose((0, 0.5), terrain=ground)
    left, path, right = places[0].reshape(-1, 3, 2).transpose(1, 0, 2)
    for side in (left, right):
        np.testing.assert_allclose(np.linalg.norm(side - path, axis=-1), 40.0, rtol=1e-6)
