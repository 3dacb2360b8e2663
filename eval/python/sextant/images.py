"""Files of flow and depth as arrays."""

import numpy

from ._core import Error
from .arguments import choice, number, path


def read_flow(file, format="auto") -> numpy.ndarray:
    """Reads optical flow: float32 (height, width, 2), px, NaN = invalid. Formats: flo (Middlebury), kitti or vkitti (16-bit PNG).
    `auto` recognises flo by the extension .flo; for other files the format must be given.

    >>> import pathlib
    >>> pathlib.Path("x.flo").write_bytes(b"PIEH" + numpy.array([1, 1], "<i4").tobytes() + numpy.array([0.5, -1], "<f4").tobytes())
    20
    >>> sextant.read_flow("x.flo")
    array([[[ 0.5, -1. ]]], dtype=float32)
    """
    from . import _files
    file, format = path("file", file), choice("format", format, ("auto", "flo", "kitti", "vkitti"))
    if format == "auto" and not file.endswith(".flo"):
        raise Error(f"{file}: the format cannot be recognised by this name: expected flo, kitti or vkitti in format=")
    return _files.flow(file, "flo" if format == "auto" else format)


def read_depth(file, format, *, bf=0.0) -> numpy.ndarray:
    """Reads depth from a 16-bit PNG: float32 (height, width), m, NaN = invalid. Formats: depth256 (KITTI), cm (Virtual KITTI), or
    disparity256 with bf, focal length times baseline in px m.

    >>> sextant.read_depth("missing.png", "cm")
    Traceback (most recent call last):
    ...
    sextant._core.Error: missing.png: ...
    """
    from . import _files
    file, format = path("file", file), choice("format", format, ("disparity256", "depth256", "cm"))
    bf = number("bf", bf)
    if format == "disparity256" and not bf > 0:
        raise Error(f"bf: expected focal length times baseline, above 0 px m, with format='disparity256', got {bf:g}")
    return _files.depth(file, format, bf)
