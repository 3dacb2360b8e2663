"""The definitions of docs/metrics.md for camera trajectories in numpy: alignment, errors, statistics, frames, clocks.

evaluate_ego_oracle.py compares `sextant evaluate ego` with them. Importing this module without numpy ends the program
with exit code 77 (the test is skipped).
"""

import sys

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
        at = self.times + shift
        near = np.searchsorted(times, [at - 5.001 * self.width, at + 5.001 * self.width])  # first step, and after the last
        k = near[0][:, None] + np.arange((near[1] - near[0]).max())
        inside, k = k < len(times), np.minimum(k, len(times) - 1)
        u = (times[k] - at[:, None]) / self.width
        weights = np.where(inside & (np.abs(u) <= 5), np.exp(-u ** 2 / 2) * h[k], 0)
        return (weights[..., None] * values[k]).sum(1) / weights.sum(1)[:, None]

    def score_of(self, a, use=None):
        """Score of the reference's signals `a` at the times of the estimate's."""
        use = np.ones(self.n, bool) if use is None else use
        rho = [np.clip(np.corrcoef(a[use, c], self.signal[use, c])[0, 1], 0, 1 - 1e-12) for c in (0, 1)]
        return -0.5 * use.sum() * sum(np.log(1 - r * r) for r in rho)

    def score(self, d, use=None):
        return self.score_of(self.smooth(self.ref, d), use)

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
        without = np.ones((20, self.n), bool)
        for k in range(20):
            without[k, k * self.n // 20:(k + 1) * self.n // 20] = False
        error = lambda values: np.sqrt(19 / 20 * np.sum((np.array(values) - np.mean(values)) ** 2))
        half = 2.0930240544 * error([self.peak(best, use) for use in without])
        low, high, at_best = best - half, best + half, self.smooth(self.ref, best)
        for d in grid:
            a = self.smooth(self.ref, d)
            lower = error([self.score_of(at_best, use) - self.score_of(a, use) for use in without])
            if self.score_of(at_best) - self.score_of(a) <= 2.0930240544 * lower:
                low, high = min(low, d), max(high, d)
        return best, low, high
