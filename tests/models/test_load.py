"""Reading networks: valid files are read, all others are refused with a message that names the file."""

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.models.load import load_network
from hobble.models.pfnn.release import PHASES
from hobble.report.character import playable_data
from hobble.rows.layout import GAITS, RowLayout
from hobble.runtime import ProceduralAnimation
from hobble.runtime.options import Runtime

Content = dict[str, Any]
GONE = object()  # instead of a value: the entry is not there


def content(skeleton: Skeleton, links: int = 30) -> Content:
    """The arrays and the meta (as a mapping) of a valid file."""
    layout = RowLayout(len(skeleton.joints), channels=(("injury", links),) if links else ())
    rng = np.random.default_rng(1)
    sizes = (layout.x_size, 6, 5, layout.y_size)
    arrays: Content = {}
    for i, (a, b) in enumerate(pairwise(sizes)):
        arrays[f"W{i}"] = rng.normal(0, a**-0.5, (4, b, a)).astype(np.float32)
        arrays[f"b{i}"] = rng.normal(0, 0.1, (4, b)).astype(np.float32)
    for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
        arrays[f"{name}mean"] = rng.normal(0, 10, size).astype(np.float32)
        arrays[f"{name}std"] = rng.uniform(1, 5, size).astype(np.float32)
    channels = {"injury": list(skeleton.link_names[:links])} if links else {}
    own = {"layout": layout.to_dict(), "channels": channels, "skeleton": skeleton.to_dict()}
    return arrays | {"meta": {"kind": "pfnn", "gaits": list(GAITS), "terrain_side": 25.0, **own}}


def with_number(at: Any, value: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        array[at] = value
        return array

    return change


def cut(axis: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda array: np.delete(array, 0, axis)


def sets(take: Callable[[np.ndarray], Any]) -> dict[str, Any]:
    """The same change of the sets of weights in all layers."""
    return {f"{letter}{layer}": take for letter in "Wb" for layer in range(3)}


BONE = "meta skeleton joints LHipJoint"
# Entry of the file -> its new value, or a function of the old one; then the message.
MALFORMED: dict[str, tuple[dict[str, Any], str]] = {
    "meta is no JSON": ({"meta": "{"}, "not valid JSON"),
    "meta is a list": ({"meta": "[1]"}, "meta: "),
    "meta nests without end": ({"meta": "[" * 100_000}, "not valid JSON"),
    "meta holds a number of 9,000 digits": ({"meta": f'{{"a": {"9" * 9000}}}'}, "not valid JSON"),
    "another kind": ({"meta kind": "diffusion"}, "meta: kind: "),
    "a kind that is a path": ({"meta kind": "../../evil"}, "meta: kind: "),
    "no W1": ({"W1": GONE}, "no W2|no W1"),
    "no Ystd": ({"Ystd": GONE}, "no Ystd"),
    "W0 of text": ({"W0": np.array([[["a"]]])}, "W0 has shape"),
    "an empty W1": ({"W1": np.zeros((4, 0, 6), np.float32)}, "b1 has shape"),
    "W1 of too few inputs": ({"W1": cut(2)}, "W1 has shape"),
    "other control points in one layer": ({"W2": cut(0)}, "W2 has shape"),
    "one control point": (sets(lambda a: a[:1]), "control points"),
    "a hundred control points": (sets(lambda a: np.repeat(a, 25, axis=0)), "control points"),
    "a last layer of too few outputs": ({"W2": cut(1), "b2": cut(1)}, r"W2 has shape .* expected .*, 311"),
    "seventeen layers": ({f"W{i}": 1 for i in range(3, 17)}, "17 layers"),
    "NaN in W0": ({"W0": with_number((0, 0, 0), np.nan)}, "not finite"),
    "1e30 in W1": ({"W1": with_number((2, 1, 1), 1e30)}, "above the limit"),
    "layers that overflow together": (
        {name: lambda a: a * np.float32(3e5) for name in ("W0", "W1", "W2", "b0")},
        "not predict a finite pose",
    ),
    "infinity in Ystd": ({"Ystd": with_number(0, np.inf)}, "not finite"),
    "Xstd below 0": ({"Xstd": with_number(9, -1.0)}, "below the limit of 0"),
    "1e30 in Ymean": ({"Ymean": with_number(4, 1e30)}, "above the limit"),
    "a window of 6e8 frames": ({"meta layout window": 600_000_000}, "layout: window"),
    "step 0": ({"meta layout step": 0}, "layout: step"),
    "a window that is no multiple of the step": ({"meta layout window": 65}, "not a multiple"),
    "links below 0": ({"meta layout channels": [["injury", -1]]}, "layout: channels.0.1"),
    "more links than columns": ({"meta layout channels": [["injury", 31]]}, "do not fit"),
    "another channel": ({"meta layout channels": [["rage", 30]]}, "unknown channel 'rage'"),
    "a layout without joints": ({"meta layout joints": GONE}, "layout: joints"),
    "a layout of another program": ({"meta layout phase": 1}, "layout: phase"),
    "infinitely many columns": ({"meta layout channels": [["injury", np.inf]]}, "layout: channels.0.1"),
    "a layout that is a list": ({"meta layout": [31, 60, 10, 30]}, "meta: layout: "),
    "3,000 gaits": ({"meta gaits": [f"gait {i}" for i in range(3000)]}, "gaits"),
    "seven gaits": ({"meta gaits": [*GAITS, "fly"]}, "gaits"),
    "one gait six times": ({"meta gaits": ["walk"] * 6}, "gaits"),
    "5 links for 30 columns": ({"meta channels": {"injury": list("abcde")}}, "but 5 labels"),
    "a link with a control character": ({"meta channels injury": ["\x1b[31m"]}, "injury"),
    "limits of 400 digits": ({"meta limits": {"injury": {"levels": [0, 10**400]}}}, "limits of injury"),
    "a side that is NaN": ({"meta terrain_side": np.nan}, "terrain_side"),
    "a side of 1e30": ({"meta terrain_side": 1e30}, "terrain_side"),
    "a skeleton that is a list": ({"meta skeleton": [1]}, "skeleton"),
    "no joints": ({"meta skeleton joints": {}}, "joints"),
    "no role for a heel": ({"meta skeleton roles left_heel": GONE}, "left_heel"),
    "a role for a joint that is not there": ({"meta skeleton roles hips": "Tail"}, "Tail"),
    "two roots": ({f"{BONE} parent": None}, "only the first joint"),
    "an offset of two numbers": ({f"{BONE} offset": [1, 2]}, "offset"),
    "an offset that is NaN": ({f"{BONE} offset": [0, np.nan, 0]}, "offset"),
    "links of three joints": ({"meta skeleton links": [["Hips", "LHipJoint", "LeftLeg"]]}, "links"),
    "an end without place": ({"meta skeleton end_sites": {"Head": None}}, "end_sites.Head"),
    "one joint fewer": (
        {"meta skeleton joints RThumb": GONE}
        | {f"meta skeleton {name}": new for name, new in (("links", []), ("end_sites", {}), ("unseen", []))},
        "31 joints, but skeleton",
    ),
}  # fmt: skip


def changed(made: Content, changes: dict[str, Any]) -> Content:
    """The content after some changes, see MALFORMED."""
    for where, new in changes.items():
        *path, last = where.split()
        at = made
        for key in path:
            at = at[key]
        if new is GONE:
            del at[last]
        else:
            at[last] = new(at[last]) if callable(new) else new
    return made


def save(path: Path, made: Content) -> None:
    meta = made["meta"] if isinstance(made["meta"], str) else json.dumps(made["meta"])
    np.savez(path, **{**made, "meta": np.array(meta)})


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_network_is_refused(name: str, tmp_path: Path, holden31: Skeleton) -> None:
    changes, message = MALFORMED[name]
    save(tmp_path / "weights.npz", changed(content(holden31), changes))
    with pytest.raises(InputError, match=message) as error:
        load_network(tmp_path)
    assert str(error.value).startswith(str(tmp_path / "weights.npz"))
    assert len(str(error.value)) < 600
    assert "\x1b" not in str(error.value)


BROKEN_BINS: dict[str, tuple[str, bytes | list[float] | None]] = {
    "no statistics": ("Xmean.bin", None),
    "no phase": ("W1_017.bin", None),
    "no first layer": ("b0_000.bin", None),
    "half a number": ("Ystd.bin", b"\0\0\0"),
    "a row too few": ("W0_003.bin", [1.0]),
    "NaN": ("b0_007.bin", [np.nan] * 6),
    "1e30": ("b0_007.bin", [1e30] * 6),
    "no spline": ("b0_007.bin", [1, 2, 3, 4, 5, 6]),
    "a longer row": ("Xmean.bin", [1.0] * 400),
    "a larger file than any": ("Xmean.bin", b"\0" * (1 << 19)),
}


@pytest.mark.parametrize("name", BROKEN_BINS)
def test_a_malformed_folder_of_bins_is_refused(name: str, tmp_path: Path, holden31: Skeleton) -> None:
    """The folder has at every phase the weights of the first control point."""
    for key, values in content(holden31, links=0).items():
        for k in range(PHASES if key[0] in "Wb" else 1):
            file = f"{key}_{k:03d}.bin" if key[0] in "Wb" else f"{key}.bin"
            if key != "meta":
                np.asarray(values[0] if key[0] in "Wb" else values, "<f4").tofile(tmp_path / file)
    assert load_network(tmp_path, holden31).sizes == (342, 6, 5, 311)
    file, written = BROKEN_BINS[name]
    (tmp_path / file).unlink()
    if written is not None:
        (tmp_path / file).write_bytes(
            written if isinstance(written, bytes) else np.array(written, "<f4").tobytes()
        )
    with pytest.raises(InputError) as error:
        load_network(tmp_path, holden31)
    assert str(tmp_path) in str(error.value)


def test_the_ground_is_sampled_as_far_to_the_side_as_in_training(tmp_path: Path, holden31: Skeleton) -> None:
    """The runtime and the page look as far to the side as the file says, or 25 cm if it does not say."""
    save(tmp_path / "weights.npz", changed(content(holden31), {"meta terrain_side": GONE}))
    network = load_network(tmp_path)
    assert (network.sizes, network.gaits, network.terrain_side) == ((372, 6, 5, 311), GAITS, 25.0)
    save(tmp_path / "weights.npz", changed(content(holden31), {"meta terrain_side": 40.0}))
    network = load_network(tmp_path)
    assert playable_data(network, Runtime())["side"] == 40.0
    places: list[np.ndarray] = []

    def ground(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        places.append(np.stack([x, z], axis=-1))
        return np.zeros_like(x)

    ProceduralAnimation(network).next_pose((0, 0.5), terrain=ground)
    points = places[0].reshape(-1, 3, 2)
    apart = np.linalg.norm(points[:, ::2] - points[:, 1:2], axis=-1)
    np.testing.assert_allclose(apart, 40.0, rtol=1e-6)
