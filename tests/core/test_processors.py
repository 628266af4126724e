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


def test_bfloat16_depends_on_the_cpu_and_on_the_onednn_limit(tmp_path: Path) -> None:
    file = tmp_path / "cpuinfo"
    free = (("avx512_bf16", None, True), ("amx_bf16", None, True), ("avx2", None, False))
    limited = (("avx512_bf16", "avx512_core", False), ("avx512_bf16", "AVX512_CORE_BF16", True))
    for flags, limit, fast in free + limited:
        file.write_text(f"flags\t\t: fpu {flags}\n")
        assert multiplies_bfloat16(file, {"ONEDNN_MAX_CPU_ISA": limit} if limit else {}) is fast
