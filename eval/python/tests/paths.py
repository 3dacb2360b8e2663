"""Paths and logs for the tests, made up."""

import numpy


def rotation(vector):
    """Returns the rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = numpy.linalg.norm(vector)
    if angle < 1e-12:
        return numpy.eye(3)
    x, y, z = vector / angle
    K = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * K @ K


def motion(turn, step):
    T = numpy.eye(4)
    T[:3, :3], T[:3, 3] = rotation(numpy.asarray(turn, float)), step
    return T


def path(n=300, seed=1, noise=0.0):
    """Returns a car's drive, T_world_camera. `noise` adds drift; the turns without it depend on `seed` alone."""
    turns, drift = numpy.random.default_rng(seed), numpy.random.default_rng(seed + 1000)
    poses = [numpy.eye(4)]
    yaw = 0.0
    for _ in range(n - 1):
        yaw = 0.97 * yaw + 0.004 * turns.normal()
        turn, step = numpy.array([0.002 * turns.normal(), yaw, 0]), numpy.array([0, 0.01 * turns.normal(), 1.2])
        turn = turn + noise * 0.01 * drift.normal(size=3)
        step = step * (1 + noise * 0.02) + noise * 0.05 * drift.normal(size=3)
        poses.append(poses[-1] @ motion(turn, step))
    return numpy.array(poses)


def quaternion(R):
    """Returns the quaternion x, y, z, w of a rotation matrix."""
    w = numpy.sqrt(max(0, 1 + numpy.trace(R))) / 2
    return numpy.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], 4 * w * w]) / (4 * w)


def write_kitti(file, poses):
    file.write_text("".join(" ".join(repr(float(x)) for x in pose[:3].ravel()) + "\n" for pose in poses))


def read_kitti(file):
    rows = numpy.loadtxt(file).reshape(-1, 3, 4)
    return numpy.concatenate([rows, numpy.tile([[[0.0, 0, 0, 1]]], (len(rows), 1, 1))], axis=1)
