"""Images as maps: grey levels, read in bounded memory. PNG, PGM (and its relatives) and BMP."""

import os
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import UnreadableError, open_file

PIXELS_MOST = 10**8  # one byte each, and a few more while they are read
FORMATS = ("PNG", "PPM", "BMP")


@dataclass(frozen=True)
class Grey:
    """level: (rows, columns) of uint8, 0 black, the first row at the top; alpha: the same shape, 255 opaque, None: the image
    has none."""

    level: np.ndarray
    alpha: np.ndarray | None = None

    @property
    def opaque(self) -> np.ndarray | None:
        """(rows, columns) whether a pixel cannot be looked through; None: none can."""
        return None if self.alpha is None or (self.alpha == 255).all() else self.alpha == 255


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
            _fit(image)
            return _grey(image)
    except Image.DecompressionBombError as error:
        raise UnreadableError(f"more than {PIXELS_MOST:g} pixels; make it coarser") from error
    except UnreadableError:
        raise
    except OSError as error:
        raise UnreadableError(f"cannot be read ({error.strerror or 'no whole PNG, PGM or BMP image'})") from error
    except (ValueError, SyntaxError, MemoryError, EOFError) as error:
        raise UnreadableError("no whole PNG, PGM or BMP image") from error


def _fit(image) -> None:
    """UnreadableError where a raw PGM, or one of its relatives, holds not just the pixels that its header asks for: every one
    would be shifted. A header whose last line ends in CR and LF is read as it is meant."""
    codec, _, offset, args = image.tile[0]
    if image.format != "PPM" or codec == "ppm_plain":
        return
    deep = image.mode.startswith("I") or (isinstance(args, tuple) and args[-1] > 255)
    line = (image.width + 7) // 8 if image.mode == "1" else image.width * len(image.getbands()) * (1 + deep)
    over = image.fp.seek(0, os.SEEK_END) - offset - line * image.height
    image.fp.seek(offset - 1)
    if over == 1 and image.fp.read(2) == b"\r\n":
        image.tile = [image.tile[0]._replace(offset=offset + 1)]
    elif over:
        raise UnreadableError(
            f"{abs(over)} bytes {'more' if over > 0 else 'less'} than its header asks for; save it anew"
        )


def _grey(image) -> Grey:
    if image.mode.startswith("I"):  # 16 bits a pixel
        return Grey((np.asarray(image, np.uint32) >> 8).astype(np.uint8))
    if image.mode in ("1", "L"):
        return Grey(np.asarray(image.convert("L")))
    bands = np.asarray(image.convert("RGBA"))
    level = (bands[..., :3].sum(axis=2, dtype=np.uint16) // 3).astype(np.uint8)
    return Grey(level, bands[..., 3] if image.has_transparency_data else None)


def nearest_levels(level: np.ndarray, levels: tuple[int, ...]) -> np.ndarray:
    """Index of the nearest of these levels for each pixel; of two as near, the first."""
    table = np.abs(np.arange(256)[:, None] - np.array(levels)).argmin(axis=1).astype(np.uint8)
    return table[level]
