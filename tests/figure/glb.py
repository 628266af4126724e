"""Reads glTF files."""

import json
from pathlib import Path

import numpy as np


class Glb:
    """A file: its JSON, and its numbers."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        length = int.from_bytes(data[12:16], "little")
        self.document, self._numbers = json.loads(data[20 : 20 + length]), data[28 + length :]
        self.nodes = self.document["nodes"]
        self.animations = {each["name"]: each for each in self.document["animations"]}

    def keys(self, animation: str, node: str, path: str) -> np.ndarray:
        """What an animation gives a node: (keys, 3 or 4)."""
        moved = self.animations[animation]
        target = {"node": [each["name"] for each in self.nodes].index(node), "path": path}
        sampler = next(channel["sampler"] for channel in moved["channels"] if channel["target"] == target)
        accessor = self.document["accessors"][moved["samplers"][sampler]["output"]]
        view = self.document["bufferViews"][accessor["bufferView"]]
        size = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
        values = np.frombuffer(self._numbers, "<f4", accessor["count"] * size, view["byteOffset"])
        return values.reshape(-1, size)
