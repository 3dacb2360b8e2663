"""Estimators written in Python, run in this process: a function of a Problem.

    def mine(problem):
        ...
        return T_curr_prev            # or an Estimate, or the name of a status: "diverged"

    sextant.run("synthetic:s18", estimator=mine, out="out")

For every frame pair the function is called for the background, and for every moving object that passes the gates, inside Sextant's
pipeline: features, RANSAC, gates, tracks, noise, truth and metrics are Sextant's. It receives measurements only, no ground truth.
"""

import contextlib
import dataclasses
import json
import threading
import typing
import warnings

import numpy

from ._core import Error
from .arguments import floats, switch, text, whole
from .fingerprint import fingerprint
from .noise import Camera

#: Statuses that a function may return instead of a motion.
STATUSES = ("diverged", "too_few_points", "collinear", "at_infinity", "no_parallax")

_one_at_a_time = threading.Lock()  # held during a run or sweep with functions
_here = threading.local()  # in_estimator: this thread is executing an estimator's function


@dataclasses.dataclass(frozen=True)
class DeclaredNoise:
    """Standard deviations declared by the source, as in a data sheet: sigma(z) = z^2 inverse_depth_per_m."""
    flow_x_px: float
    flow_y_px: float
    inverse_depth_per_m: float
    flow_outlier_share: float
    correlation: list  #: (length_px, share)
    independent_gaussian: bool


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """Measurements of one rigid body between two frames, with n points and without ground truth."""
    camera: Camera
    pixels: numpy.ndarray  #: (n, 2), px, previous frame
    depth: numpy.ndarray  #: (n,), m, previous frame
    flow: numpy.ndarray  #: (n, 2), px: the point is at pixels + flow in the current frame
    depth_curr: numpy.ndarray  #: (n,), m, at the pixel nearest to pixels + flow; NaN = none
    start: numpy.ndarray  #: (4, 4), T_curr_prev of RANSAC or of the propagated motion
    inliers: numpy.ndarray  #: (n,) bool: the points to use, as the pipeline chose them
    noise: typing.Optional[DeclaredNoise]  #: None: the source declares no noise

    def points(self):
        """The points in previous camera coordinates, (n, 3), m."""
        c = self.camera
        rays = numpy.stack([(self.pixels[:, 0] - c.cx) / c.fx, (self.pixels[:, 1] - c.cy) / c.fy,
                            numpy.ones(len(self.depth))], axis=1)
        return rays * self.depth[:, None]


@dataclasses.dataclass(frozen=True, eq=False)
class Estimate:
    """An estimate; T_curr_prev maps the body's points from previous to current camera coordinates."""
    T_curr_prev: numpy.ndarray  #: (4, 4)
    covariance: typing.Optional[numpy.ndarray] = None  #: (6, 6), of the left twist [rho; omega] (m, rad)
    inliers: typing.Optional[numpy.ndarray] = None  #: (n,) bool, the points that were used
    iterations: int = 0


def _answer(name, answer):
    """Returns (status, T_curr_prev, covariance, inliers, iterations)."""
    if isinstance(answer, str):
        if answer not in STATUSES:
            raise Error(f"estimator {name}: expected a motion or one of {', '.join(STATUSES)}, got {answer!r}")
        return answer, None, None, None, 0
    if isinstance(answer, (numpy.ndarray, list, tuple)):
        answer = Estimate(answer)
    if not isinstance(answer, Estimate):
        raise Error(f"estimator {name}: expected numbers (4, 4), a sextant.Estimate or a status, got {type(answer).__name__}")
    inliers = numpy.asarray(answer.inliers) if isinstance(answer.inliers, (list, tuple)) else answer.inliers
    numbers = [value if isinstance(value, numpy.ma.MaskedArray) else floats(f"estimator {name}: {key}", value)
               for key, value in (("T_curr_prev", answer.T_curr_prev), ("covariance", answer.covariance))]
    return ("ok", *numbers, inliers,
            whole(f"estimator {name}: iterations", answer.iterations, 0, 2**31 - 1))


def adapter(name, function):
    """Returns the function that the compiled module calls."""

    def call(camera, pixels, depth, flow, depth_curr, start, inliers, noise, place):
        problem = Problem(Camera(*camera), pixels, depth, flow, depth_curr, start, inliers,
                          None if noise is None else DeclaredNoise(*noise))
        _here.in_estimator = True
        try:
            answer = function(problem)
        except Exception as error:
            if hasattr(error, "add_note"):  # from Python 3.11 on
                error.add_note(f"estimator {name}: raised for {place}")
            raise
        finally:
            _here.in_estimator = False
        try:
            return _answer(name, answer)
        except Error as error:
            raise Error(f"{error}; returned for {place}") from None

    return call


def options_of(function):
    """Returns the name of the function in run.json."""
    called = getattr(function, "__wrapped__", function)
    return {"function": f"{getattr(called, '__module__', '?')}.{getattr(called, '__qualname__', type(called).__name__)}"}


def name_of(function):
    return getattr(function, "__name__", type(function).__name__).strip("<>")


@contextlib.contextmanager
def added(functions):
    """Yields the compiled module while it knows the functions as python:NAME. The names are global, so runs in other threads
    wait."""
    from . import _inprocess  # takes half a second, since it contains the whole program
    if getattr(_here, "in_estimator", False):
        raise Error("a function that is running as an estimator cannot start a run or sweep with functions: "
                    "call sextant.run or sextant.sweep outside of it")
    if not isinstance(functions, dict):
        raise Error(f"estimators: expected a dict of functions by name, got {functions!r}")
    known = []
    for name, function in functions.items():
        if not callable(function):
            raise Error(f"estimator {name}: expected a function of a sextant.Problem, got {function!r}")
        version = fingerprint(function)
        if version["not_seen"]:
            warnings.warn(f"estimator {name}: its fingerprint does not notice changes of some values: "
                          f"{'; '.join(version['not_seen'])}", stacklevel=5)  # the caller of sextant.run or sextant.sweep
        known.append((text("name", name), adapter(name, function), json.dumps(options_of(function)), json.dumps(version),
                      switch(f"estimator {name}: chooses_points", getattr(function, "chooses_points", False))))
    with _one_at_a_time:
        try:
            for each in known:
                _inprocess.set_function(*each)
            yield _inprocess
        finally:
            for name in functions:
                _inprocess.forget_function(name)
