"""Files from strangers run no code: nothing is unpickled, and the source has no call that could run it."""

from __future__ import annotations

import ast
import os
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.channels.injury.status import read_status
from hobble.core.clip import load_clip
from hobble.core.errors import InputError
from hobble.core.files import load_npz, read_json
from hobble.core.untrusted import read_yaml
from hobble.labels.label_files import SourceTime, read_gait_keys
from hobble.models.load import load_network
from hobble.motion import read as bvh
from hobble.motion.skeleton_file import load_skeleton
from hobble.terrain.heightmaps import read_heights

from .conftest import SKELETON, write


class Payload:
    """An object that writes a file when it is unpickled."""

    def __reduce__(self) -> Any:
        return os.mkdir, ("pwned",)


def test_nothing_is_unpickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    objects = np.array([Payload(), 1], dtype=object)
    np.savez(tmp_path / "a.npz", heights=objects, rotations=objects, W0=objects)
    np.save(tmp_path / "a.npy", objects)
    for name in ("bare.npz", "bare.npy", "bare.json", "bare.yaml", "bare.bvh", "bare.txt"):
        write(tmp_path / name, pickle.dumps(Payload()))
    skeleton = load_skeleton(SKELETON).skeleton
    readers: dict[str, list[Callable[[Path], Any]]] = {
        ".npz": [load_npz, load_clip, load_network, read_heights],
        ".npy": [read_heights],
        ".json": [read_json],
        ".yaml": [read_yaml, load_skeleton],
        ".bvh": [bvh.read_bvh],
        ".txt": [
            read_heights,
            lambda path: read_status(path, skeleton.link_names),
            lambda path: read_gait_keys(path, SourceTime(9, 60.0), 9),
        ],
    }
    for path in sorted(tmp_path.glob("*.*")):
        for read in readers[path.suffix]:
            with pytest.raises(InputError, match=re.escape(path.name)):
                read(path)
    assert not (tmp_path / "pwned").exists()


FORBIDDEN = {"eval", "exec", "compile", "__import__", "execfile"}
MODULES = {"pickle", "cPickle", "dill", "joblib", "marshal", "shelve", "cloudpickle"}
CALLS = {"os.system", "os.popen", "yaml.load", "yaml.unsafe_load", "yaml.full_load", "torch.load"}


@pytest.mark.parametrize("folder", ["src", "workflow"])
def test_the_source_has_no_way_to_run_what_it_reads(root: Path, folder: str) -> None:
    found = []
    for path in sorted((root / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = {alias.name for alias in node.names} | {getattr(node, "module", None)}
                found += [(path.name, name) for name in names & MODULES]
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func)
            keywords = {k.arg: ast.unparse(k.value) for k in node.keywords}
            if name in FORBIDDEN | CALLS or keywords.get("shell") == "True":
                found.append((path.name, name))
            if keywords.get("allow_pickle", "False") != "False":
                found.append((path.name, "allow_pickle"))
            if name in ("np.load", "numpy.load") and "allow_pickle" not in keywords:
                found.append((path.name, name))
    assert found == []
    # Rules run scripts and nothing else: no name ever reaches a shell.
    rules = [path.read_text() for path in sorted((root / folder).rglob("*.smk"))]
    assert not [text for text in rules if re.search(r"^\s*(shell|run)\s*:", text, re.M)]
