#!/usr/bin/env python3
"""Second opinion on `sextant evaluate ego`: the definitions of docs/metrics.md in numpy, on made-up recordings.

usage: evaluate_ego_oracle.py PROGRAM

Writes KITTI, TUM and EuRoC pairs (long, few poses, partly standing still, swapped), evaluates each with every
relation, alignment and selection of pairs, and compares every statistic with that of ego_definitions.py to 1e-6; then
pairs in other axes, of a body beside the camera, at other instants and with another clock, for the flags that undo
that, with the estimated time offset and its interval. Exit codes: 0 all agree, 1 not, 77 numpy is missing (the test is
skipped).
"""

import itertools
import json
import pathlib
import subprocess
import sys
import tempfile

from ego_definitions import (ALIGNMENTS, RATIO, RELATIONS, align, ape, camera_poses, Clock, exponential, interpolated,
                             match, np, pairs_of, poses, rotations, rpe, statistics, values, yaw)


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
        n_pairs = max(len(RELATIONS), len(ALIGNMENTS))
        diagonal = [(RELATIONS[i % len(RELATIONS)], ALIGNMENTS[i % len(ALIGNMENTS)]) for i in range(n_pairs)]
        for name, case in cases.items():
            # Every relation with every alignment for the first recording of a format; each once for what differs from it.
            pairs = itertools.product(RELATIONS, ALIGNMENTS) if name in ("kitti", "tum", "kitti, few") else diagonal
            work = [(r, a, 0, None) for r, a in pairs]
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
