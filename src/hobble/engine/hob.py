"""Writes character.hob: a network, its skeleton and the runtime's options in one file, for the runtime in C.

The file begins with a header of 64 bytes: the magic bytes, uint32 version, uint32 byte-order mark, uint64
size of the file, uint32 Adler-32 checksum of all that follows the header, uint32 number of sections. Then
comes a table with 40 bytes for each section: its name in 16 bytes, uint64 type (see `TYPES`), offset and
number of values. The sections follow, each at a multiple of 64 bytes. All numbers are little-endian.
`c/hobble.c` reads and checks the file; sections and the numbers in "sizes" and "numbers" have the same names
there.
"""

import struct
import zlib
from collections.abc import Mapping

import numpy as np

from hobble.channels import channel
from hobble.channels.shown import channel_display
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.models.network import STORAGES, Network, inverse_or_0
from hobble.rows.layout import BODY
from hobble.runtime import Runtime
from hobble.runtime.bounds import Bounds
from hobble.runtime.character import start_characters
from hobble.runtime.controller import FPS
from hobble.runtime.feet import foot_parts, sole_heights
from hobble.runtime.leg import leg_joints, rest_facing
from hobble.runtime.stairs import leg_of_columns
from hobble.runtime.variation import find_arms

MAGIC, VERSION, ORDER_MARK = b"HOBBLE\r\n", 5, 0x01020304
HEADER, ENTRY, ALIGNMENT = 64, 40, 64
TYPES = {"int32": 1, "float32": 2, "float64": 3, "int16": 4, "uint8": 5}
# Standardised inputs are multiplied by 1 / standard deviation. With a smaller factor an input has no effect,
# and the file leaves it out.
NO_EFFECT = 1e-7

Sections = dict[str, np.ndarray]


def character_bytes(network: Network, runtime: Runtime, storage: str | None = None) -> bytes:
    """The character file of a network.

    runtime: how the character runs; its mode is that of the weights in the file. storage: "float32" or
    "int16", how the weights are stored; the default depends on the kind of network. Raises HobbleError for a
    network without a skeleton.
    """
    if network.skeleton is None:
        raise HobbleError("the network has no skeleton: pass `load_network` a file of config/skeletons")
    storage = storage or network.default_storage
    inputs = np.flatnonzero(inverse_or_0(network.x_std) > NO_EFFECT)
    sizes, sections = network.engine_data(network.resolve_mode(runtime.mode), storage, inputs)
    layout = network.layout
    sizes |= {
        "joints": layout.joints, "window": layout.window, "step": layout.step,
        "columns": sum(columns for _, columns in layout.channels), "channels": len(layout.channels),
        "x_size": layout.x_size, "y_size": layout.y_size, "inputs": len(inputs),
        "hips": network.skeleton.role("hips"), "storage": STORAGES.index(storage),
    }  # fmt: skip
    bounds = Bounds.of(network)
    facts = network.training_facts
    numbers = (
        network.terrain_side, runtime.steering, runtime.foot_locking, bounds.fastest, *bounds.hips,
        0.0 if facts is None else facts.start_phase, getattr(network, "halflife", 1.0), bounds.upright,
    )  # fmt: skip
    sections |= {
        "sizes": np.array([sizes.get(name, 0) for name in SIZES], np.int32),
        "numbers": np.array(numbers, float),
        "inputs": inputs.astype(np.int32),
        "x_mean": network.x_mean[inputs],
        "x_inverse": inverse_or_0(network.x_std)[inputs].astype(np.float32),
        "x_low": bounds.x_low,
        "x_high": bounds.x_high,
        "y_low": bounds.y_low,
        "y_high": bounds.y_high,
    }
    sections |= _body_sections(network) | _channel_sections(network, runtime)
    return _packed(sections)


# The numbers of the section "sizes", in their order; those from "form" on depend on the kind of network, see
# `Network.engine_data`.
SIZES = (
    *("joints", "window", "step", "columns", "channels", "x_size", "y_size", "inputs", "hips"),
    *("form", "storage", "extra", "layers", "sets", "blended", "gate_layers", "gate_inputs"),
    *("rows", "features", "every", "latent", "stepper_layers", "projector_layers"),
)


def _packed(sections: Mapping[str, np.ndarray]) -> bytes:
    table, body = b"", b""
    start = HEADER + ENTRY * len(sections)
    for name, array in sections.items():
        body += bytes(-(start + len(body)) % ALIGNMENT)
        entry = name.encode().ljust(16, b"\0"), TYPES[array.dtype.name], start + len(body), array.size
        table += struct.pack("<16sQQQ", *entry)
        body += np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
    content = table + body
    size = HEADER + len(content)
    header = struct.pack("<8sIIQII", MAGIC, VERSION, ORDER_MARK, size, zlib.adler32(content), len(sections))
    return header.ljust(HEADER, b"\0") + content


def _body_sections(network: Network) -> Sections:
    """The skeleton, the columns of X, and the state in which a character starts."""
    skeleton, layout = network.skeleton, network.layout
    assert skeleton is not None
    legs = leg_joints(skeleton)
    state = start_characters(network, 1, np.zeros((1, 2)), np.zeros(1), {})
    starts = {
        "start_path": state.position, "start_facing": state.direction, "start_gait": state.gait,
        "start_joints": state.joint_position, "start_speeds": state.joint_velocity,
        "start_turns": state.joint_rotation,
    }  # fmt: skip
    columns = [np.arange(layout.x_size)[layout.x_channel(name)] for name, _ in layout.channels]
    return {
        "x_first": np.array([layout.blocks("x")[name].start for name in BODY], np.int32),
        "x_channels": np.concatenate([np.zeros(0, int), *columns]).astype(np.int32),
        "parents": np.array(skeleton.parents, np.int32),
        "offsets": np.asarray(skeleton.offsets, float).ravel(),
        "legs": legs.ravel().astype(np.int32),
        "arms": np.array([joint for arm in find_arms(skeleton) for joint in arm[:2]], np.int32),
        "parts": foot_parts(skeleton, legs).ravel().astype(np.uint8),
        "sole": np.asarray(sole_heights(network, legs), float),
        "ahead": rest_facing(skeleton),
        **{name: np.asarray(array[0], float).ravel() for name, array in starts.items()},
    }


def _channel_sections(network: Network, runtime: Runtime) -> Sections:
    """The channels with their names and limits, and the names of joints and gaits."""
    skeleton = network.skeleton
    assert skeleton is not None
    parts: list[str] = []
    limits: list[Array] = [np.zeros(0)]
    of_columns: list[tuple[float, ...]] = []  # of each column: the numbers that the sections below name
    levels = np.zeros(len(network.channels), np.int32)
    for number, (name, labels) in enumerate(network.channels.items()):
        parts += list(channel_display(name, skeleton, labels, network.trained_labels(name)).spoken_names)
        definition, scale = channel(name), runtime.scales.get(name, 1.0)
        rate = runtime.rates.get(name, definition.rate) / FPS
        entries = number, rate, scale, definition.highest, definition.default / scale
        of_columns += [entries] * len(labels)
        limit = network.limits.get(name) if runtime.limits else None
        if limit is not None:
            levels[number] = len(limit.levels)
            limits += [limit.levels, limit.usual, limit.speeds.ravel()]
    columns = [label for of_channel in network.channels.values() for label in of_channel]
    names = [*skeleton.joints, *network.gaits, *network.channels, *columns, *parts]
    numbers, rates, scales, highest, defaults = np.array(of_columns, float).reshape(-1, 5).T
    return {
        "channel_of": numbers.astype(np.int32),
        "rates": rates,
        "scales": scales,
        "highest": highest,
        "defaults": defaults,
        "exponents": network.channel_curves[1],
        "slows": np.array([channel(name).slows for name in network.channels], np.uint8),
        "leg": leg_of_columns(skeleton, columns),
        "limit_levels": levels,
        "limits": np.concatenate(limits).astype(float),
        "names": np.frombuffer("".join(f"{name}\0" for name in names).encode(), np.uint8),
    }
