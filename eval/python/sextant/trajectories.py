"""Errors of camera paths, as `sextant evaluate ego` and evo have them (docs/metrics.md). Paths are float64 arrays (n, 4, 4)
of T_world_camera, estimate and reference pose by pose: associate() finds which belong together."""

import dataclasses
import typing

import numpy

from . import _core
from .arguments import number, text, whole


@dataclasses.dataclass(frozen=True)
class ErrorStatistics:
    """std as numpy's (n in the denominator); sse: the sum of squares."""
    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float
    sse: float


@dataclasses.dataclass(frozen=True)
class Alignment:
    poses: numpy.ndarray  #: the estimate, moved
    transform: numpy.ndarray  #: [s R | t; 0 0 0 1], reference from estimate
    scale: float
    flatness: float  #: near 0: the positions lie on a line, and the rotation about it is arbitrary


@dataclasses.dataclass(frozen=True)
class RelativeErrors:
    errors: numpy.ndarray
    pairs: numpy.ndarray  #: (n, 2): error k is that between poses pairs[k]


@dataclasses.dataclass(frozen=True)
class KittiError:
    """Over stretches of one length, or of all (length_m 0). None where the path is too short for any."""
    length_m: float
    n: int
    translation_percent: typing.Optional[float]
    rotation_deg_per_m: typing.Optional[float]


def statistics(errors):
    """Of a float64 array (n,)."""
    return ErrorStatistics(*_core.statistics(errors))


def align(estimate, reference, method="se3", *, n_to_align=0, up=None):
    """Moves the estimate onto the reference: none, origin, se3, sim3, scale or yaw (about `up`), from the first n_to_align
    poses (0: all)."""
    up = None if up is None else [number("up", value) for value in up]
    return Alignment(*_core.align(estimate, reference, text("method", method), whole("n_to_align", n_to_align, 0, 2**31 - 1),
                                  up))


def absolute_errors(estimate, reference, *, relation="trans_part", align="none", n_to_align=0, up=None):
    """One error a pose (ATE, evo's APE): trans_part [m], rot_part, angle_deg, angle_rad, full, point_distance [m]."""
    if align != "none":
        estimate = globals()["align"](estimate, reference, align, n_to_align=n_to_align, up=up).poses
    return _core.absolute_errors(estimate, reference, text("relation", relation))


def relative_errors(estimate, reference, *, delta="1f", all_pairs=False, relation="trans_part", tolerance=0.1,
                    pairs_from_reference=False, stamps=None, align="none", n_to_align=0, up=None):
    """One error a pair of poses (RPE) that are `delta` apart: 1f (frames), 10m, 5deg, 0.5rad, 2s (with `stamps`)."""
    if align != "none":
        estimate = globals()["align"](estimate, reference, align, n_to_align=n_to_align, up=up).poses
    return RelativeErrors(*_core.relative_errors(estimate, reference, text("delta", delta), bool(all_pairs),
                                                 number("tolerance", tolerance), bool(pairs_from_reference),
                                                 text("relation", relation), stamps))


def kitti_odometry(estimate, reference):
    """Errors of the KITTI odometry benchmark: all lengths together first, then 100 to 800 m."""
    return [KittiError(*row) for row in _core.kitti_odometry(estimate, reference)]


def associate(reference_stamps, estimate_stamps, *, max_difference=0.01, offset=0.0):
    """Indices (of the reference, of the estimate) of poses that belong together by time, as evo finds them; stamps in s,
    rising, `offset` added to those of the estimate."""
    return _core.associate(reference_stamps, estimate_stamps, number("max_difference", max_difference),
                           number("offset", offset))
