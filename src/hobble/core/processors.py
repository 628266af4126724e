"""This machine's processor: its name, its number of cores, and whether it multiplies bfloat16 in hardware."""

import os
import platform
import re
from collections.abc import Mapping
from pathlib import Path

CPUINFO = Path("/proc/cpuinfo")  # where Linux lists the processors with their names and features
# oneDNN is the library that multiplies matrices for PyTorch. With one of these values of the environment
# variable ONEDNN_MAX_CPU_ISA, it uses no instructions for bfloat16.
WITHOUT_BFLOAT16 = ("SSE41", "AVX", "AVX2", "AVX2_VNNI", "AVX512_CORE", "AVX512_CORE_VNNI")


def count_cores() -> int:
    """Number of physical cores, at least 1 and at most the number of processors that this process may use.

    Two processors (hardware threads) of a core count once, because matrix products gain nothing from a second
    thread: on one core, two threads took 1.06 to 1.2 times as long as one.
    """
    import psutil  # of the extra `workflow`, as PyTorch is, for which cores are counted

    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(usable, psutil.cpu_count(logical=False) or usable)


def multiplies_bfloat16(cpuinfo: Path = CPUINFO, environment: Mapping[str, str] = os.environ) -> bool:
    """Whether this CPU multiplies bfloat16 in hardware (AVX-512 BF16 or AMX).

    If it does, a matrix product in bfloat16 takes half as long as in float32. The result is also False if
    ONEDNN_MAX_CPU_ISA forbids these instructions. oneDNN would then emulate them, and a product would take
    many times as long as in float32.
    """
    if environment.get("ONEDNN_MAX_CPU_ISA", "").upper() in WITHOUT_BFLOAT16:
        return False
    return "avx512_bf16" in _read(cpuinfo) or "amx_bf16" in _read(cpuinfo)


def processor_name(cpuinfo: Path = CPUINFO) -> str:
    """The name of this machine's processor model, or "unknown"."""
    found = re.search(r"^model name\s*:(.*)", _read(cpuinfo), re.MULTILINE)
    return found[1].strip() if found else platform.processor() or "unknown"


def _read(cpuinfo: Path) -> str:
    return cpuinfo.read_text(encoding="utf-8", errors="replace") if cpuinfo.is_file() else ""
