import os
from pathlib import Path

import psutil
import pytest

from hobble.core.processors import count_cores, multiplies_bfloat16


def test_two_threads_of_one_core_count_once(monkeypatch: pytest.MonkeyPatch) -> None:
    for usable, cores, found in ((4, 2, 2), (1, 2, 1), (4, None, 4)):
        monkeypatch.setattr(os, "sched_getaffinity", lambda _, n=usable: set(range(n)))
        monkeypatch.setattr(psutil, "cpu_count", lambda logical, n=cores: 8 if logical else n)
        assert count_cores() == found


@pytest.mark.parametrize(
    ("flags", "limit", "fast"),
    [
        ("avx2 avx512f avx512_bf16", None, True),
        ("avx2 amx_bf16", None, True),
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
