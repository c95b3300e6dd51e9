"""Images as maps: grey levels, read in bounded memory. PNG, PGM (and its relatives) and BMP."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import UnreadableError, open_file

PIXELS_MOST = 10**8  # one byte each, and a few more while they are read
FORMATS = ("PNG", "PPM", "BMP")


@dataclass(frozen=True)
class Grey:
    """level: (rows, columns) of uint8, 0 black, the first row at the top; opaque: the same shape, None: everywhere."""

    level: np.ndarray
    opaque: np.ndarray | None = None


def read_grey(path: str | Path) -> Grey:
    """The grey levels of an image, colours averaged; UnreadableError says why there are none."""
    from PIL import Image  # only who reads an image needs it

    try:
        with open_file(path) as file, warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit here is the lower one
            image = Image.open(file, formats=FORMATS)
            width, height = image.size
            if width * height > PIXELS_MOST:
                raise UnreadableError(f"{width} x {height} pixels, {PIXELS_MOST:g} are the most; make it coarser")
            return _grey(image)
    except Image.DecompressionBombError as error:
        raise UnreadableError(f"more than {PIXELS_MOST:g} pixels; make it coarser") from error
    except UnreadableError:
        raise
    except OSError as error:
        raise UnreadableError(f"cannot be read ({error.strerror or 'no whole PNG, PGM or BMP image'})") from error
    except (ValueError, SyntaxError, MemoryError, EOFError) as error:
        raise UnreadableError("no whole PNG, PGM or BMP image") from error


def _grey(image) -> Grey:
    if image.mode.startswith("I"):  # 16 bits a pixel
        return Grey((np.asarray(image, np.uint32) >> 8).astype(np.uint8))
    if image.mode in ("1", "L"):
        return Grey(np.asarray(image.convert("L")))
    bands = np.asarray(image.convert("RGBA"))
    opaque = bands[..., 3] == 255
    level = (bands[..., :3].sum(axis=2, dtype=np.uint16) // 3).astype(np.uint8)
    return Grey(level, None if opaque.all() else opaque)


def nearest_levels(level: np.ndarray, levels: tuple[int, ...]) -> np.ndarray:
    """Index of the nearest of these levels for each pixel; of two as near, the first."""
    table = np.abs(np.arange(256)[:, None] - np.array(levels)).argmin(axis=1).astype(np.uint8)
    return table[level]
