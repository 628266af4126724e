"""The runtime in C moves characters as the one in Python does, and refuses what it cannot use."""

import os
import re
import runpy
import shutil
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.engine import EXAMPLES, SOURCES, compile_c
from hobble.engine.export import export_engine
from hobble.engine.hob import character_bytes
from hobble.engine.traces import SITUATIONS, trace
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.generated import restore_bone_lengths
from tests.engine.networks import network_of

WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
RUNTIME_C = SOURCES / "hobble.c"
KINDS = ("pfnn", "plain", "mann", "local", "matching", "learned")


@pytest.fixture(scope="module")
def built_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The runtime as a shared library, and the program that checks traces, compiled by clang (as zig)."""
    folder = tmp_path_factory.mktemp("engine")
    compile_c([RUNTIME_C], folder / "libhobble.so", [*WARNINGS, "-O2", "-shared", "-fPIC"])
    compile_c([RUNTIME_C, EXAMPLES / "check_traces.c"], folder / "check_traces", [*WARNINGS, "-O2"])
    return folder


@pytest.fixture(scope="module")
def binding() -> SimpleNamespace:
    """The example in Python."""
    return SimpleNamespace(**runpy.run_path(str(EXAMPLES / "hobble_ctypes.py")))


@pytest.fixture(scope="module")
def start(
    built_folder: Path, binding: SimpleNamespace, holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory
) -> Callable[..., Any]:
    """start(count): characters of a network of kind pfnn."""
    file = character_bytes(network_of("pfnn", holden31, tmp_path_factory.mktemp("pfnn")), Runtime())
    return lambda count=1: binding.Characters(built_folder / "libhobble.so", file, count)


@pytest.mark.parametrize(
    ("kind", "mode", "storage", "options"),
    [
        ("pfnn", "cubic", "float32", {}),
        ("pfnn", "linear", "int16", {"steering": 0.0}),
        ("pfnn", "constant", "float32", {"foot_locking": False, "limits": False}),
        ("plain", "cubic", "float32", {"scales": {"injury": 2.0}, "rates": {"mood": 0.3}}),
        ("mann", "cubic", "int16", {}),
        *((kind, "cubic", "float32", {}) for kind in ("local", "matching", "learned")),
        *((kind, "cubic", "int16", {"steering": 0.0}) for kind in ("matching", "learned")),
    ],
)
def test_c_moves_a_character_as_python_does(kind, mode, storage, options, built_folder, holden31, tmp_path):
    """Within 1e-3 cm after 60 frames, and .5 cm after 3,600: `check_traces` knows the limits.

    In the mode constant, the made-up weights jump from one phase to the next. A frame that falls on the other
    side of a jump, by rounding, makes another walk.
    """
    network, runtime = network_of(kind, holden31, tmp_path), Runtime(mode=mode, **options)
    (tmp_path / "character.hob").write_bytes(character_bytes(network, runtime, storage))
    for name, situation in SITUATIONS.items():
        frames = {"hills": 3600, "stairs": 900, "varied": 300}.get(name, 60) if mode != "constant" else 60
        (tmp_path / f"{name}.trace").write_bytes(trace(network, runtime, situation, frames, storage))
    command = [built_folder / "check_traces", tmp_path / "character.hob", *tmp_path.glob("*.trace")]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    assert len(found.stdout.splitlines()) == len(SITUATIONS)


def test_a_crowd_moves_as_single_characters_do_and_a_copy_as_its_original(
    start: Callable[..., Any], binding: SimpleNamespace
) -> None:
    crowd, alone = start(10), [start() for _ in range(9)]
    all_of_them = [(crowd, i, i) for i in range(9)] + [(each, 0, i) for i, each in enumerate(alone)]
    for frame in range(90):
        for characters, k, i in all_of_them:
            characters.aim(k, (2.5 * np.sin(i), 2.5 * np.cos(i)), gait="walk" if i % 2 else None)
            if frame == 30:
                characters.set(k, "injury", "left thigh", i)
        crowd.aim(9, (2.5 * np.sin(8), 2.5 * np.cos(8)))
        if frame == 30:
            shift = map(binding.ctypes.c_double, (100.0, -40.0))
            assert crowd.library.hobble_copy(crowd.handle, 9, crowd.handle, 8, *shift) == 0
        for each in (crowd, *alone):
            each.frame()
    places = np.array([crowd.array("positions", i, 93) for i in range(10)]).reshape(10, -1, 3)
    single = np.reshape([each.array("positions", 0, 93) for each in alone], (9, -1, 3))
    np.testing.assert_allclose(places[:9], single, atol=1e-3)
    np.testing.assert_allclose(places[9] - places[8], np.tile([100, 0, -40], (31, 1)), atol=1e-3)


def test_names_values_and_errors(start: Callable[..., Any]) -> None:
    characters = start()
    by_label = characters.library.hobble_column(characters.handle, None, b"LeftUpLeg-LeftLeg")
    assert characters.library.hobble_column(characters.handle, b"injury", b"left thigh") == by_label >= 0
    assert characters.library.hobble_column(characters.handle, b"mood", b"left thigh") == -1
    for channel, name, value in (("injury", "left ear", 1), ("injury", "left thigh", 10.1)):
        with pytest.raises(ValueError, match=r"there is no such|not a number"):
            characters.set(0, channel, name, value)
    characters.aim(0, (np.nan, 0))
    with pytest.raises(ValueError, match="the target is not finite"):
        characters.frame()
    with pytest.raises(ValueError, match="no such"):
        characters.aim(0, (0, 0), gait="moonwalk")


def test_a_ground_that_fails_leaves_the_characters_as_they_were(
    start: Callable[..., Any], binding: SimpleNamespace
) -> None:
    characters, other = start(2), start(2)
    for each in (characters, other):
        for i in range(2):
            each.aim(i, (0, 2.5))
    for frame in range(40):
        for height in (np.nan, 1e8) if frame % 10 == 5 else ():
            with pytest.raises(ValueError, match="the ground"):
                characters.frame(binding.ground_from(lambda x, z, height=height: height if x < 20 else 0))
        slope = binding.ground_from(lambda x, z: 0.1 * z)
        characters.frame(slope)
        other.frame(slope)
    for name, size in (("positions", 93), ("rotations", 124), ("state", 6)):
        assert list(characters.array(name, 1, size)) == list(other.array(name, 1, size))


def test_damaged_files_are_refused_with_a_reason(
    built_folder: Path, binding: SimpleNamespace, holden31: Skeleton, tmp_path: Path
) -> None:
    whole = character_bytes(network_of("pfnn", holden31, tmp_path), Runtime())

    def reason(file: bytes) -> str:
        with pytest.raises(ValueError, match="the character file") as caught:
            binding.Characters(built_folder / "libhobble.so", file)
        return str(caught.value)

    assert "shorter" in reason(whole[:63])
    assert "does not begin" in reason(b"HOBBLE\n\n" + whole[8:])
    assert "another version" in reason(whole[:8] + bytes([whole[8] + 1]) + whole[9:])
    assert "another size" in reason(whole[:-1])
    assert "damaged" in reason(whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:])
    changed = bytearray(whole)
    at = whole.index(b"parents\0")
    place = int.from_bytes(whole[at + 24 : at + 32], "little")
    changed[place + 8 : place + 12] = (40).to_bytes(4, "little")
    changed[24:28] = zlib.adler32(changed[64:]).to_bytes(4, "little")
    assert "parents" in reason(bytes(changed))


@pytest.mark.parametrize(
    ("compiler", "count"),
    [("gcc", 160), *(pytest.param(name, 3000, marks=pytest.mark.slow) for name in ("gcc", "clang"))],
)
def test_mutated_files_are_refused_or_make_finite_poses(
    compiler: str, count: int, holden31: Skeleton, tmp_path: Path
) -> None:
    """Under AddressSanitizer and UBSan."""
    if not shutil.which(compiler):
        pytest.skip(f"no {compiler}: zig's clang has no AddressSanitizer")
    options = ["-g", "-O1", *WARNINGS, f"-I{SOURCES}", "-fsanitize=address,undefined"]
    sources = [RUNTIME_C, Path(__file__).with_name("mutate.c"), "-o", tmp_path / "mutate", "-lm"]
    subprocess.run([compiler, *options, "-fno-sanitize-recover=all", *sources], check=True)
    for kind in KINDS:
        file = tmp_path / f"{kind}.hob"
        file.write_bytes(character_bytes(network_of(kind, holden31, tmp_path), Runtime()))
        command = [tmp_path / "mutate", file, str(count // 4), "11"]
        found = subprocess.run(command, capture_output=True, text=True, check=False)
        assert found.returncode == 0, found.stdout + found.stderr
        refused = int(re.findall(r"(\d+) of", found.stdout)[0])
        assert 0.3 * count / 4 < refused < 0.95 * count / 4


@pytest.mark.slow
@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "aarch64-macos", "aarch64-linux-gnu"])
def test_the_runtime_compiles_for_other_machines(target: str, tmp_path: Path) -> None:
    for source in (RUNTIME_C, SOURCES / "hobble_gait.c"):
        compile_c([source], tmp_path / "runtime.o", [*WARNINGS, "-O3", "-target", target, "-c"])
    compile_c(
        [RUNTIME_C, EXAMPLES / "example.c"], tmp_path / "example", [*WARNINGS, "-O3", "-target", target]
    )


@pytest.mark.skipif(not shutil.which("mcs"), reason="no C# compiler")
def test_c_sharp_moves_a_character_as_python_does(
    built_folder: Path, holden31: Skeleton, tmp_path: Path
) -> None:
    """The example in C#, under Mono: a walk on a slope, and the pose with bones of constant length."""
    network = network_of("pfnn", holden31, tmp_path)
    (tmp_path / "character.hob").write_bytes(character_bytes(network, Runtime()))
    sources = [EXAMPLES / name for name in ("Hobble.cs", "Walk.cs")]
    subprocess.run(["mcs", *sources, f"-out:{tmp_path / 'walk.exe'}"], check=True)
    said = subprocess.run(
        ["mono", tmp_path / "walk.exe", tmp_path / "character.hob"],
        env={**os.environ, "LD_LIBRARY_PATH": str(built_folder)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    animation = ProceduralAnimation(network)
    for _ in range(120):
        pose = animation.next_pose((0, 2.5), terrain=lambda x, z: 0.05 * z)
    _, places = restore_bone_lengths(holden31, pose.positions[None], pose.rotations[None])
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", said.stdout.splitlines()[-1])]
    np.testing.assert_allclose(numbers, places[0, -1], atol=2e-3)


def test_the_exported_folder_is_complete(
    holden31: Skeleton, tmp_path: Path, built_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its examples compile in it, and its traces agree with its character."""
    monkeypatch.setattr("hobble.engine.traces.FRAMES", 40)
    (tmp_path / "runtime.wasm").write_bytes(b"\0asm")
    network = network_of("matching", holden31, tmp_path)
    export_engine(tmp_path / "engine", network, Runtime(), tmp_path / "runtime.wasm")
    folder = tmp_path / "engine"
    traces = sorted((folder / "traces").iterdir())
    assert len(traces) == 10
    command = [built_folder / "check_traces", folder / "character.hob", *traces]
    assert subprocess.run(command, check=False).returncode == 0
    compile_c([folder / "hobble.c", folder / "examples/example.c"], folder / "example", WARNINGS)
    said = subprocess.run(
        [folder / "example", folder / "character.hob"], capture_output=True, text=True, check=True
    )
    assert len(said.stdout.splitlines()) == 5
