"""Reads what Snakemake needs to plan its jobs: the joint names of BVH files, and download lists.

A download list holds the checksum of each clip that can be downloaded.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.untrusted import read_text

HEADER_BYTES = 1 << 18  # enough for the joints of a BVH file; 191 joints take 40 kB
# The line of a joint in a BVH file, with its name. The `{` that should follow may be on the same line.
JOINT = re.compile(r"^\s*(?:ROOT|JOINT)\s+(.*?)\s*\{?\s*$", re.MULTILINE | re.IGNORECASE)
CHECKSUM_LINE = re.compile(r"([0-9a-fA-F]{64}) [ *](\S+)\.bvh")


def joint_names(path: Path) -> set[str]:
    """The names of a BVH file's joints, without prefixes such as `mixamorig:`; empty if it cannot be read."""
    try:
        with open(path, "rb") as file:
            header = file.read(HEADER_BYTES).partition(b"MOTION")[0].decode("latin-1")
    except OSError:
        return set()
    return {name.rpartition(":")[2].strip() for name in JOINT.findall(header)}


def nearest_rig(joints: set[str], known: Mapping[str, Collection[str]], target: str) -> str | None:
    """The name of the known skeleton that has the most of `joints`; None if no one has more than `target`.

    joints: names of a clip's joints. known: name of a skeleton -> names of its joints. target: name of the
    data set's skeleton.
    """
    most, nearest = len(joints & set(known[target])), None
    for name in sorted(known):
        if len(joints & set(known[name])) > most:
            most, nearest = len(joints & set(known[name])), name
    return nearest


def read_checksums(path: Path) -> dict[str, str]:
    """Clip -> SHA-256, from a file with lines `<hash>  <clip>.bvh`, as `sha256sum *.bvh` writes them.

    Raises InputError with the line's number if a line has another form.
    """
    checksums: dict[str, str] = {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        match = CHECKSUM_LINE.fullmatch(line.strip())
        if match is None:
            raise InputError(path, "expected a SHA-256, two spaces and the name of a .bvh file", line=number)
        checksums[match[2]] = match[1].lower()
    return checksums
