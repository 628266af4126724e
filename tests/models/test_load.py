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
from hobble.rows.layout import GAITS, RowLayout

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
    "meta nests without end": ({"meta": "[" * 100_000}, "not valid JSON"),
    "meta holds a number of 9,000 digits": ({"meta": f'{{"a": {"9" * 9000}}}'}, "not valid JSON"),
    "a kind that is a path": ({"meta kind": "../../evil"}, "meta: kind: "),
    "no W1": ({"W1": GONE}, "no W2|no W1"),
    "one control point": (sets(lambda a: a[:1]), "control points"),
    "a last layer of too few outputs": ({"W2": cut(1), "b2": cut(1)}, r"W2 has shape .* expected .*, 311"),
    "seventeen layers": ({f"W{i}": 1 for i in range(3, 17)}, "17 layers"),
    "NaN in W0": ({"W0": with_number((0, 0, 0), np.nan)}, "not finite"),
    "1e30 in W1": ({"W1": with_number((2, 1, 1), 1e30)}, "above the limit"),
    "layers that overflow together": (
        {name: lambda a: a * np.float32(3e5) for name in ("W0", "W1", "W2", "b0")},
        "not predict a finite pose",
    ),
    "Xstd below 0": ({"Xstd": with_number(9, -1.0)}, "below the limit of 0"),
    "a window of 6e8 frames": ({"meta layout window": 600_000_000}, "layout: window"),
    "more links than columns": ({"meta layout channels": [["injury", 31]]}, "do not fit"),
    "infinitely many columns": ({"meta layout channels": [["injury", np.inf]]}, "layout: channels.0.1"),
    "5 links for 30 columns": ({"meta channels": {"injury": list("abcde")}}, "but 5 labels"),
    "a link with a control character": ({"meta channels injury": ["\x1b[31m"]}, "injury"),
    "limits of 400 digits": ({"meta limits": {"injury": {"levels": [0, 10**400]}}}, "limits of injury"),
    "a side that is NaN": ({"meta terrain_side": np.nan}, "terrain_side"),
    "no role for a heel": ({"meta skeleton roles left_heel": GONE}, "left_heel"),
    "an offset that is NaN": ({f"{BONE} offset": [0, np.nan, 0]}, "offset"),
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
    "no phase": ("W1_017.bin", None),
    "half a number": ("Ystd.bin", b"\0\0\0"),
    "a row too few": ("W0_003.bin", [1.0]),
    "no spline": ("b0_007.bin", [1, 2, 3, 4, 5, 6]),
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
