"""The noise of docs/noise.md on arrays, with the same bits that estimators in the program get."""

import dataclasses
import json
import typing
import warnings

import numpy

from . import _core
from ._core import Error
from .arguments import choice, floats, json_text, number, text, whole
from .showing import Shown


@dataclasses.dataclass(frozen=True)
class Camera:
    """Rectified stereo camera: focal lengths and centre in px, bf = focal length times baseline in px m. motion_bound() converts
    delta_d_px to metres with this bf, Noise with a baseline of 0.5 m; an explicit baseline_m overrides either default."""
    fx: float
    fy: float
    cx: float
    cy: float
    bf: float = 0.0

    def numbers(self):
        """Returns fx, fy, cx, cy, bf after checking them."""
        return [number(f"camera.{field.name}", getattr(self, field.name)) for field in dataclasses.fields(self)]


def camera_numbers(camera, name="camera"):
    if not isinstance(camera, Camera):
        raise Error(f"{name}: expected a sextant.Camera, got {camera!r} of type {type(camera).__name__}")
    return camera.numbers()


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class NoisyFrame(Shown):
    """The given arrays after corruption; None for arrays that were not given. Depths that became invalid are NaN."""
    depth: typing.Optional[numpy.ndarray]
    flow: typing.Optional[numpy.ndarray]
    backward_flow: typing.Optional[numpy.ndarray]
    mask: typing.Optional[numpy.ndarray]
    achieved: dict  #: requested and achieved, as in run.json


_UNUSED_CAMERA = [1.0, 1.0, 0.0, 0.0, 1.0]


def _ids(mask):
    """Returns a mask as uint16; accepts lists and any type of whole numbers whose ids fit."""
    if mask is None:
        return None
    if isinstance(mask, numpy.ma.MaskedArray):
        raise Error("mask: expected an array without a mask, got one with a mask: give mask.filled(0)")
    if not isinstance(mask, numpy.ndarray):
        mask = floats("mask", mask, None)
    if mask.dtype.kind not in "iu":
        raise Error(f"mask: expected whole numbers, such as uint16, got {mask.dtype}")
    if mask.size and (mask.min() < 0 or mask.max() > 65535):
        raise Error(f"mask: expected instance ids from 0 to 65535, got {mask.min() if mask.min() < 0 else mask.max()}")
    return numpy.ascontiguousarray(mask, numpy.uint16) if mask.ndim else mask


class Noise:
    """Noise with the options of plans and --noise: a dict, or JSON text.

    Noise({"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}, "correlation": {"model": "spatial", ...}})

    delta_d_px is the standard deviation of disparity at a baseline of 0.5 m, the paper's, whatever the camera's is:
    sigma(z) = z^2 / (fx baseline_m) delta_d_px. With "baseline_m": 0 it is that of the camera's own baseline, bf / fx.
    """

    def __init__(self, options):
        self._text = json_text("noise", options)
        self._noise = _core.Noise(self._text)
        self._assumed_baseline_m = self._baseline_without_option()

    def __reduce__(self):
        return Noise, (self._text,)

    @property
    def options(self):
        """Returns all options of the models that have an effect."""
        return json.loads(self._noise.options())

    @property
    def name(self):
        """Returns the name of the noise in records, which mentions the baseline of depth noise only if it is not 0.5 m."""
        return self._noise.name()

    def _baseline_without_option(self):
        """Returns the baseline of the depth noise in m if neither the options nor a profile set it; otherwise 0."""
        given = json.loads(self._text) if self._text.lstrip().startswith("{") else {}
        is_set = "profile" in given or "baseline_m" in given.get("depth", {})
        return 0.0 if is_set else self.options.get("depth", {}).get("baseline_m", 0.0)

    def _warn_of_another_baseline(self, camera):
        own, assumed = camera.bf / camera.fx, self._assumed_baseline_m
        if assumed and abs(own / assumed - 1) > 0.05:
            warnings.warn(f"depth noise is added for a baseline of {assumed:g} m, but the camera's is bf / fx = {own:.4g} m: give "
                          f"'baseline_m': 0 beside delta_d_px for the camera's, or 'baseline_m': {assumed:g}",
                          stacklevel=3)  # the caller of apply()

    def __repr__(self):
        first, *rest = self.name.split(" + ")
        baseline = self.options.get("depth", {}).get("baseline_m")
        if baseline:
            first = first.replace(" at b ", " at a baseline of ") if " at b " in first else \
                first.replace(" px", f" px at a baseline of {baseline:g} m", 1)
        return f"Noise({' + '.join([first, *rest])})"

    def apply(self, *, seed, dataset, sequence, frame, camera=None, depth=None, flow=None, backward_flow=None, mask=None,
              missing="error"):
        """Returns the arrays of one frame with noise; the arguments stay unchanged.

        depth          (height, width), m; converted to float32, the type of the result
        flow           (height, width, 2), px to the next frame; backward_flow: to the previous one
        mask           (height, width), instance ids 0..65535, 0 = background; whole numbers of any type, which the result has, too;
                       of lists uint16
        missing        "error": every depth must be finite and above 0, every flow finite; "keep": NaN, infinity and a depth of 0
                       mark pixels without a measurement, and are returned unchanged
        camera         needed with depth; its bf counts only where the option depth.baseline_m is 0. Without this option the noise is
                       that of a baseline of 0.5 m, and a warning is issued if bf / fx differs from it by more than 5 %
        Each random draw is a function of seed, dataset, sequence, frame, channel and pixel, with the names `dataset` and
        `sequence` of the records.

        >>> camera = sextant.Camera(fx=725, fy=725, cx=2, cy=1, bf=387)
        >>> noise = sextant.Noise({"depth": {"delta_d_px": 0.2, "baseline_m": 0.5}})
        >>> noise
        Noise(depth 0.2 px at a baseline of 0.5 m)
        >>> noise.apply(seed=0, dataset="mine", sequence="1", frame=0, camera=camera, depth=[[20, 20.5], [21, 21.5]])
        NoisyFrame(depth: float32 (2, 2), achieved: 3)
        """
        depth, flow, backward_flow = (floats(name, value, numpy.float32) for name, value in (
            ("depth", depth), ("flow", flow), ("backward_flow", backward_flow)))
        given = {"depth": depth, "flow": flow, "backward_flow": backward_flow, "mask": mask}
        if all(array is None for array in given.values()):
            raise Error("depth, flow, backward_flow, mask: expected at least one array, got none")
        if depth is not None and camera is None:
            raise Error("camera: expected a sextant.Camera, because depth is given, got None")
        numbers = _UNUSED_CAMERA if camera is None else camera_numbers(camera)
        noisy = self._noise.apply(numbers, whole("seed", seed, 0, 2**64 - 1), text("dataset", dataset),
                                  text("sequence", sequence), whole("frame", frame, 0, 2**31 - 1), depth, flow, backward_flow,
                                  _ids(mask), choice("missing", missing, ("error", "keep")) == "keep")
        if depth is not None:
            self._warn_of_another_baseline(camera)
        kind = getattr(mask, "dtype", numpy.dtype(numpy.uint16))
        of_mask = noisy[3] if noisy[3] is None or kind == numpy.uint16 else noisy[3].astype(kind.newbyteorder("="))
        return NoisyFrame(noisy[0], noisy[1], noisy[2], of_mask, json.loads(noisy[4]))
