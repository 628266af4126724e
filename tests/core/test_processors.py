from pathlib import Path

import pytest

from hobble.core.processors import count_cores, multiplies_bfloat16


def topology(folder: Path, shared: dict[int, str]) -> Path:
    for processor, siblings in shared.items():
        file = folder / f"cpu{processor}" / "topology" / "core_cpus_list"
        file.parent.mkdir(parents=True)
        file.write_text(f"{siblings}\n")
    return folder


def test_two_threads_of_one_core_count_once(tmp_path: Path) -> None:
    folder = topology(tmp_path, {0: "0,4", 4: "0,4", 1: "1,5", 5: "1,5"})
    assert count_cores([0, 4], folder) == 1
    assert count_cores([0, 1], folder) == 2
    assert count_cores([0, 1, 4, 5], folder) == 2


@pytest.mark.parametrize(
    ("flags", "limit", "fast"),
    [
        ("avx2 avx512f avx512_bf16", None, True),
        ("avx2 amx_bf16", None, True),
        ("avx2 avx512f", None, False),
        ("avx2 avx512f avx512_bf16", "AVX2", False),
        ("avx2 avx512f avx512_bf16", "avx512_core", False),
        ("avx2 avx512f avx512_bf16", "AVX512_CORE_BF16", True),
    ],
)
def test_bfloat16_depends_on_the_cpu_and_on_the_onednn_limit(
    tmp_path: Path, flags: str, limit: str | None, fast: bool
) -> None:
    file = tmp_path / "cpuinfo"
    file.write_text(f"flags\t\t: fpu {flags}\n")
    environment = {} if limit is None else {"ONEDNN_MAX_CPU_ISA": limit}
    assert multiplies_bfloat16(file, environment) is fast
