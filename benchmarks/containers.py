"""Containers for the rows of a database, side by side: writing, reading in order and at random, bytes.

    pip install -e .[containers]
    python benchmarks/containers.py [--size-mb 512] [--rounds 3] [--folder DIR]

A table of standardised rows, similar to those of 31 joints, is written in blocks of 4 MB. Each block is read
once, in order and in random order, into the same memory. Before each reading, the files are reopened and
dropped from the page cache. Rates are medians over rounds in which the containers take turns. The ratio is
that of random reading to .npy files with one block each. On a busy machine, the processor seconds for a GB
(random order) are more reliable.
"""

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from own_process import cold

from hobble.core.processors import processor_name
from hobble.database.chunks import read_chunk, write_chunk

COLUMNS = 683  # X and Y of 31 joints, without the terrain
BLOCK = 1536  # rows, 4 MB
Read = Callable[[int, np.ndarray], None]


@dataclass(frozen=True)
class Container:
    """write: writes blocks into a folder. reader: folder -> a function that fills `room` with block i."""

    write: Callable[[Path, np.ndarray], None]
    reader: Callable[[Path, int], Read]


def blocks(table: np.ndarray) -> list[np.ndarray]:
    return [table[start : start + BLOCK] for start in range(0, len(table), BLOCK)]


def npy_write(folder: Path, table: np.ndarray) -> None:
    for i, block in enumerate(blocks(table)):
        np.save(folder / f"{i}.npy", block)


def npy_reader(folder: Path, count: int) -> Read:
    def read(i: int, room: np.ndarray) -> None:
        room[...] = np.load(folder / f"{i}.npy")

    return read


def npy_map_reader(folder: Path, count: int) -> Read:
    def read(i: int, room: np.ndarray) -> None:
        room[...] = np.load(folder / f"{i}.npy", mmap_mode="r")

    return read


CHUNKS: dict[Path, list[Any]] = {}
NOTHING = np.zeros((0, 37), np.float32)


def ours_write(folder: Path, table: np.ndarray) -> None:
    CHUNKS[folder] = [
        write_chunk(folder, f"{i}.safetensors", {"x": block, "fits": NOTHING})
        for i, block in enumerate(blocks(table))
    ]


def ours_reader(verify: bool) -> Callable[[Path, int], Read]:
    def reader(folder: Path, count: int) -> Read:
        def read(i: int, room: np.ndarray) -> None:
            read_chunk(folder, CHUNKS[folder][i], {"x": room, "fits": NOTHING}, verify)

        return read

    return reader


def safetensors_write(folder: Path, table: np.ndarray) -> None:
    from safetensors.numpy import save_file

    for i, block in enumerate(blocks(table)):
        save_file({"x": block}, folder / f"{i}.safetensors")


def safetensors_reader(folder: Path, count: int) -> Read:
    from safetensors.numpy import load_file

    def read(i: int, room: np.ndarray) -> None:
        room[...] = load_file(folder / f"{i}.safetensors")["x"]

    return read


def zarr_write(compressors: str | None) -> Callable[[Path, np.ndarray], None]:
    def write(folder: Path, table: np.ndarray) -> None:
        import zarr

        array = zarr.create_array(
            folder / "x.zarr",
            shape=table.shape,
            chunks=(BLOCK, COLUMNS),
            dtype="float32",
            compressors=compressors,
        )
        for i, block in enumerate(blocks(table)):
            array[i * BLOCK : i * BLOCK + len(block)] = block

    return write


def zarr_reader(folder: Path, count: int) -> Read:
    import zarr

    array = zarr.open_array(folder / "x.zarr", mode="r")

    def read(i: int, room: np.ndarray) -> None:
        room[...] = array[i * BLOCK : i * BLOCK + len(room)]

    return read


def hdf5_write(chunked: bool) -> Callable[[Path, np.ndarray], None]:
    def write(folder: Path, table: np.ndarray) -> None:
        import h5py

        with h5py.File(folder / "x.h5", "w") as file:
            layout = {"chunks": (BLOCK, COLUMNS), "fletcher32": True} if chunked else {}
            array = file.create_dataset("x", table.shape, "float32", **layout)
            for i, block in enumerate(blocks(table)):
                array[i * BLOCK : i * BLOCK + len(block)] = block

    return write


def hdf5_reader(folder: Path, count: int) -> Read:
    import h5py

    array = h5py.File(folder / "x.h5")["x"]

    def read(i: int, room: np.ndarray) -> None:
        array.read_direct(room, np.s_[i * BLOCK : i * BLOCK + len(room)])

    return read


def arrow_write(folder: Path, table: np.ndarray) -> None:
    import pyarrow as pa

    schema = pa.schema([("x", pa.list_(pa.float32(), COLUMNS))])
    with pa.ipc.new_file(str(folder / "x.arrow"), schema) as file:
        for block in blocks(table):
            rows = pa.FixedSizeListArray.from_arrays(pa.array(block.ravel()), COLUMNS)
            file.write_batch(pa.record_batch([rows], schema))


def arrow_reader(folder: Path, count: int) -> Read:
    import pyarrow as pa

    file = pa.ipc.open_file(pa.memory_map(str(folder / "x.arrow")))

    def read(i: int, room: np.ndarray) -> None:
        values = file.get_batch(i).column(0).flatten()
        room[...] = values.to_numpy(zero_copy_only=True).reshape(room.shape)

    return read


CONTAINERS = {
    ".npy files": Container(npy_write, npy_reader),
    ".npy files, memory map": Container(npy_write, npy_map_reader),
    "ours, checksums verified": Container(ours_write, ours_reader(True)),
    "ours, as on later passes": Container(ours_write, ours_reader(False)),
    "safetensors' own reader": Container(safetensors_write, safetensors_reader),
    "zarr 3, raw": Container(zarr_write(None), zarr_reader),
    "zarr 3, zstd": Container(zarr_write("auto"), zarr_reader),
    "HDF5, contiguous": Container(hdf5_write(False), hdf5_reader),
    "HDF5, chunks, checksums": Container(hdf5_write(True), hdf5_reader),
    "Arrow IPC, memory map": Container(arrow_write, arrow_reader),
}


def rows(size: int) -> np.ndarray:
    """A table of about `size` bytes whose columns are correlated like those of neighbouring joints."""
    count = size // (4 * COLUMNS) // BLOCK * BLOCK
    rng = np.random.default_rng(1)
    mix = rng.standard_normal((60, COLUMNS), np.float32) / 8
    return np.concatenate([rng.standard_normal((BLOCK, 60), np.float32) @ mix for _ in range(count // BLOCK)])


def reading(
    container: Container, order: np.ndarray, folder: Path, table: np.ndarray, room: np.ndarray
) -> tuple[float, float]:
    """MB a second and processor seconds a GB, for blocks in this order, with a cold cache. Checks the last
    block.
    """
    cold(folder)
    read = container.reader(folder, len(order))
    start, used = time.perf_counter(), time.process_time()
    for i in order:
        read(int(i), room)
    taken, used = time.perf_counter() - start, time.process_time() - used
    last = int(order[-1]) * BLOCK
    assert np.array_equal(room, table[last : last + BLOCK])
    size = len(order) * room.nbytes
    return size / taken / 1e6, used / size * 1e9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--size-mb", type=int, default=512)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--folder", type=Path)
    arguments = parser.parse_args()
    print(processor_name())
    base = Path(tempfile.mkdtemp(prefix="hobble-containers-", dir=arguments.folder))
    table = rows(arguments.size_mb << 20)
    count, room = len(table) // BLOCK, np.empty((BLOCK, COLUMNS), np.float32)
    rng = np.random.default_rng(2)
    rates: dict[str, list[tuple[float, ...]]] = {name: [] for name in CONTAINERS}
    size = {}
    try:
        for _ in range(arguments.rounds):
            for name, container in CONTAINERS.items():
                folder = base / name.replace(" ", "-")
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir()
                start = time.perf_counter()
                container.write(folder, table)
                cold(folder)  # which first waits until it is on the disk
                written = table.nbytes / (time.perf_counter() - start) / 1e6
                size[name] = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) / table.nbytes
                orders = np.arange(count), rng.permutation(count)
                read = [reading(container, order, folder, table, room) for order in orders]
                rates[name].append((written, read[0][0], *read[1]))
                shutil.rmtree(folder)
    finally:
        shutil.rmtree(base)
    medians = {name: np.median(found, axis=0) for name, found in rates.items()}
    baseline = medians[".npy files"][2]
    print(f"{table.nbytes / 1e6:.0f} MB in {count} blocks, MB/s, medians of {arguments.rounds} rounds")
    print(f"{'':<26}{'written':>9}{'in order':>10}{'at random':>11}{'ratio':>7}{'CPU s/GB':>10}{'bytes':>8}")
    for name, (written, in_order, at_random, used) in medians.items():
        print(f"{name:<26}{written:>9.0f}{in_order:>10.0f}{at_random:>11.0f}", end="")
        print(f"{at_random / baseline:>7.2f}{used:>10.2f}{size[name]:>8.1%}")


if __name__ == "__main__":
    main()
