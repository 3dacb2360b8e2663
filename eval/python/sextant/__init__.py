"""Sextant: how well is the motion of the camera and of every moving object estimated?

Noise on arrays        Noise, Camera
Errors of paths        absolute_errors, relative_errors, align, statistics, kitti_odometry, associate
Errors of motions      pose_change_errors, object_errors
The limit              motion_bound
Records as a table     read
The program            run, sweep, compare, evaluate_ego, evaluate_objects, export
Estimators in Python   Problem, Estimate; given to run and sweep

Poses are float64 arrays (n, 4, 4), T_world_camera, camera axes x right, y down, z forward; metres, pixels, seconds. What an
argument must be is checked and never converted: Error names the argument, what was expected and what was got.
docs/python.md has examples.
"""

from ._core import Error, InternalError, git_commit, version
from .command import (Comparison, EgoEvaluation, Export, Finding, ObjectEvaluation, ProgramError, Row, Run, Sweep, compare,
                      evaluate_ego, evaluate_objects, export, program, run, sweep)
from .estimators import Estimate, Problem
from .motions import Bound, motion_bound, nees, object_errors, pose_change_errors
from .noise import Camera, Noise, NoisyFrame
from .records import read
from .trajectories import (Alignment, ErrorStatistics, KittiError, RelativeErrors, absolute_errors, align, associate,
                           kitti_odometry, relative_errors, statistics)

__version__ = version()

__all__ = [
    "Alignment", "Bound", "Camera", "Comparison", "EgoEvaluation", "Error", "ErrorStatistics", "Estimate", "Export", "Finding",
    "InternalError", "KittiError", "Noise", "NoisyFrame", "ObjectEvaluation", "Problem", "ProgramError", "RelativeErrors", "Row",
    "Run", "Sweep", "absolute_errors", "align", "associate", "compare", "evaluate_ego", "evaluate_objects", "export",
    "git_commit", "kitti_odometry", "motion_bound", "nees", "object_errors", "pose_change_errors", "program", "read",
    "relative_errors", "run", "statistics", "sweep", "version",
]
