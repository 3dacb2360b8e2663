"""Errors of motions between two frames, and their Cramer-Rao lower bound (docs/metrics.md)."""

import dataclasses
import typing

import numpy

from . import _core
from ._core import Error
from .arguments import floats, number, numbers, poses, switch
from .noise import camera_numbers
from .trajectories import check_rotations


def pose_change_errors(estimate, truth):
    """Returns E_t [m] and E_R [deg] of E = inverse(estimate) truth for each pair of motions, both (n, 4, 4).

    >>> estimate, truth = numpy.tile(numpy.eye(4), (2, 1, 1)), numpy.tile(numpy.eye(4), (2, 1, 1))
    >>> estimate[1, 2, 3] = 0.5
    >>> sextant.pose_change_errors(estimate, truth)[0]
    array([0. , 0.5])
    """
    check_rotations("pose_change_errors", estimate, truth)
    return _core.pose_change_errors(poses("estimate", estimate), poses("truth", truth))


def object_errors(estimate, truth, *, object_pose=None, dt=0.1, camera=None, true_camera=None):
    """Returns errors of object motions H in the world, from frame k-1 to k, with the definitions of `sextant evaluate objects`.

    estimate, truth   (n, 4, 4), H = L_k inverse(L_k-1) with L = T_world_object
    object_pose       (n, 4, 4), true L of frame k-1: adds Et_body_m, ER_body_deg, v_kmh, v_gt_kmh, Ev_kmh over dt seconds
    camera            (previous, current), each (n, 4, 4): T_world_camera of the estimate; adds Et_m, ER_deg, the errors of the
                      motion as the camera sees it
    true_camera       the same of the truth; if only one of camera and true_camera is given, it serves for both
    Returns a dict of arrays by the keys of records; Et_world_m and ER_world_deg are always there.

    >>> still = [numpy.eye(4)]
    >>> {key: float(value[0]) for key, value in sextant.object_errors(still, still).items()}
    {'Et_world_m': 0.0, 'ER_world_deg': 0.0}
    """
    check_rotations("object_errors", estimate, truth, object_pose,
                    *(part for pair in (camera, true_camera) if isinstance(pair, (tuple, list)) for part in pair))
    cameras = [tuple(poses(name, value) for value in pair) if isinstance(pair, (tuple, list)) else pair
               for name, pair in (("camera", camera), ("true_camera", true_camera))]
    return _core.object_errors(poses("estimate", estimate), poses("truth", truth), poses("object_pose", object_pose),
                               number("dt", dt), *cameras)


@dataclasses.dataclass(frozen=True, eq=False)
class Bound:
    """Lower bounds on the covariance of the left twist [rho; omega] (m, rad) of T_curr_prev, and on E_t and E_R."""
    previous_depth: numpy.ndarray  #: (6, 6), from flow and the depth of the previous frame
    both_depths: typing.Optional[numpy.ndarray]  #: with the depth of the current frame too
    T_curr_prev: typing.Optional[numpy.ndarray] = None  #: (4, 4), the motion to which the bound belongs

    def rms(self, T=None, *, body="camera", both=False):
        """Returns the root mean squares (E_t [m], E_R [deg]).

        body   "camera": errors of the camera's motion, which is inverse(T_curr_prev), E = X_estimate inverse(X); "object":
               errors of an object's motion T_curr_prev, E = inverse(X_estimate) X, as in the records of objects
        T      (4, 4), transforms the twist into another frame, instead of `body`
        both   with the depth of the current frame too
        """
        if switch("both", both) and self.both_depths is None:
            raise Error("both: expected False, got True: there is no bound with the depth of the current frame, because depth_curr was not "
                        "given or has no valid value, or because delta_d_px is 0")
        if body not in ("camera", "object"):
            raise Error(f"body: expected 'camera' or 'object', got {body!r}")
        if body == "object":
            if T is not None:
                raise Error("T: expected None with body='object', because it stands for inverse(T_curr_prev)")
            if self.T_curr_prev is None:
                raise Error("body: expected 'camera', because this Bound has no T_curr_prev, got 'object'")
            T = numpy.linalg.inv(self.T_curr_prev)
        return _core.rms_error(floats("covariance", self.both_depths if both else self.previous_depth), floats("T", T))


def motion_bound(camera, pixels, depth, flow, T_curr_prev, *, flow_sigma_px, delta_d_px=0.0, baseline_m=0.0, depth_curr=None,
                 correlation=()):
    """Returns the Cramer-Rao bound of one body's motion; None if the points do not determine it.

    pixels (n, 2), depth (n,), flow (n, 2): exact, float64; depth_curr (n,): above 0, NaN = none. The bound does not depend on the
                      values of flow, only on its noise, because exact flow follows from the other arguments; of depth_curr it
                      matters which are finite
    flow_sigma_px     (x, y), standard deviations
    delta_d_px        standard deviation of disparity: sigma(z) = z^2 / (fx baseline_m) delta_d_px, with camera.bf in place of
                      fx baseline_m if baseline_m is 0, the default. Noise has the default 0.5 m instead: for the bound of its
                      noise give both the same baseline_m
    correlation       [(length_px, share), ...] of errors over the image

    >>> camera = sextant.Camera(fx=700, fy=700, cx=320, cy=240, bf=350)
    >>> pixels = [[100, 100], [500, 120], [300, 400], [150, 350], [520, 380], [320, 60]]
    >>> bound = sextant.motion_bound(camera, pixels, [8, 9, 10, 11, 12, 13], numpy.zeros((6, 2)), numpy.eye(4),
    ...                              flow_sigma_px=(0.3, 0.3), delta_d_px=0.2)
    >>> 0.01 < bound.rms()[0] < 1
    True
    """
    intrinsics = camera_numbers(camera)
    baseline, delta = number("baseline_m", baseline_m, low=0), number("delta_d_px", delta_d_px, low=0)
    focal_baseline = intrinsics[0] * baseline if baseline else intrinsics[4]
    if delta > 0 and not focal_baseline > 0:
        raise Error(f"camera.bf: expected a number above 0 (or baseline_m) with delta_d_px, got {focal_baseline}")
    sigma = numbers("flow_sigma_px", flow_sigma_px, 2, above=0)
    if not isinstance(correlation, (list, tuple)):
        raise Error(f"correlation: expected a list of (length_px, share), got {correlation!r}")
    parts = [numbers("correlation", part, 2, above=0) for part in correlation]
    if sum(share for _, share in parts) > 1 + 1e-9:
        raise Error(f"correlation: expected shares with a sum of at most 1, got {sum(share for _, share in parts):g}")
    found = _core.motion_bound(intrinsics, floats("pixels", pixels), floats("depth", depth), floats("flow", flow),
                               floats("depth_curr", depth_curr), floats("T_curr_prev", T_curr_prev),
                               [*sigma, delta / focal_baseline if delta else 0.0], parts)
    return None if found is None else Bound(*found, floats("T_curr_prev", T_curr_prev))


def nees(estimate, covariance, truth):
    """Returns the normalised estimation error squared of one motion (4, 4) with its covariance (6, 6); None if that is singular.
    A covariance that is not symmetric or has a negative eigenvalue raises an Error.

    >>> estimate = numpy.eye(4)
    >>> estimate[0, 3] = 0.2
    >>> round(sextant.nees(estimate, 0.01 * numpy.eye(6), numpy.eye(4)), 6)
    4.0
    """
    return _core.nees(floats("estimate", estimate), floats("covariance", covariance), floats("truth", truth))
