#!/usr/bin/env python3
"""Second opinion on `sextant evaluate ego`: the definitions of docs/metrics.md in numpy, on made-up recordings.

usage: evaluate_ego_oracle.py PROGRAM

Writes KITTI, TUM and EuRoC pairs (long, few poses, partly standing still, swapped), evaluates each with every
relation, alignment and selection of pairs, and compares every statistic with its own to 1e-6. Exit codes: 0 all
agree, 1 not, 77 numpy is missing (the test is skipped).
"""

import itertools
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed for this python (Debian: python3-numpy)")
    sys.exit(77)

RELATIONS = ["trans_part", "rot_part", "angle_deg", "angle_rad", "full", "point_distance"]  # of APE and RPE
RATIO = "point_distance_error_ratio"  # of RPE
ALIGNMENTS = ["none", "origin", "se3", "sim3", "scale"]


def rotations(quaternions):
    """Of x y z w rows."""
    x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=1)[:, None]).T
    return np.stack([np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], 1),
                     np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], 1),
                     np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], 1)], 1)


def poses(R, p):
    T = np.tile(np.eye(4), (len(p), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = R, p
    return T


def inverse(T):
    """With the transpose for the rotation, also where a file's rounding leaves it off orthonormal."""
    out = np.tile(np.eye(4), (len(T), 1, 1))
    Rt = np.transpose(T[:, :3, :3], (0, 2, 1))
    out[:, :3, :3], out[:, :3, 3] = Rt, -np.einsum("nij,nj->ni", Rt, T[:, :3, 3])
    return out


def angle(R):
    """Axis from the skew part, cosine from the trace."""
    s = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], 1)
    return np.arctan2(np.linalg.norm(s, axis=1), np.trace(R, axis1=1, axis2=2) - 1)


def similarity(x, y, with_scale):
    """Umeyama by the polar decomposition of the correlation, through an eigenproblem (Horn 1988)."""
    mx, my = x.mean(0), y.mean(0)
    M = (x - mx).T @ (y - my)
    (a, b, c), (d, e, f), (g, h, i) = M
    N = np.array([[a + e + i, f - h, g - c, b - d], [f - h, a - e - i, b + d, g + c],
                  [g - c, b + d, e - a - i, f + h], [b - d, g + c, f + h, i - a - e]])
    w, q0, q1, q2 = np.linalg.eigh(N)[1][:, -1]
    R = rotations(np.array([[q0, q1, q2, w]]))[0]
    s = np.trace(R @ M) / ((x - mx) ** 2).sum() if with_scale else 1.0
    return R, my - s * R @ mx, s


def align(est, ref, how, n):
    est = est.copy()
    if how == "origin":
        return (ref[0] @ inverse(est[:1])[0]) @ est
    if how == "none":
        return est
    n = n or len(est)
    R, t, s = similarity(est[:n, :3, 3], ref[:n, :3, 3], how != "se3")
    est[:, :3, 3] *= s
    if how != "scale":
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = R, t
        est = T @ est
    return est


def values(E, relation):
    if relation == "trans_part":
        return np.linalg.norm(E[:, :3, 3], axis=1)
    if relation == "rot_part":
        return np.linalg.norm(E[:, :3, :3] - np.eye(3), axis=(1, 2))
    if relation == "full":
        return np.linalg.norm(E - np.eye(4), axis=(1, 2))
    radians = angle(E[:, :3, :3])
    return np.degrees(radians) if relation == "angle_deg" else radians


def ape(est, ref, relation):
    if relation in ("trans_part", "point_distance"):
        return np.linalg.norm(est[:, :3, 3] - ref[:, :3, 3], axis=1)
    return values(inverse(est) @ ref, relation)


def pairs_of(T, stamps, delta, unit, everything, tolerance=0.1):
    n = len(T)
    step = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    if unit == "f":
        d = int(delta)
        return [(i, i + d) for i in range(0, n - d, 1 if everything else d)]
    if unit in ("deg", "rad"):
        delta = np.radians(delta) if unit == "deg" else delta
        if everything:
            out = []
            for i in range(n - 1):
                a = angle(np.transpose(T[i, :3, :3]) @ T[i + 1:, :3, :3])
                out += [(i, i + 1 + j) for j in np.flatnonzero(np.abs(a - delta) <= tolerance * delta)]
            return out
        steps = angle(np.transpose(T[:-1, :3, :3], (0, 2, 1)) @ T[1:, :3, :3])
        out, begin, total = [], 0, 0.0
        for i, a in enumerate(steps):
            total += a
            if total >= delta:
                out.append((begin, i + 1))
                begin, total = i + 1, 0.0
        return out
    along = np.concatenate([[0], np.cumsum(step)]) if unit == "m" else stamps
    if everything:
        out = []
        for i in range(n - 1):
            off = np.abs(along[i + 1:] - along[i] - delta)
            j = int(np.argmin(off))
            if off[j] <= tolerance * delta:
                out.append((i, i + 1 + j))
        return out
    if unit == "s":
        out, begin = [], 0
        for i in range(1, n):
            if along[i] - along[begin] >= delta - 1e-6:
                out.append((begin, i))
                begin = i
        return out
    ids, total = [], 0.0
    for i in range(n):
        total += step[i - 1] if i else 0.0
        if total >= delta:
            ids.append(i)
            total = 0.0
    return list(zip(ids, ids[1:]))


def rpe(est, ref, pairs, relation):
    i, j = np.array(pairs).T
    if relation in ("point_distance", RATIO):
        length = lambda T: np.linalg.norm(T[i, :3, 3] - T[j, :3, 3], axis=1)
        off, moves = np.abs(length(ref) - length(est)), length(ref) != 0
        return off if relation == "point_distance" else 100 * off[moves] / length(ref)[moves]
    return values(inverse(inverse(ref[i]) @ ref[j]) @ (inverse(est[i]) @ est[j]), relation)


def statistics(e):
    return {"rmse": np.sqrt(np.mean(e**2)), "mean": e.mean(), "median": np.median(e), "std": e.std(),
            "min": e.min(), "max": e.max(), "sse": (e**2).sum()}


def match(ref_stamps, est_stamps, max_difference, offset):
    """Nearest stamp of the longer recording for each of the shorter."""
    swap = len(est_stamps) > len(ref_stamps)
    short, long = (ref_stamps, est_stamps + offset) if swap else (est_stamps, ref_stamps - offset)
    found = [(i, int(np.argmin(np.abs(long - t)))) for i, t in enumerate(short)]
    found = [(i, j) for i, j in found if abs(long[j] - short[i]) <= max_difference]
    a, b = np.array(found).T
    return (a, b) if swap else (b, a)


# ---- recordings


def recording(n, seed, stop=None):
    """Quaternions and positions of a drive and of a noisy, drifting estimate of it; `stop`: standing still there."""
    g = np.random.default_rng(seed)
    k = np.arange(n)
    speed = 0.8 + 0.3 * np.sin(k / 55)
    rate = 0.02 * np.sin(k / 40) + g.normal(0, 0.002, n)
    if stop is not None:
        speed[stop], rate[stop] = 0, 0
    yaw, pitch = np.cumsum(rate), 0.05 * np.sin(np.cumsum(speed) / 90)
    q = np.stack([np.sin(pitch / 2) * np.cos(yaw / 2), np.cos(pitch / 2) * np.sin(yaw / 2),
                  -np.sin(pitch / 2) * np.sin(yaw / 2), np.cos(pitch / 2) * np.cos(yaw / 2)], 1)
    p = np.cumsum(np.stack([speed * np.sin(yaw), 0.1 * speed * np.sin(k / 30), speed * np.cos(yaw)], 1), 0)
    return q, p, q + g.normal(0, 0.003, (n, 4)), 1.05 * p + np.cumsum(g.normal(0, 0.01, (n, 3)), 0) + [3, -2, 9]


class Case:
    def __init__(self, folder, name, format, n, stop=None, swapped=False, offset=0.0):
        q, p, qe, pe = recording(n, 7 + n, stop)
        self.format, self.options, self.stamps = format, [], None
        self.files = [str(folder / f"{name}_{side}.txt") for side in ("a", "b")]
        if format == "kitti":
            for file, (Q, P), digits in zip(self.files, ((q, p), (qe, pe)), ("%.6e", "%.9f")):
                np.savetxt(file, poses(rotations(Q), P)[:, :3].reshape(n, 12), fmt=digits)
            a, b = (poses(M[:, :, :3], M[:, :, 3]) for M in (np.loadtxt(f).reshape(-1, 3, 4) for f in self.files))
            if swapped:
                self.files, a, b = self.files[::-1], b, a
        else:
            g = np.random.default_rng(n)
            t = 1403636579.0 + 0.05 * np.arange(n)
            te = (t + g.uniform(-0.008, 0.008, n) - offset)[::2]
            qe, pe = (qe / np.linalg.norm(qe, axis=1)[:, None])[::2], pe[::2]
            np.savetxt(self.files[1], np.column_stack([te, pe, qe]), fmt="%.9f")
            if format == "tum":
                np.savetxt(self.files[0], np.column_stack([t, p, q]), fmt="%.7f", header="t tx ty tz qx qy qz qw")
                read = np.loadtxt(self.files[0])
            else:
                ns = np.round(t * 1e9).astype(np.int64)
                rows = [f"{s},{','.join('%.9f' % v for v in (*pos, qq[3], *qq[:3], *np.zeros(9)))}"
                        for s, pos, qq in zip(ns, p, q)]
                pathlib.Path(self.files[0]).write_text("#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z\n" + "\n".join(rows))
                read = np.loadtxt(self.files[0], delimiter=",")
                read = np.column_stack([read[:, 0] / 1e9, read[:, 1:4], read[:, 5:8], read[:, 4]])
            other = np.loadtxt(self.files[1])
            if swapped:
                self.files, read, other = self.files[::-1], other, read
            i, j = match(read[:, 0], other[:, 0], 0.01, offset)
            a = poses(rotations(read[i, 4:]), read[i, 1:4])
            b = poses(rotations(other[j, 4:]), other[j, 1:4])
            self.stamps = other[j, 0]
            self.options = ["--offset", repr(offset)] if offset else []
        self.ref, self.est = a, b


def check(program, case, name, relation, how, n_to_align, delta):
    arguments = [program, "evaluate", "ego", "--format", case.format, *case.files, "--relation", relation, "--align", how,
                 "--json", *case.options]
    if n_to_align:
        arguments += ["--n-to-align", str(n_to_align)]
    est = align(case.est, case.ref, how, n_to_align)
    if delta is None:
        expected = ape(est, case.ref, relation)
    else:
        size, unit, everything = delta
        arguments += ["--rpe", f"{size}{unit}"] + (["--all-pairs"] if everything else [])
        expected = rpe(est, case.ref, pairs_of(est, case.stamps, size, unit, everything), relation)
    run = subprocess.run(arguments, capture_output=True, text=True)
    if run.returncode != 0:
        return [f"{name}: {' '.join(arguments)}: exit code {run.returncode}: {run.stderr.strip()}"]
    result = json.loads(run.stdout)
    problems = []
    if result["n"] != len(expected):
        problems.append(f"n {result['n']}, expected {len(expected)}")
    for key, value in statistics(expected).items():
        got = result["stats"][key]
        # Where nothing moves both are rounding noise.
        if not abs(got - value) <= 1e-6 * abs(value) + 1e-12:
            problems.append(f"{key} {got!r}, expected {value!r}")
    return [f"{name}: {' '.join(arguments)}: {p}" for p in problems]


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    program = sys.argv[1]
    problems, n_checks = [], 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        cases = {
            "kitti": Case(folder, "kitti", "kitti", 1200),
            "kitti, swapped": Case(folder, "kitti_swapped", "kitti", 400, swapped=True),
            "kitti, standing": Case(folder, "kitti_standing", "kitti", 500, stop=slice(100, 260)),
            "kitti, few": Case(folder, "kitti_few", "kitti", 5),
            "tum": Case(folder, "tum", "tum", 2000),
            "tum, swapped": Case(folder, "tum_swapped", "tum", 600, swapped=True),
            "tum, offset": Case(folder, "tum_offset", "tum", 600, offset=0.35),
            "euroc": Case(folder, "euroc", "euroc", 1500),
        }
        for name, case in cases.items():
            work = [(r, a, 0, None) for r, a in itertools.product(RELATIONS, ALIGNMENTS)]
            work += [("trans_part", a, min(60, len(case.est) - 1), None) for a in ("se3", "sim3", "scale")]
            work += [(r, "sim3", 0, (1, "f", False)) for r in [*RELATIONS, RATIO]]
            if len(case.est) > 10:
                work += [(r, "se3", 0, (7, "f", True)) for r in RELATIONS]
                work += [(r, "none", 0, d) for r in ("trans_part", "angle_deg")
                         for d in ((10, "m", False), (10, "m", True), (5, "deg", False), (0.1, "rad", False))]
                work += [("full", "scale", 0, (20, "deg", True)), ("point_distance", "sim3", 0, (25, "m", True)),
                         (RATIO, "none", 0, (10, "m", False)), (RATIO, "se3", 0, (3, "f", True))]
            if case.stamps is not None:
                work += [("trans_part", "none", 0, (2, "s", e)) for e in (False, True)]
            for relation, how, n_to_align, delta in work:
                problems += check(program, case, name, relation, how, n_to_align, delta)
                n_checks += 1
    for problem in problems[:20]:
        print(problem)
    print(f"{n_checks} evaluations, {len(problems)} disagreements")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
