"""Damage to the bytes of a file, as on a disk, in a copy or in a crash."""

from __future__ import annotations

from random import Random


def _somewhere(rng: Random, data: bytes) -> tuple[int, int]:
    """First and last byte of a run."""
    at = rng.randrange(len(data))
    return at, at + rng.choice((1, 16, 512, 4096))


def _flip(rng: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 40))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _digit(rng: Random, data: bytes) -> bytes:
    """A text file stays readable, with another number in it."""
    digits = [i for i in range(len(data)) if data[i : i + 1].isdigit()]
    at = rng.choice(digits) if digits else 0
    return data[:at] + str(rng.randrange(10)).encode() + data[at + 1 :]


def _zero(rng: Random, data: bytes) -> bytes:
    """Set a run of bytes to zero, like a block that was never written to the disk."""
    a, b = _somewhere(rng, data)
    return data[:a] + bytes(len(data[a:b])) + data[b:]


def _lose(rng: Random, data: bytes) -> bytes:
    a, b = _somewhere(rng, data)
    return data[:a] + data[b:]


def _repeat(rng: Random, data: bytes) -> bytes:
    a, b = _somewhere(rng, data)
    return data[:b] + data[a:]


DAMAGES = {
    "cut": lambda rng, data: data[: rng.randrange(len(data))],
    "flipped": _flip,
    "another digit": _digit,
    "zeroed": _zero,
    "all zero": lambda rng, data: bytes(len(data)),
    "lost": _lose,
    "repeated": _repeat,
    "added": lambda rng, data: data + rng.randbytes(rng.randint(1, 5000)),
    "noise": lambda rng, data: rng.randbytes(len(data)),
}


def damaged(rng: Random, name: str, data: bytes) -> bytes:
    """The bytes after damage of this name. They always differ from the bytes before."""
    for _ in range(50):
        if (out := DAMAGES[name](rng, data)) != data:
            return out
    return data[:-1]
