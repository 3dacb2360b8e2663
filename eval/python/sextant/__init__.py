"""Sextant: how well is the motion of the camera and of every moving object estimated?

Files                  read_trajectory, write_trajectory, read_flow, read_depth
Errors of paths        evaluate_trajectory, absolute_errors, relative_errors, align, statistics, kitti_odometry, associate
Noise on arrays        Noise, Camera
Errors of motions      pose_change_errors, object_errors
Cramér-Rao              motion_bound
Records as a table     read
The program            run, sweep, compare, evaluate_ego, evaluate_objects, export
Estimators in Python   Problem, Estimate; given to run and sweep

Poses are arrays (n, 4, 4), T_world_camera, camera axes x right, y down, z forward; metres, pixels, seconds. Arguments may be
lists, or arrays of any numeric type. The message of an Error names the argument, what was expected and what was got. Results have
a short repr, a table and a picture in a notebook, and .plot() where there is something to draw. docs/python.md has examples.
"""

from ._core import Error, InternalError, git_commit, version
from .command import (Comparison, EgoEvaluation, Export, Finding, ObjectEvaluation, ProgramError, Row, Run, Sweep, compare,
                      evaluate_ego, evaluate_objects, export, program, run, sweep)
from .estimators import Estimate, Problem
from .images import read_depth, read_flow
from .motions import Bound, motion_bound, nees, object_errors, pose_change_errors
from .noise import Camera, Noise, NoisyFrame
from .records import read
from .trajectories import (Alignment, ErrorStatistics, KittiError, RelativeErrors, Trajectory, TrajectoryErrors,
                           absolute_errors, align, associate, evaluate_trajectory, kitti_odometry, read_trajectory,
                           relative_errors, statistics, write_trajectory)

__version__ = version()
Error.__doc__ = "A ValueError for unsuitable input. Its message says what was found, what was expected and what to do."
InternalError.__doc__ = "A defect of the package: please report it."

__all__ = [
    "Alignment", "Bound", "Camera", "Comparison", "EgoEvaluation", "Error", "ErrorStatistics", "Estimate", "Export",
    "Finding", "InternalError", "KittiError", "Noise", "NoisyFrame", "ObjectEvaluation", "Problem", "ProgramError",
    "RelativeErrors", "Row", "Run", "Sweep", "Trajectory", "TrajectoryErrors", "absolute_errors", "align",
    "associate", "compare", "evaluate_ego", "evaluate_objects", "evaluate_trajectory", "export", "git_commit",
    "kitti_odometry", "motion_bound", "nees", "object_errors", "pose_change_errors", "program", "read", "read_depth",
    "read_flow", "read_trajectory", "relative_errors", "run", "statistics", "sweep", "version", "write_trajectory",
]
