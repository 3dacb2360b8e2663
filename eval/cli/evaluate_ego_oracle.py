#!/usr/bin/env python3
"""Second opinion on `sextant evaluate ego`: the definitions of docs/metrics.md in numpy, on made-up recordings.

usage: evaluate_ego_oracle.py PROGRAM

Writes KITTI, TUM and EuRoC pairs (long, few poses, partly standing still, swapped), evaluates each with every
relation, alignment and selection of pairs, and compares every statistic with its own to 1e-6; then pairs in other
axes, of a body beside the camera, at other instants and with another clock, for the flags that undo that, with the
estimated time offset and its interval. Exit codes: 0 all
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
    """Rotation matrices of rows x y z w."""
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


# ---- frames and clocks

AXES = {"opencv": np.eye(3), "opengl": np.diag([1.0, -1, -1]),  # rows: right, down, forward
        "ned": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), "flu": np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])}


def camera_poses(T, axes, body_from_camera):
    """C T_world_body T_body_camera; 3 values are a position, and the rotation is then C^-1."""
    C, B = np.eye(4), np.eye(4)
    C[:3, :3] = AXES[axes]
    B[:3, :3] = AXES[axes].T
    if body_from_camera is not None:
        if len(body_from_camera) == 3:
            B[:3, 3] = body_from_camera
        else:
            B[:3] = np.reshape(body_from_camera, (-1, 4))[:3]
    return C @ T @ B


def yaw(est, ref, up, n):
    """By complex numbers: positions across `up` as numbers a + bi, the best turn is the angle of sum conj(x) y."""
    n = n or len(est)
    up = np.asarray(up, float) / np.linalg.norm(up)
    a = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    a /= np.linalg.norm(a)
    b = np.cross(up, a)
    flat = lambda T: (T[:n, :3, 3] - T[:n, :3, 3].mean(0)) @ (a + 1j * b)
    angle_of_turn = np.angle(np.sum(np.conj(flat(est)) * flat(ref)))
    R = rotations(np.array([[*np.sin(angle_of_turn / 2) * up, np.cos(angle_of_turn / 2)]]))[0]
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, ref[:n, :3, 3].mean(0) - R @ est[:n, :3, 3].mean(0)
    return T @ est


def rotation_vector(R):
    s = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    n = np.linalg.norm(s)
    return s / n * np.arctan2(n, np.trace(R) - 1) if n > 0 else s


def exponential(v):
    """Rodrigues."""
    a = np.linalg.norm(v)
    if a == 0:
        return np.eye(3)
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]]) / a
    return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K


def interpolated(stamps, T, times, max_gap):
    """Poses at those `times` that lie at a stamp or in a gap of at most max_gap, and their indices."""
    out, kept = [], []
    for k, t in enumerate(times):
        j = int(np.searchsorted(stamps, t))
        if j < len(stamps) and stamps[j] == t:
            out.append(T[j])
        elif 0 < j < len(stamps) and stamps[j] - stamps[j - 1] <= max_gap:
            w = (t - stamps[j - 1]) / (stamps[j] - stamps[j - 1])
            pose = np.eye(4)
            pose[:3, 3] = (1 - w) * T[j - 1, :3, 3] + w * T[j, :3, 3]
            R = T[j - 1, :3, :3]
            pose[:3, :3] = R @ exponential(w * rotation_vector(R.T @ T[j, :3, :3]))
            out.append(pose)
        else:
            continue
        kept.append(k)
    return np.array(out), kept


class Clock:
    """eval/evaluation/trajectory_offset.h, with matrices of weights and numpy's correlation."""

    def __init__(self, ref_stamps, ref, est_stamps, est, initial):
        self.ref, self.est = self.rates(ref_stamps, ref), self.rates(est_stamps, est)
        self.width = max(np.sort(np.diff(s))[(len(s) - 1) // 2] for s in (ref_stamps, est_stamps))
        duration = min(ref_stamps[-1] - ref_stamps[0], est_stamps[-1] - est_stamps[0])
        steps = min(max(int(min(1.0, duration / 4) / self.width), 20), 200)
        self.reach, self.initial = steps * self.width, initial
        begin = max(self.est[0][0], self.ref[0][0] + self.reach - initial)
        end = min(self.est[0][-1], self.ref[0][-1] - self.reach - initial)
        self.n = min(int((end - begin) / self.width) + 1, 4000)
        self.times = begin + np.arange(self.n) * self.width
        self.signal = self.smooth(self.est, 0)

    @staticmethod
    def rates(stamps, T):
        h = np.diff(stamps)
        steps = inverse(T[:-1]) @ T[1:]
        return (stamps[1:] + stamps[:-1]) / 2, h, np.stack([np.linalg.norm(steps[:, :3, 3], axis=1) / h,
                                                            angle(steps[:, :3, :3]) / h], 1)

    def smooth(self, rates, shift):
        times, h, values = rates
        u = (times[None] - (self.times + shift)[:, None]) / self.width
        weights, near = np.zeros_like(u), np.abs(u) <= 5
        weights[near] = np.exp(-u[near] ** 2 / 2) * np.broadcast_to(h, u.shape)[near]
        return weights @ values / weights.sum(1)[:, None]

    def score(self, d, use=None):
        use = np.ones(self.n, bool) if use is None else use
        a, b = self.smooth(self.ref, d)[use], self.signal[use]
        rho = [np.clip(np.corrcoef(a[:, c], b[:, c])[0, 1], 0, 1 - 1e-12) for c in (0, 1)]
        return -0.5 * use.sum() * sum(np.log(1 - r * r) for r in rho)

    def peak(self, d, use=None):
        """Ternary search within half a width."""
        low, high = d - self.width / 2, d + self.width / 2
        while high - low > 1e-6 * self.width:
            a, b = low + (high - low) / 3, high - (high - low) / 3
            if self.score(a, use) > self.score(b, use):
                high = b
            else:
                low = a
        return (low + high) / 2

    def offset(self):
        grid = self.initial + self.width / 2 * np.arange(-round(2 * self.reach / self.width),
                                                        round(2 * self.reach / self.width) + 1)
        best = self.peak(grid[int(np.argmax([self.score(d) for d in grid]))])
        left_out = []
        for k in range(20):
            use = np.ones(self.n, bool)
            use[k * self.n // 20:(k + 1) * self.n // 20] = False
            left_out.append(self.peak(best, use))
        half = 2.0930240544 * np.sqrt(19 / 20 * np.sum((np.array(left_out) - np.mean(left_out)) ** 2))
        return best, best - half, best + half


def run_ego(program, arguments):
    run = subprocess.run([program, "evaluate", "ego", *arguments, "--json"], capture_output=True, text=True)
    return json.loads(run.stdout) if run.returncode == 0 else run.stderr.strip()


def compare(result, expected, extra=()):
    """Statistics to 1e-6 (where nothing moves both are rounding noise); `extra`: (what, got, expected, tolerance)."""
    problems = [] if result["n"] == len(expected) else [f"n {result['n']}, expected {len(expected)}"]
    for key, value in statistics(expected).items():
        if not abs(result["stats"][key] - value) <= 1e-6 * abs(value) + 1e-12:
            problems.append(f"{key} {result['stats'][key]!r}, expected {value!r}")
    return problems + [f"{what} {got!r}, expected {value!r}" for what, got, value, tolerance in extra
                       if not abs(got - value) <= tolerance]


def frame_checks(program, folder):
    """Every flag about frames and clocks, on files in TUM format; yields (name, problems)."""
    n = 700
    q, p, qe, pe = recording(n, 4711)
    t = 1500.0 + 0.1 * np.arange(n)
    te = (t + np.random.default_rng(5).uniform(0.01, 0.09, n))[:-1] + 0.0375  # of another clock
    truth = poses(rotations(q), p)
    between, _ = interpolated(t, truth, te - 0.0375, 1)
    noise = np.random.default_rng(6)
    est = between.copy()
    est[:, :3, 3] += noise.normal(0, 0.02, (n - 1, 3))
    files = {}
    gap = np.r_[0:300, 304:n]  # of the reference: 0.5 s without poses
    for name, stamps, T in (("ref", t[gap], truth[gap]), ("est", te, est)):
        # As quaternions, from the matrices by their largest eigenvector (Bar-Itzhack 2000).
        Q = []
        for M in T[:, :3, :3]:
            K = np.array([[M[0, 0] - M[1, 1] - M[2, 2], 0, 0, 0], [M[0, 1] + M[1, 0], M[1, 1] - M[0, 0] - M[2, 2], 0, 0],
                          [M[0, 2] + M[2, 0], M[1, 2] + M[2, 1], M[2, 2] - M[0, 0] - M[1, 1], 0],
                          [M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1], np.trace(M)]])
            Q.append(np.linalg.eigh(K)[1][:, -1])
        files[name] = str(folder / f"frames_{name}.tum")
        np.savetxt(files[name], np.column_stack([stamps, T[:, :3, 3], Q]), fmt="%.12f")
    read = {name: np.loadtxt(file) for name, file in files.items()}
    stamps = {name: values[:, 0] for name, values in read.items()}
    T = {name: poses(rotations(values[:, 4:]), values[:, 1:4]) for name, values in read.items()}
    both = [files["ref"], files["est"]]

    lever = [0.8, -0.5, 1.2]
    mounting = np.eye(4)
    mounting[:3, :3], mounting[:3, 3] = exponential(np.array([0.3, -1.1, 0.4])), [0.2, 1.5, -0.7]
    mounting_file = folder / "T_body_camera.txt"
    mounting_file.write_text("# T_body_camera\n" + "\n".join(" ".join("%.15f" % v for v in row) for row in mounting))
    mounting = np.loadtxt(mounting_file)
    texts = {None: None, "lever": (lever, "0.8,-0.5 1.2"), "file": (mounting.ravel(), str(mounting_file)),
             "12": (mounting[:3].ravel(), " ".join("%.17g" % v for v in mounting[:3].ravel()))}

    def checked(name, arguments, relation, expected, extra=lambda result: ()):
        result = run_ego(program, [*both, *arguments, "--relation", relation])
        if isinstance(result, str):
            return name, [f"{' '.join(arguments)}: {result}"]
        expected = expected(result) if callable(expected) else expected
        return name, [f"{' '.join(arguments)} {relation}: {p}" for p in compare(result, expected, extra(result))]

    i, j = match(stamps["ref"], stamps["est"], 0.05, 0)
    for axes, ref_axes, body, ref_body in [("ned", "opencv", None, None), ("opencv", "flu", None, None),
                                           ("opengl", "ned", "lever", None), ("opencv", "opencv", "lever", "file"),
                                           ("flu", "opengl", "file", "lever"), ("ned", "flu", "12", "12")]:
        arguments = ["--max-difference", "0.05", "--axes", axes, "--ref-axes", ref_axes]
        arguments += ["--body-from-camera", texts[body][1]] if body else []
        arguments += ["--ref-body-from-camera", texts[ref_body][1]] if ref_body else []
        a = camera_poses(T["ref"][i], ref_axes, texts[ref_body] and texts[ref_body][0])
        b = camera_poses(T["est"][j], axes, texts[body] and texts[body][0])
        for how in ALIGNMENTS:
            for relation in ("trans_part", "rot_part", "full"):
                yield checked("frames", [*arguments, "--align", how], relation, ape(align(b, a, how, 0), a, relation))
        for relation in RELATIONS:
            pairs = pairs_of(b, stamps["est"][j], 5, "f", True)
            yield checked("frames, rpe", [*arguments, "--rpe", "5f", "--all-pairs"], relation, rpe(b, a, pairs, relation))

    for up, text in (([0, 0, 1], "z"), ([0, -1, 0], "-y"), ([0.1, -2, 0.3], "0.1 -2 0.3")):
        for first in (0, 100):
            for relation in ("trans_part", "angle_deg", "full"):
                arguments = ["--max-difference", "0.05", "--align", "yaw", "--up", text] + (["--n-to-align", str(first)] if first else [])
                yield checked("yaw", arguments, relation, ape(yaw(T["est"][j], T["ref"][i], up, first), T["ref"][i], relation))

    for max_gap, offset in ((0.15, 0.0), (0.6, -0.0375), (0.15, 0.2)):
        a, kept = interpolated(stamps["ref"], T["ref"], stamps["est"] + offset, max_gap)
        b = T["est"][kept]
        arguments = ["--interpolate", repr(max_gap), "--offset", repr(offset)]
        left_out = lambda result: [("left out", sum(result["interpolation"][k] for k in ("n_outside", "n_in_longer_gaps")),
                                    len(T["est"]) - len(b), 0),
                                   ("largest gap", result["interpolation"]["largest_gap_s"], 0.5 if max_gap > 0.5 else 0.1, 1e-9)]
        for relation in RELATIONS:
            yield checked("interpolated", [*arguments, "--align", "se3"], relation, ape(align(b, a, "se3", 0), a, relation),
                          left_out)
        yield checked("interpolated", [*arguments, "--rpe", "1s", "--all-pairs"], "trans_part",
                      rpe(b, a, pairs_of(b, stamps["est"][kept], 1, "s", True), "trans_part"), left_out)

    for initial in (0.0, 0.3):
        offset, low, high = Clock(stamps["ref"], T["ref"], stamps["est"], T["est"], initial).offset()

        def errors(result):
            """At the offset that the program found: 1e-6 s are 1e-5 m here."""
            a, kept = interpolated(stamps["ref"], T["ref"], stamps["est"] + result["time_offset"]["offset_s"], 0.15)
            return ape(T["est"][kept], a, "trans_part")

        found = lambda result: [("offset", result["time_offset"]["offset_s"], offset, 1e-6),
                                ("low", result["time_offset"]["interval"][0], low, 1e-6),
                                ("high", result["time_offset"]["interval"][1], high, 1e-6),
                                ("planted", result["time_offset"]["offset_s"], -0.0375, 0.004)]
        yield checked("offset", ["--estimate-offset", "--interpolate", "0.15", "--offset", repr(initial)], "trans_part",
                      errors, found)


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
    return [f"{name}: {' '.join(arguments)}: {p}" for p in compare(json.loads(run.stdout), expected)]


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
        for name, found in frame_checks(program, folder):
            problems += [f"{name}: {problem}" for problem in found]
            n_checks += 1
    for problem in problems[:20]:
        print(problem)
    print(f"{n_checks} evaluations, {len(problems)} disagreements")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
