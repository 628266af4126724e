"""Reads heightmaps from files, or generates them."""

import io
import itertools
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import load_npy, load_npz, printable, read_text
from hobble.core.quat import Array
from hobble.terrain import HeightmapOptions

MAX_CELLS = 1 << 26  # largest number of cells of a map: 8192 x 8192, 512 MB, 322 x 322 m with cells of 3.9 cm
MAX_TEXT_BYTES = 1 << 28  # size of the largest text file that is read
MAX_HEIGHT = 1e7  # largest height, cm (100 km); the runtime has the same limit

# The words with which lines of the header of an ESRI grid begin.
ESRI_HEADER = {
    *["ncols", "nrows", "xllcorner", "xllcenter", "yllcorner", "yllcenter", "cellsize", "nodata_value"]
}
IMAGE_FORMATS = {".png": ("PNG",), ".tif": ("TIFF",), ".tiff": ("TIFF",)}  # suffix -> Pillow's formats
GDAL_NODATA = 42113  # the TIFF tag with the value that means "no data", as text


@dataclass(frozen=True)
class TerrainMap:
    """A heightmap. heights: (rows, columns) cm, nan in holes. cell: width of a cell, cm."""

    name: str
    heights: Array = field(repr=False)
    cell: float


def heightmaps(
    entries: Sequence[HeightmapOptions], files: Sequence[str | Path], *, cell: float
) -> list[TerrainMap]:
    """The heightmaps that a data set lists.

    files: a path for each entry of kind `file`, in the order of the entries. cell: width of a cell, cm; the
    `cell` of an entry, if it has one, takes precedence. Raises InputError for a file that cannot be used.
    """
    paths, out = iter(files), []
    for entry in entries:
        width = entry.cell or cell
        if entry.kind != "file":
            heights = generate_heights(entry.kind, entry.seed, width)
            out.append(TerrainMap(f"{entry.kind} (seed {entry.seed})", heights, width))
            continue
        path = next(paths)
        heights = read_heights(path) * entry.height_scale
        if (highest := float(np.nanmax(np.abs(heights)))) > MAX_HEIGHT:
            problem = f"a height of {highest:.4g} cm, but at most {MAX_HEIGHT:g} cm are allowed"
            fix = 'Set height_scale of this map, or give the file its "no data" value.'
            raise InputError(path, problem, fix=fix)
        out.append(TerrainMap(str(path), heights, width))
    return out


def read_heights(path: str | Path) -> Array:
    """Heights (rows, columns) from a file, in the file's unit; nan in holes.

    .txt .csv .dat .asc: rows of numbers separated by spaces, commas or semicolons, with or without the header
    of an ESRI grid. .npy: one 2D array. .npz: its only 2D array, or the one called `heights`.
    .png .tif .tiff: grey values of up to 32 bits. The "no data" value of a GeoTIFF or ESRI grid marks a hole.
    Raises InputError if the file cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such heightmap", fix="See terrain.heightmaps of the data set.")
    readers = {".npz": _read_npz, ".npy": load_npy, **dict.fromkeys(IMAGE_FORMATS, _read_image)}
    heights = np.asarray(readers.get(path.suffix.lower(), _read_text_grid)(path))
    if heights.ndim != 2 or min(heights.shape) < 2:
        needed = "a heightmap needs rows and columns, at least two of each"
        raise InputError(path, f"{needed}, but this has shape {heights.shape}")
    if heights.dtype.kind not in "fiub":
        raise InputError(path, f"heights must be numbers, not {heights.dtype}")
    if heights.size > MAX_CELLS:
        raise InputError(path, f"{heights.size} heights, more than {MAX_CELLS}, the largest number allowed")
    heights = heights.astype(float)
    if not np.isfinite(heights).any():
        raise InputError(path, "the file holds no finite height")
    return np.where(np.isfinite(heights), heights, np.nan)


def _read_text_grid(path: Path) -> Array:
    """Heights (rows, columns) of a text file, with or without the header of an ESRI grid; nan in holes."""
    text = read_text(path, MAX_TEXT_BYTES).replace(",", " ").replace(";", " ")
    lines, header = io.StringIO(text, newline=None), {}
    for line in lines:
        word, *rest = line.split("#")[0].lower().split() or [""]
        if word not in {*ESRI_HEADER, ""}:
            break
        header[word] = " ".join(rest)
    else:
        raise InputError(path, "the file holds no heights")
    try:
        heights = np.loadtxt(itertools.chain([line], lines), ndmin=2)
        return np.where(heights == float(header.get("nodata_value", "nan")), np.nan, heights)
    except ValueError as error:
        raise InputError(path, f"not rows of numbers: {printable(error)}") from error


def _read_npz(path: Path) -> Array:
    """The only 2D array of an npz file, or the one called `heights`."""
    arrays = {name: array for name, array in load_npz(path).items() if array.ndim == 2}
    if len(arrays) != 1 and "heights" not in arrays:
        problem = (
            f"which array holds the heights? The 2D arrays are: {printable(', '.join(arrays)) or 'none'}"
        )
        raise InputError(path, problem, fix="Store the heights in a 2D array called `heights`.")
    return arrays.get("heights", next(iter(arrays.values())))


def _read_image(path: Path) -> Array:
    """Grey values (rows, columns) of an image; nan in holes."""
    from PIL import Image

    try:
        # Only these formats, because for others Pillow may start programs, such as Ghostscript.
        with Image.open(path, formats=IMAGE_FORMATS[path.suffix.lower()]) as image:
            if image.width * image.height > MAX_CELLS:
                problem = (
                    f"{image.width} x {image.height} cells are too many; at most {MAX_CELLS} are allowed"
                )
                raise InputError(path, problem)
            grey = image if image.mode in ("L", "I", "F", "I;16", "I;16B", "1") else image.convert("L")
            heights = np.asarray(grey, float)
            no_data = getattr(image, "tag_v2", {}).get(GDAL_NODATA)
            return heights if no_data is None else np.where(heights == float(no_data), np.nan, heights)
    except InputError:
        raise
    except Exception as error:  # Pillow's decoders raise many kinds of error for a damaged file
        wide_numbers = "If the file holds 64-bit numbers, save it with 32-bit numbers or as .npy."
        fix = wide_numbers if path.suffix.lower() in (".tif", ".tiff") else None
        raise InputError(path, f"not an image that can be read ({printable(error)})", fix=fix) from error


# Generates heightmaps of six kinds from a seed: fractal noise, hills, stairs, slopes, boxes and beams.
#
# Heights are chosen so that most patches of 5 x 5 m stay within 50 cm of their mean. Others are not used.


CELLS = 400  # number of rows, and of columns, of a map


def generate_heights(kind: str, seed: int, cell: float) -> Array:
    """(400, 400) heights of one kind of ground, cm. Equal arguments give equal heights.

    kind: a key of KINDS. cell: width of a cell, cm.
    """
    rng = np.random.default_rng([zlib.crc32(kind.encode()), seed])
    return KINDS[kind](rng, cell)


def fractal(rng: np.random.Generator, cell: float) -> Array:
    """Noise like rough soil. Its amplitude is 1 / frequency², and constant for waves longer than 8 m."""
    frequency = np.hypot(np.fft.fftfreq(CELLS, cell)[:, None], np.fft.rfftfreq(CELLS, cell))
    amplitude = 1 / np.maximum(frequency, 1 / 800) ** 2
    amplitude[0, 0] = 0
    noise = np.fft.irfft2(amplitude * np.fft.rfft2(rng.normal(size=(CELLS, CELLS))), (CELLS, CELLS))
    return noise / noise.std() * rng.uniform(12, 18)  # standard deviation 12 to 18 cm


def hills(rng: np.random.Generator, cell: float) -> Array:
    """Round hills and hollows, 0.6 to 2 m in radius, up to 35 cm high."""
    x, z = _cell_positions(cell)
    heights = np.zeros_like(x)
    for _ in range(60):
        centre = rng.uniform(0, CELLS * cell, 2)
        radius, height = rng.uniform(60, 200), rng.uniform(-35, 35)
        heights += height * np.exp(-((x - centre[0]) ** 2 + (z - centre[1]) ** 2) / (2 * (radius / 2) ** 2))
    return heights


def stairs(rng: np.random.Generator, cell: float) -> Array:
    """Lanes side by side. In each lane, a flight of 3 to 5 steps goes up or down; the next one goes back."""
    heights = np.zeros((CELLS, CELLS))
    along = np.arange(CELLS) * cell
    lane = 0
    while lane < CELLS:
        width = int(rng.uniform(200, 400) / cell)
        # Each step begins at an edge and has a level. position: along the lane, cm.
        edges, levels, level = [], [], 0.0
        position = -rng.uniform(0, 300)
        while position < CELLS * cell:
            tread, riser = rng.uniform(28, 42), rng.uniform(8, 17) * rng.choice([-1, 1])
            for sign in (1, -1):
                for _ in range(rng.integers(3, 6)):
                    if abs(level + sign * riser) > 60:  # cm; a flight that would go further ends here
                        break
                    position, level = position + tread, level + sign * riser
                    edges.append(position)
                    levels.append(level)
                position += rng.uniform(80, 250)
        steps = np.concatenate([[0.0], levels])[np.searchsorted(edges, along)]
        heights[lane : lane + width] = steps
        lane += width
    return heights


def slope(rng: np.random.Generator, cell: float) -> Array:
    """Ramps of 2 to 12 degrees, 1 to 4 m long. The whole map is tilted sideways by up to 5 degrees."""
    along = np.arange(CELLS) * cell
    knots, levels = [0.0], [0.0]
    while knots[-1] < along[-1]:
        length, steepness = rng.uniform(100, 400), np.tan(np.radians(rng.uniform(2, 12)))
        # 1 for up, -1 for down; from beyond 30 cm, a ramp leads back.
        direction = -np.sign(levels[-1]) if abs(levels[-1]) > 30 else rng.choice([-1, 1])
        knots.append(knots[-1] + length)
        levels.append(levels[-1] + direction * steepness * length)
    across = along * np.tan(np.radians(rng.uniform(-5, 5)))
    return np.interp(along, knots, levels)[:, None] + across[None]


def boxes(rng: np.random.Generator, cell: float) -> Array:
    """Boxes 5 to 45 cm high on a flat floor, to step and jump on."""
    heights = np.zeros((CELLS, CELLS))
    for _ in range(110):
        rows, columns = (rng.uniform(40, 180, 2) / cell).astype(int)
        i, j = rng.integers(0, CELLS, 2)
        heights[i : i + rows, j : j + columns] = rng.uniform(5, 45)
    return heights


def beams(rng: np.random.Generator, cell: float) -> Array:
    """Crossing beams, 20 to 35 cm wide and 45 to 55 cm above the floor."""
    x, z = _cell_positions(cell)
    heights = np.zeros_like(x)
    for _ in range(9):
        angle, height = rng.uniform(0, np.pi), rng.uniform(45, 55)
        centre = rng.uniform(0, CELLS * cell, 2)
        distance = (x - centre[0]) * np.cos(angle) + (z - centre[1]) * np.sin(angle)
        heights[np.abs(distance) < rng.uniform(20, 35) / 2] = height
    return heights


def _cell_positions(cell: float) -> tuple[Array, Array]:
    """x and z of every cell, each (400, 400), cm."""
    along = np.arange(CELLS) * cell
    x, z = np.meshgrid(along, along, indexing="ij")
    return x, z


# name -> function of a random generator and the width of a cell, cm
KINDS: dict[str, Callable[[np.random.Generator, float], Array]] = {
    f.__name__: f for f in (fractal, hills, stairs, slope, boxes, beams)
}
