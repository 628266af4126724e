"""Damage to the bytes of a file, as on a disk, in a copy or in a crash."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

Damage = Callable[[Random, bytes], bytes]


def cut(rng: Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data))]


def flip_bit(rng: Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def flip_bytes(rng: Random, data: bytes) -> bytes:
    out = bytearray(data)
    for _ in range(rng.randint(2, 40)):
        out[rng.randrange(len(out))] ^= rng.randint(1, 255)
    return bytes(out)


def flip_digit(rng: Random, data: bytes) -> bytes:
    """Change a digit. A text file stays readable, with another number in it."""
    digits = [i for i in range(len(data)) if data[i : i + 1].isdigit()]
    if not digits:
        return flip_bit(rng, data)
    at = rng.choice(digits)
    return data[:at] + str((data[at] - 48 + rng.randint(1, 9)) % 10).encode() + data[at + 1 :]


def zero(rng: Random, data: bytes) -> bytes:
    """Set a run of bytes to zero, like a block that was never written to the disk."""
    at = rng.randrange(len(data))
    length = min(len(data) - at, rng.choice((1, 16, 512, 4096)))
    return data[:at] + bytes(length) + data[at + length :]


def zero_all(rng: Random, data: bytes) -> bytes:
    return bytes(len(data))


def lose(rng: Random, data: bytes) -> bytes:
    """Remove a run of bytes."""
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.randint(1, 2000) :]


def repeat(rng: Random, data: bytes) -> bytes:
    """Repeat a run of bytes."""
    at = rng.randrange(len(data))
    length = rng.randint(1, 2000)
    return data[: at + length] + data[at:]


def swap(rng: Random, data: bytes) -> bytes:
    """Swap two neighbouring runs of bytes."""
    length = min(rng.choice((1, 64, 512)), len(data) // 2)
    at = rng.randrange(len(data) - 2 * length + 1)
    a, b = data[at : at + length], data[at + length : at + 2 * length]
    return data[:at] + b + a + data[at + 2 * length :]


def append(rng: Random, data: bytes) -> bytes:
    return data + rng.randbytes(rng.randint(1, 5000))


def noise(rng: Random, data: bytes) -> bytes:
    return rng.randbytes(len(data))


def empty(rng: Random, data: bytes) -> bytes:
    return b""


DAMAGES: dict[str, Damage] = {
    f.__name__: f
    for f in (cut, flip_bit, flip_bytes, flip_digit, zero, zero_all, lose, repeat, swap, append, noise, empty)
}


# As the table counts them.
GROUPS = {
    "cut or emptied": ("cut", "empty"),
    "flipped": ("flip_bit", "flip_bytes", "flip_digit"),
    "zeroed": ("zero", "zero_all"),
    "moved, lost or added": ("lose", "repeat", "swap", "append"),
    "replaced by noise": ("noise",),
}


def group_of(name: str) -> str:
    """The group under which damage of this name is counted."""
    return next(group for group, names in GROUPS.items() if name in names)


def damaged(rng: Random, name: str, data: bytes) -> bytes:
    """The bytes after damage of this name. They always differ from the bytes before."""
    for _ in range(50):
        if (out := DAMAGES[name](rng, data)) != data:
            return out
    return flip_bit(rng, data)
