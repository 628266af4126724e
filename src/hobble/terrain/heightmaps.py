"""Heightmaps: from files, from matplotlib's elevation model of a real landscape, or generated."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import load_npy, load_npz
from hobble.core.quat import Array
from hobble.core.untrusted import printable, read_text
from hobble.terrain import options
from hobble.terrain.generate import generate

MAX_CELLS = 1 << 26  # largest number of cells of a map: 8192 x 8192, 512 MB, 322 x 322 m with cells of 3.9 cm
MAX_TEXT_BYTES = 1 << 28  # size of the largest text file that is read
MAX_LINE_LETTERS = 1 << 20  # letters in the longest line of such a file
MAX_HEIGHT = 1e7  # largest height, cm (100 km); the runtime has the same limit

# First words of the lines in the header of an ESRI grid.
ESRI_HEADER = {
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "nodata_value",
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
    entries: Sequence[options.HeightmapOptions],
    files: Sequence[str | Path],
    *,
    cell: float,
    height_scale: float,
) -> list[TerrainMap]:
    """The heightmaps that a data set lists.

    files: the files of the entries of kind `file`, in the order of the entries. cell: width of a cell, cm.
    height_scale: factor that converts the heights in files to cm. An entry may have its own `cell` and
    `height_scale`. Raises InputError for a file that cannot be used.
    """
    paths = iter(files)
    out = []
    for entry in entries:
        width = entry.cell or cell
        scale = entry.height_scale
        if entry.kind == "file":
            path = next(paths)
            heights = read_heights(path) * (scale or height_scale)
            if (highest := float(np.nanmax(np.abs(heights)))) > MAX_HEIGHT:
                raise InputError(
                    path,
                    f"a height of {highest:.4g} cm; {MAX_HEIGHT:g} at most",
                    fix="Set height_scale of this map, or say in the file what stands for no data.",
                )
            out.append(TerrainMap(str(path), heights, width))
        elif entry.kind == "elevation":
            out.append(TerrainMap("elevation", elevation(width) * (scale or 1.0), width))
        else:
            name = f"{entry.kind} (seed {entry.seed})"
            heights = generate(entry.kind, entry.seed, width) * (scale or 1.0)
            out.append(TerrainMap(name, heights, width))
    return out


def elevation(cell: float) -> Array:
    """Heights (rows, columns), cm, of a real landscape in matplotlib's sample data, reduced in size.

    A cell of the data is 3 arc seconds wide: 92.6 m north to south, and 74.3 m east to west at 36.6 degrees
    north. The columns are resampled so that cells are square. Then lengths and heights are scaled by the same
    factor, so that a cell is `cell` cm wide. Slopes reach 36 degrees.
    """
    import matplotlib

    data = load_npz(Path(matplotlib.get_data_path(), "sample_data", "jacksboro_fault_dem.npz"))
    metres = data["elevation"].astype(float)
    latitude = (float(data["ymin"]) + float(data["ymax"])) / 2
    narrow = np.cos(np.radians(latitude))
    columns = np.arange(metres.shape[1])
    at = np.arange(0, metres.shape[1] - 1, 1 / narrow)
    square = np.stack([np.interp(at, columns, row) for row in metres])
    north_south = 1852.0 / 60 * 3
    return (square - square.mean()) * cell / north_south


def read_heights(path: str | Path) -> Array:
    """Heights (rows, columns) from a file, in the file's unit; nan in holes.

    .txt .csv .dat .asc: rows of numbers separated by spaces, commas or semicolons, with or without the header
    of an ESRI grid. .npy: one 2D array. .npz: its only 2D array, or the one called `heights` or `elevation`.
    .png .tif .tiff: grey values of up to 32 bits. The "no data" value of a GeoTIFF or ESRI grid marks a hole.
    Raises InputError if the file cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such heightmap", fix="See terrain.heightmaps of the data set.")
    readers = {".npz": _npz, ".npy": load_npy, **dict.fromkeys(IMAGE_FORMATS, _image)}
    heights = np.asarray(readers.get(path.suffix.lower(), _text)(path))
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise InputError(path, f"a heightmap needs rows and columns, but this has shape {heights.shape}")
    if heights.dtype.kind not in "fiub":
        raise InputError(path, f"heights must be numbers, not {heights.dtype}")
    if heights.size > MAX_CELLS:
        raise InputError(path, f"{heights.size} heights, more than {MAX_CELLS}")
    heights = heights.astype(float)
    if not np.isfinite(heights).any():
        raise InputError(path, "holds no finite height")
    return np.where(np.isfinite(heights), heights, np.nan)


def _text(path: Path) -> Array:
    rows: list[Array] = []
    header: dict[str, float] = {}
    cells = 0
    for number, line in enumerate(io.StringIO(read_text(path, MAX_TEXT_BYTES), newline=None), 1):
        if len(line) > MAX_LINE_LETTERS:
            raise InputError(path, f"a line of more than {MAX_LINE_LETTERS} letters", line=number)
        words = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            if not rows and words[0].lower() in ESRI_HEADER:
                header[words[0].lower()] = float(" ".join(words[1:]))
                continue
            rows.append(np.array([float(word) for word in words]))
        except ValueError as error:
            raise InputError(
                path, f"not a number: {str(error).split(':')[-1].strip()}", line=number
            ) from error
        if len(rows[-1]) != len(rows[0]):
            problem = f"{len(rows[-1])} heights, but the rows above have {len(rows[0])}"
            raise InputError(path, problem, line=number)
        cells += len(rows[-1])
        if cells > MAX_CELLS:
            raise InputError(path, f"more than {MAX_CELLS} heights", line=number)
    if not rows:
        raise InputError(path, "holds no heights")
    heights, no_data = np.array(rows), header.get("nodata_value")
    return heights if no_data is None else np.where(heights == no_data, np.nan, heights)


def _npz(path: Path) -> Array:
    arrays = {name: a for name, a in load_npz(path).items() if a.ndim == 2}
    for name in ("heights", "elevation", *arrays):
        if name in arrays and (len(arrays) == 1 or name in ("heights", "elevation")):
            return arrays[name]
    raise InputError(
        path,
        f"which array holds the heights? There are: {printable(', '.join(arrays)) or 'none with two axes'}",
        fix="Name it `heights`.",
    )


def _image(path: Path) -> Array:
    from PIL import Image

    try:
        # Only these formats, because for others Pillow may start programs, such as Ghostscript.
        with Image.open(path, formats=IMAGE_FORMATS[path.suffix.lower()]) as image:
            if image.width * image.height > MAX_CELLS:
                raise InputError(path, f"{image.width} x {image.height} cells, more than {MAX_CELLS}")
            grey = image if image.mode in ("L", "I", "F", "I;16", "I;16B", "1") else image.convert("L")
            heights = np.asarray(grey, float)
            no_data = getattr(image, "tag_v2", {}).get(GDAL_NODATA)
            return heights if no_data is None else np.where(heights == float(no_data), np.nan, heights)
    except InputError:
        raise
    except Exception as error:  # Pillow's decoders raise many kinds of error for a damaged file
        wide = "64-bit numbers in a TIFF cannot be read. Save them as 32 bits or as .npy."
        fix = wide if path.suffix.lower() in (".tif", ".tiff") else None
        raise InputError(path, f"not an image that can be read ({printable(error)})", fix=fix) from error
