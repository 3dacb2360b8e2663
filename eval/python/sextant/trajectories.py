"""Paths of cameras and their errors, with the definitions of `sextant evaluate ego` and evo (docs/metrics.md). A path is a
Trajectory, or an array (n, 4, 4) of T_world_camera. Estimate and reference must correspond pose by pose, which is checked where
both have stamps or frames; associate() finds corresponding poses by time."""

import dataclasses
import os
import pathlib
import typing
import uuid

import numpy

from . import _core
from ._core import Error
from .arguments import arguments_named, ascending, choice, floats, number, numbers, optional, path, poses, switch, text, whole
from .showing import Shown, axes_of


# Limits of the readers of trajectory files (eval/logs): beyond them write_trajectory would write files that read_trajectory refuses.
_LAST_FRAME = 10**9
_LARGEST_STAMP_S = 1e11
_FARTHEST_M = 1e7


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class Trajectory(Shown):
    """A path, read from a file or made from arrays or lists, which are checked, converted and copied. The arrays are read-only."""
    poses: numpy.ndarray  #: (n, 4, 4), T_world_camera; the rotations are the matrices as read
    stamps: typing.Optional[numpy.ndarray] = None  #: (n,), s, ascending
    frames: typing.Optional[numpy.ndarray] = None  #: (n,), whole numbers from 0 to 10^9, ascending
    has_rotations: bool = True  #: False: positions only, the rotations are identities
    truth: typing.Optional["Trajectory"] = dataclasses.field(default=None, repr=False)  #: the true path, for logs that contain both
    format: str = ""
    warnings: typing.List[str] = dataclasses.field(default_factory=list)  #: repairs made while reading

    def __post_init__(self):
        found = floats("poses", self.poses)
        if found is None or found.ndim != 3 or found.shape[1:] != (4, 4):
            raise Error(f"poses: expected an array with shape (n, 4, 4), got "
                        f"{'none' if found is None else f'shape {found.shape}'}")
        bad = numpy.flatnonzero(~numpy.isfinite(found).all(axis=(1, 2)))
        if len(bad):
            raise Error(f"poses: expected finite numbers, got others in {len(bad)} of {len(found)} poses, first in poses[{bad[0]}]: "
                        "leave lost frames out, with their stamps or frames")
        if len(found):
            _core.check_path(found, "poses")
        frames = ascending("frames", self.frames, len(found))
        if frames is not None:
            _refuse("frames", f"whole numbers from 0 to {_LAST_FRAME}", frames,
                    (frames != numpy.floor(frames)) | (frames < 0) | (frames > _LAST_FRAME))
            frames = frames.astype(numpy.int64)
        for name, value in (("poses", found), ("stamps", ascending("stamps", self.stamps, len(found))), ("frames", frames)):
            if value is not None:
                value = value.copy()
                value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "has_rotations", switch("has_rotations", self.has_rotations))
        if not isinstance(self.truth, (Trajectory, type(None))):
            raise Error(f"truth: expected a sextant.Trajectory or None, got {self.truth!r} of type {type(self.truth).__name__}")

    def __len__(self):
        return len(self.poses)

    @property
    def positions(self):
        """Positions, (n, 3), m."""
        return self.poses[:, :3, 3]

    def _shown(self):
        steps = numpy.linalg.norm(numpy.diff(self.positions, axis=0), axis=1)
        told = [("poses", str(len(self))), ("length", f"{steps.sum():.6g} m"), ("format", self.format)]
        if self.stamps is not None and len(self):
            told.append(("time", f"{self.stamps[-1] - self.stamps[0]:.6g} s"))
        if not self.has_rotations:
            told.append(("rotations", "none"))
        return [(name, value) for name, value in told if value]

    def plot(self, ax=None, *, plane="xz", **line):
        """Draws the path in bird's eye view (xz of a camera that looks ahead), with matplotlib; returns the axes.

        >>> sextant.Trajectory(numpy.tile(numpy.eye(4), (3, 1, 1))).plot().get_xlabel()
        'x [m]'
        """
        if len(text("plane", plane)) != 2:
            raise Error(f"plane: expected two of x, y, z, such as 'xz', got {plane!r}")
        first, second = ("xyz".index(choice("plane", axis, "xyz")) for axis in plane)
        ax = axes_of(ax)
        ax.plot(self.positions[:, first], self.positions[:, second], **line)
        ax.set_xlabel(f"{plane[0]} [m]")
        ax.set_ylabel(f"{plane[1]} [m]")
        ax.set_aspect("equal", adjustable="datalim")
        return ax


def _refuse(name, expected, values, bad):
    """Raises an Error that names the first of the numbers (n,) for which `bad` (n,) is true."""
    if bad.any():
        k = int(numpy.argmax(bad))
        raise Error(f"{name}: expected {expected}, got {values[k]:.17g} at [{k}]")


def _trajectory(series, truth=None, warnings=(), format=""):
    found, stamps, frames, has_rotations = series
    return Trajectory(found, stamps, frames, has_rotations, truth and _trajectory(truth, format=format), format, list(warnings))


@arguments_named
def read_trajectory(file, format="auto") -> Trajectory:
    """Reads a file in any format of `sextant evaluate ego`: tum, kitti, euroc, bag, mcap, ... (docs/evaluate.md). If a file
    fits several formats, `format` must be given.

    >>> sextant.write_trajectory("path.txt", numpy.tile(numpy.eye(4), (3, 1, 1)), stamps=[0, 0.1, 0.2])
    >>> sextant.read_trajectory("path.txt")
    Trajectory(poses: 3, length: 0 m, format: tum, time: 0.2 s)
    """
    from . import _files
    series, truth, warnings, found = _files.trajectory(path("file", file), text("format", format))
    return _trajectory(series, truth, warnings, found)


def _quaternions(R):
    """Returns quaternions (n, 4), x y z w, of rotations (n, 3, 3), as the eigenvector of the largest eigenvalue."""
    K = numpy.empty((len(R), 4, 4))
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    K[:, 0, 0], K[:, 1, 1], K[:, 2, 2], K[:, 3, 3] = xx - yy - zz, yy - xx - zz, zz - xx - yy, xx + yy + zz
    for i, j, value in ((0, 1, R[:, 1, 0] + R[:, 0, 1]), (0, 2, R[:, 2, 0] + R[:, 0, 2]), (1, 2, R[:, 2, 1] + R[:, 1, 2]),
                        (0, 3, R[:, 2, 1] - R[:, 1, 2]), (1, 3, R[:, 0, 2] - R[:, 2, 0]), (2, 3, R[:, 1, 0] - R[:, 0, 1])):
        K[:, i, j] = K[:, j, i] = value
    q = numpy.linalg.eigh(K)[1][:, :, 3]  # Bar-Itzhack, JGCD 2000
    return q * numpy.where(q[:, 3:] < 0, -1.0, 1.0)


def write_trajectory(file, trajectory, *, stamps=None, format=None) -> None:
    """Writes tum (t x y z qx qy qz qw) if there are stamps, otherwise kitti (twelve numbers per pose, after the frame number where
    the frames of a Trajectory are not 0, 1, 2, ...), with all digits. The file appears only when it is complete.

    >>> import pathlib
    >>> sextant.write_trajectory("kitti.txt", numpy.tile(numpy.eye(4), (2, 1, 1)))
    >>> print(pathlib.Path("kitti.txt").read_text().splitlines()[0])
    1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 0.0
    """
    check_rotations("a file of format tum or kitti", trajectory)
    T = poses("trajectory", trajectory)
    _core.check_path(T, "trajectory")
    farthest = abs(T[:, :3, 3]).max(axis=1)
    _refuse("trajectory", f"positions within {_FARTHEST_M:g} m of 0", farthest, farthest > _FARTHEST_M)
    stamps = ascending("stamps", stamps if stamps is not None else getattr(trajectory, "stamps", None), len(T))
    frames = getattr(trajectory, "frames", None)
    format = choice("format", format or ("kitti" if stamps is None else "tum"), ("tum", "kitti"))
    if format == "tum":
        if stamps is None:
            raise Error(f"stamps: expected {len(T)} numbers with format tum, got none")
        _refuse("stamps", f"seconds within {_LARGEST_STAMP_S:g} of 0", stamps, abs(stamps) > _LARGEST_STAMP_S)
        rows = numpy.column_stack([stamps, T[:, :3, 3], _quaternions(T[:, :3, :3])])
    else:
        rows = T[:, :3].reshape(-1, 12)
    lines = [" ".join(map(repr, row)) + "\n" for row in rows.tolist()]
    if format == "kitti" and frames is not None and (frames != numpy.arange(len(T))).any():
        lines = [f"{frame} {line}" for frame, line in zip(frames, lines)]
    _write(pathlib.Path(path("file", file)), lines)


def _write(file, lines):
    """Writes a file under a temporary name and renames it; a symbolic link stays, and its target is written."""
    target = pathlib.Path(os.path.realpath(file))
    partial = target.with_name(f".{uuid.uuid4().hex}")
    try:
        if target.exists() and not target.is_file():
            raise Error(f"{file}: cannot be written: it is not a regular file")
        try:
            with open(partial, "x", encoding="ascii") as out:
                out.writelines(lines)
            os.replace(partial, target)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise Error(f"{file}: cannot be written: {error.strerror}") from None


@dataclasses.dataclass(frozen=True)
class ErrorStatistics:
    """Statistics of errors; std has n in the denominator, like numpy's; sse is the sum of squares."""
    rmse: float
    mean: float
    median: float
    std: float
    min: float
    max: float
    sse: float


def measured(relation, unit, delta, align):
    """Returns a short text about what errors are: "RPE trans_part [m] over 10m, align se3"."""
    return (f"{'APE' if delta is None else 'RPE'} {relation}{f' [{unit}]' if unit else ''}{f' over {delta}' if delta else ''}, "
            f"align {align}")


def statistics_table(title, unit, columns):
    """Returns the titles and rows of a table of ErrorStatistics by column; None: there are no errors."""
    rows = [[f"sse [{unit}^2]" if field.name == "sse" and unit else field.name,
             *("" if found is None else f"{getattr(found, field.name):.6g}" for found in columns.values())]
            for field in dataclasses.fields(ErrorStatistics)]
    return [title, *columns], rows


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class Alignment(Shown):
    poses: numpy.ndarray  #: the aligned estimate
    transform: numpy.ndarray  #: [s R | t; 0 0 0 1], reference from estimate
    scale: float
    flatness: float  #: near 0 if the positions lie on a line: the rotation about the line is then arbitrary


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class RelativeErrors(Shown):
    errors: numpy.ndarray
    pairs: numpy.ndarray  #: (n, 2): error k is the one between the poses pairs[k]


@dataclasses.dataclass(frozen=True)
class KittiError:
    """Errors over segments of one length, or of all lengths (length_m 0); None if the path is shorter than the segments."""
    length_m: float
    n: int
    translation_percent: typing.Optional[float]
    rotation_deg_per_m: typing.Optional[float]


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class TrajectoryErrors(Shown):
    """Errors of a path, pose by pose or pair by pair, with the poses behind them."""
    errors: numpy.ndarray  #: (n,)
    statistics: ErrorStatistics
    relation: str
    unit: str
    pairs: typing.Optional[numpy.ndarray]  #: (n, 2): the poses of error k; None: error k belongs to pose k
    estimate: numpy.ndarray = dataclasses.field(repr=False)  #: (m, 4, 4), associated and aligned
    reference: numpy.ndarray = dataclasses.field(repr=False)  #: (m, 4, 4)
    warnings: typing.List[str] = dataclasses.field(default_factory=list)  #: those of `sextant evaluate ego` (docs/evaluate.md)
    delta: typing.Optional[str] = None  #: the distance of the pairs (RPE); None: errors of poses (APE)
    align: str = "none"

    @property
    def measured(self):
        """What was measured: "APE trans_part [m], align se3", or "RPE trans_part [m] over 10m, align none"."""
        return measured(self.relation, self.unit, self.delta, self.align)

    def _shown(self):
        shown = [("rmse", f"{self.statistics.rmse:.6g} {self.unit}".strip()), ("errors", str(len(self.errors))),
                 ("measured", self.measured)]
        return shown + [("warnings", str(len(self.warnings)))] * bool(self.warnings)

    def _table(self):
        return statistics_table(self.measured, self.unit, {"": self.statistics})

    _n_axes = 2

    def plot(self, ax=None):
        """Draws both paths in bird's eye view, the estimate coloured by its error, and the errors along it.

        `ax`: two axes to draw on. Returns the axes.

        >>> truth = numpy.tile(numpy.eye(4), (4, 1, 1))
        >>> truth[:, 2, 3] = range(4)
        >>> len(sextant.evaluate_trajectory(truth, truth).plot())
        2
        """
        map_axes, along = axes_of(ax, 2, (11, 4))
        at = self.pairs[:, 1] if self.pairs is not None else numpy.arange(len(self.errors))
        Trajectory(self.reference).plot(map_axes, color="0.6", label="reference")
        points = self.estimate[at][:, :3, 3]
        dots = map_axes.scatter(points[:, 0], points[:, 2], c=self.errors, s=6, cmap="viridis", label="estimate", zorder=2)
        label = f"{'APE' if self.delta is None else 'RPE'} {self.relation}{f' [{self.unit}]' if self.unit else ''}"
        map_axes.figure.colorbar(dots, ax=map_axes, label=label)
        map_axes.legend()
        along.set_title(self.measured, fontsize="medium")
        along.plot(at, self.errors)
        along.axhline(self.statistics.rmse, color="0.4", linestyle="--", label=f"rmse {self.statistics.rmse:.4g}")
        along.set_xlabel("pose")
        along.set_ylabel(label)
        along.legend()
        return numpy.array([map_axes, along])


def statistics(errors) -> ErrorStatistics:
    """Returns the statistics of errors (n,).

    >>> sextant.statistics([3.0, 4.0]).mean
    3.5
    """
    return ErrorStatistics(*_core.statistics(floats("errors", errors)))


@arguments_named
def align(estimate, reference, method="se3", *, n_to_align=0, up=None) -> Alignment:
    """Aligns the estimate with the reference: none, origin, se3, sim3, scale or yaw (about `up`), from the first n_to_align
    poses (0: all).

    >>> path = numpy.tile(numpy.eye(4), (3, 1, 1))
    >>> path[:, :3, 3] = [[0, 0, 0], [1, 0, 0], [1, 0, 2]]
    >>> moved = path.copy()
    >>> moved[:, 0, 3] += 5
    >>> sextant.align(path, moved).transform[0, 3].round(9)
    5.0
    """
    return _aligned(estimate, reference, method, n_to_align, up)


def _aligned(estimate, reference, method, n_to_align, up):
    """As align(), with the Errors of the program, whose flags each caller replaces by arguments of its own."""
    _check_pairs(estimate, reference)
    if method == "origin":
        check_rotations("align='origin'", estimate, reference)
    return Alignment(*_core.align(poses("estimate", estimate), poses("reference", reference), text("method", method),
                                  _first_n(n_to_align, method), _upward(up, method)))


def _first_n(n_to_align, method):
    """Returns the number of poses that the alignment is estimated from; 0: all."""
    n = whole("n_to_align", n_to_align, 0, 2**31 - 1)
    if n > 0 and method in ("none", "origin"):
        raise Error(f"n_to_align: the alignment '{method}' is not estimated from several poses: use se3, sim3, scale or yaw")
    return n


def _upward(up, method):
    """Returns the upward direction for align="yaw", otherwise None."""
    if (method == "yaw") != (up is not None):
        raise Error("up: expected a direction if align='yaw', otherwise None: it is the upward direction in the worlds of both "
                    "paths, (0, 0, 1) if z points up")
    if up is None:
        return None
    direction = numbers("up", up, 3)
    if numpy.linalg.norm(direction) < 1e-6:
        raise Error(f"up: expected a direction, got a vector of length {numpy.linalg.norm(direction):g}")
    return direction


def check_rotations(need, *paths):
    """Raises an Error if a path has positions only, whose rotations are identities in the array of poses."""
    if not all(getattr(path, "has_rotations", True) for path in paths):
        raise Error(f"{need} needs rotations, but a path has positions only: for these use the relations trans_part "
                    "(of poses) or point_distance, the alignments se3, sim3 or yaw, and pairs by frames, m or s")


def _check_pairs(estimate, reference):
    """Raises an Error if the stamps or, without these, the frame numbers of two paths show that poses of equal index do not belong
    together. Stamps may differ by the default of associate() and by less than half of the smallest step."""
    for name in ("stamps", "frames"):
        given, expected = getattr(estimate, name, None), getattr(reference, name, None)
        if given is None or expected is None:
            continue
        if len(given) == len(expected):
            steps = numpy.concatenate([numpy.diff(given), numpy.diff(expected)])
            largest = min(_core.default_max_difference, 0.5 * steps.min()) if name == "stamps" and len(steps) else 0.0
            differ = numpy.flatnonzero(abs(given - expected) > largest)
            if len(differ) == 0:
                return
            what = f"{name} {given[differ[0]]:.17g} and {expected[differ[0]]:.17g} at [{differ[0]}]"
        else:
            what = f"{len(given)} and {len(expected)} {name}"
        raise Error(f"estimate and reference: expected paths whose poses belong together by index, got {what}: "
                    "evaluate_trajectory() pairs poses by stamps or frames, associate() finds the pairs of poses with equal stamps")


@arguments_named
def absolute_errors(estimate, reference, *, relation="trans_part", align="none", n_to_align=0, up=None):
    """Returns one error per pose (ATE, evo's APE): trans_part [m], rot_part, angle_deg, angle_rad, full, point_distance [m].

    >>> path = numpy.tile(numpy.eye(4), (2, 1, 1))
    >>> off = path.copy()
    >>> off[1, 0, 3] = 0.25
    >>> sextant.absolute_errors(off, path)
    array([0.  , 0.25])
    """
    if _core.needs_rotations(text("relation", relation), False):
        check_rotations(f"relation='{relation}'", estimate, reference)
    estimate = _aligned(estimate, reference, align, n_to_align, up).poses
    return _core.absolute_errors(estimate, poses("reference", reference), relation)


@arguments_named
def relative_errors(estimate, reference, *, delta="1f", all_pairs=False, relation="trans_part", tolerance=_core.default_tolerance,
                    pairs_from_reference=False, stamps=None, align="none", n_to_align=0, up=None) -> RelativeErrors:
    """Returns one error per pair of poses (RPE) at the distance `delta`: 1f (frames), 10m, 5deg, 0.5rad, 2s (with `stamps`).

    >>> path = numpy.tile(numpy.eye(4), (3, 1, 1))
    >>> off = path.copy()
    >>> off[1:, 0, 3] = 0.25
    >>> sextant.relative_errors(off, path).errors
    array([0.25, 0.  ])
    """
    if _core.needs_rotations(text("relation", relation), True):
        check_rotations(f"relation='{relation}' of pairs", estimate, reference)
    tolerance, all_pairs = number("tolerance", tolerance, low=0, high=1), switch("all_pairs", all_pairs)
    pairs_from_reference = switch("pairs_from_reference", pairs_from_reference)
    if text("delta", delta).endswith(("deg", "rad")):
        check_rotations(f"delta='{delta}'", reference if pairs_from_reference else estimate)
    stamps = getattr(estimate, "stamps", None) if stamps is None else stamps
    if tolerance != _core.default_tolerance and (not all_pairs or delta.endswith("f")):
        raise Error("tolerance: selects among all pairs by m, deg, rad or s, so all_pairs=True and such a delta are needed too")
    estimate = _aligned(estimate, reference, align, n_to_align, up).poses
    return RelativeErrors(*_core.relative_errors(estimate, poses("reference", reference), delta, all_pairs,
                                                 tolerance, pairs_from_reference, relation, floats("stamps", stamps)))


@arguments_named
def evaluate_trajectory(estimate, reference, *, align="none", relation="trans_part", delta=None, all_pairs=False,
                        max_difference=_core.default_max_difference, offset=0.0, n_to_align=0, up=None,
                        max_speed=100.0) -> TrajectoryErrors:
    """Returns the errors and warnings of `sextant evaluate ego` for one path, by the same code: poses are associated by their
    stamps if both paths have some, else by frame numbers, else one by one, and what it refuses raises an Error. `delta` (1f, 10m,
    ...) gives errors of pairs (RPE) instead of poses.

    >>> truth = numpy.tile(numpy.eye(4), (4, 1, 1))
    >>> truth[:, 2, 3] = range(4)
    >>> sextant.evaluate_trajectory(truth, truth)
    TrajectoryErrors(rmse: 0 m, errors: 4, measured: APE trans_part [m], align none, warnings: 1)
    """
    from . import _files
    if switch("all_pairs", all_pairs) and delta is None:
        raise Error("all_pairs: selects pairs of relative errors, so delta is needed too, such as delta='1f'")
    offset, max_difference = number("offset", offset), number("max_difference", max_difference, low=0)
    stamped = all(getattr(given, "stamps", None) is not None for given in (estimate, reference))
    for name, is_given in (("offset", offset != 0), ("max_difference", max_difference != _core.default_max_difference)):
        if is_given and not stamped:
            raise Error(f"{name}: needs time stamps in both estimate and reference")
    series = [(poses(name, given), getattr(given, "stamps", None), getattr(given, "frames", None),
               getattr(given, "has_rotations", True)) for name, given in (("estimate", estimate), ("reference", reference))]
    errors, pairs, a, b, warnings = _files.evaluate(
        *series, text("align", align),
        _first_n(n_to_align, align), _upward(up, align), text("relation", relation),
        optional(text, "delta", delta), all_pairs, max_difference, offset,
        number("max_speed", max_speed, above=0))
    return TrajectoryErrors(errors, statistics(errors), relation, _core.unit_of(relation), pairs, a, b,
                            [*getattr(estimate, "warnings", []), *getattr(reference, "warnings", []), *warnings], delta, align)


@arguments_named
def kitti_odometry(estimate, reference) -> typing.List[KittiError]:
    """Returns the errors of the KITTI odometry benchmark: all lengths together first, then 100 to 800 m.

    >>> path = numpy.tile(numpy.eye(4), (300, 1, 1))
    >>> path[:, 2, 3] = range(300)
    >>> sextant.kitti_odometry(path, path)[0].translation_percent
    0.0
    """
    check_rotations("kitti_odometry", estimate, reference)
    _check_pairs(estimate, reference)
    return [KittiError(*row) for row in _core.kitti_odometry(poses("estimate", estimate), poses("reference", reference))]


def associate(reference_stamps, estimate_stamps, *, max_difference=_core.default_max_difference, offset=0.0):
    """Returns indices (of the reference, of the estimate) of poses that correspond by time, as in evo; stamps in s,
    ascending, `offset` added to those of the estimate.

    >>> sextant.associate([0.0, 0.1, 0.2], [0.101, 0.199])
    (array([1, 2]...), array([0, 1]...))
    """
    return _core.associate(floats("reference_stamps", reference_stamps), floats("estimate_stamps", estimate_stamps),
                           number("max_difference", max_difference, low=0), number("offset", offset))
