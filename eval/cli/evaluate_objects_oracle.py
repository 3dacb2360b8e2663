#!/usr/bin/env python3
"""Second opinion on the object poses of `sextant evaluate objects`: evo's APE and RPE in numpy.

usage: evaluate_objects_oracle.py PROGRAM

Writes DynOSAM logs of three objects with noisy poses and motions, and compares APE (after a rigid Umeyama alignment of
each object's path), RPE over steps of one pose and RPE of the path that the motions chain with its own to 1e-9; with
SEXTANT_DATA the same of DynOSAM's own logs. Exit codes: 0 all agree, 1 not, 77 numpy is missing (the test is skipped).
"""

import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed for this python (Debian: python3-numpy)")
    sys.exit(77)

HEADER = "tx,ty,tz,qx,qy,qz,qw,gt_tx,gt_ty,gt_tz,gt_qx,gt_qy,gt_qz,gt_qw"


def pose(v):
    """Matrix of tx ty tz qx qy qz qw."""
    x, y, z, w = np.array(v[3:7]) / np.linalg.norm(v[3:7])
    T = np.eye(4)
    T[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    T[:3, 3] = v[:3]
    return T


def numbers(T):
    """tx ty tz qx qy qz qw, of rotations below 180 degrees."""
    R, w = T[:3, :3], np.sqrt(1 + np.trace(T[:3, :3])) / 2
    q = [(R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w), w]
    return [*T[:3, 3], *q]


def turn(w):
    angle = np.linalg.norm(w)
    if angle == 0:
        return np.eye(3)
    a = np.array(w) / angle
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def transform(w, t):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn(w), t
    return T


def angle_deg(R):
    s = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return np.degrees(np.arctan2(np.linalg.norm(s), np.trace(R) - 1))


def rmse(errors):
    return {"m": np.sqrt(np.mean([e @ e for e in (E[:3, 3] for E in errors)])),
            "deg": np.sqrt(np.mean([angle_deg(E[:3, :3]) ** 2 for E in errors]))}


def ape(estimate, truth):
    x, y = (np.array([T[:3, 3] for T in path]) for path in (estimate, truth))
    U, _, Vt = np.linalg.svd((y - y.mean(0)).T @ (x - x.mean(0)))
    R = U @ np.diag([1, 1, np.linalg.det(U) * np.linalg.det(Vt)]) @ Vt
    A = np.eye(4)
    A[:3, :3], A[:3, 3] = R, y.mean(0) - R @ x.mean(0)
    return rmse([np.linalg.inv(t) @ A @ e for e, t in zip(estimate, truth)])


def rpe(estimate, truth, steps):
    def step(path, k):
        return np.linalg.inv(path[k]) @ path[k + 1]
    return rmse([np.linalg.inv(step(truth, k)) @ step(estimate, k) for k in steps])


def read(path):
    """{(object, frame): (estimate, truth)}"""
    with open(path, newline="") as file:
        rows = [[float(x) for x in row] for row in list(csv.reader(file))[1:] if row]
    return {(int(r[1]), int(r[0])): (pose(r[2:9]), pose(r[9:16])) for r in rows}


def expected(folder, module):
    motions, poses = (read(folder / f"{module}_object_{kind}_log.csv") for kind in ("motion", "pose"))
    out = {}
    for i in sorted({key[0] for key in poses}):
        frames = [k for (o, k) in poses if o == i]
        own, truth = ([poses[i, k][n] for k in frames] for n in (0, 1))
        chained = {}
        for o, k in (key for key in motions if key[0] == i):
            if (i, k - 1) in poses:
                chained.setdefault(k - 1, poses[i, k - 1][1])
            if k - 1 in chained:
                chained[k] = motions[i, k][0] @ chained[k - 1]
        common = [k for k in sorted(chained) if (i, k) in poses]
        pairs = [n for n in range(len(common) - 1) if common[n + 1] == common[n] + 1]
        out[str(i)] = {"ape": ape(own, truth) if len(frames) >= 3 else None,
                       "rpe": rpe(own, truth, range(len(frames) - 1)) if len(frames) >= 2 else None,
                       "chained_rpe": rpe([chained[k] for k in common], [poses[i, k][1] for k in common], pairs)
                       if pairs else None}
    return out


def write(folder, rng):
    motions, poses = [], []
    for i, (speed, yaw_rate, start) in enumerate([(1.1, 0.01, (3, 1, 14)), (0.7, -0.02, (-4, 1, 30)), (0.3, 0.03, (6, 1, 18))]):
        L = transform((0, 0.3 * i, 0), start)
        for k in range(60):
            B = transform((0, yaw_rate, 0.002), (0, 0, speed * (1 + 0.2 * np.sin(k / 5))))
            noise = transform(rng.normal(0, 0.01, 3), rng.normal(0, 0.05, 3))
            if k > 0:
                H = L @ B @ np.linalg.inv(L)
                own = L @ B @ transform(rng.normal(0, 0.002, 3), rng.normal(0, 0.02, 3)) @ np.linalg.inv(L)
                L = L @ B
                if not (i == 1 and k == 20):  # a stretch ends
                    motions.append([k, i + 1, *numbers(own), *numbers(H)])
            poses.append([k, i + 1, *numbers(L @ noise), *numbers(L)])
    for kind, rows in (("motion", motions), ("pose", poses)):
        lines = [f"frame_id,object_id,{HEADER}"] + [",".join(map(repr, (float(x) if n > 1 else int(x) for n, x in enumerate(row))))
                                                    for row in rows]
        (folder / f"back_object_{kind}_log.csv").write_text("\n".join(lines) + "\n")


def compare(program, folder, modules):
    result = subprocess.run([program, "evaluate", "objects", "--format", "dynosam", "--json", str(folder)],
                            capture_output=True, text=True, check=True)
    rows = {(r["estimator"], str(r["object"])): r for r in json.loads(result.stdout)["poses"]}
    n, worst = 0, 0.0
    for module in modules:
        for i, errors in expected(folder, module).items():
            for kind, error in errors.items():
                for unit in ("m", "deg") if error else ():
                    off = abs(rows[module, i][f"{kind}_{unit}"] - error[unit])
                    n, worst = n + 1, max(worst, off)
                    if not off <= 1e-9:
                        print(f"{folder} {module} object {i}: {kind}_{unit} {rows[module, i][f'{kind}_{unit}']}, "
                              f"expected {error[unit]}")
    return n, worst, rows


def check_other_ways(program, folder, expected_rows):
    """--preset all, --identity lost, and --format poses of what --save-tum writes."""
    def run(*arguments):
        return subprocess.run([program, "evaluate", "objects", *map(str, arguments)], capture_output=True, text=True,
                              check=True).stdout
    text = run("--format", "dynosam", folder, "--preset", "all")
    assert "errors per axis" in text and all(name in text for name in ("paper:", "multimot_code:", "vdo_slam:", "dynosam_rme:", "dynosam_ame:")), text
    saved = folder / "saved"
    run("--format", "dynosam", folder, "--save-tum", saved, "--rate", 10)
    answer = json.loads(run("--format", "poses", saved / "back", "--json"))
    assert answer["rates"][0]["hz"] == 10, answer["rates"]
    for row in answer["poses"]:
        for key in ("ape_m", "ape_deg", "rpe_m", "rpe_deg"):
            off = abs(row[key] - expected_rows["back", str(row["object"])][key])
            assert off < 1e-6, (row, key, off)
    assert len(answer["poses"]) == 3
    path = folder / "back_object_motion_log.csv"
    rows = path.read_text().splitlines()
    for n, row in enumerate(rows):
        cells = row.split(",")
        if n > 0 and cells[1] == "1" and int(cells[0]) > 50:
            rows[n] = ",".join(cells[:2] + ["0", "0", "0", "0", "0", "0", "1"] + cells[9:])
    path.write_text("\n".join(rows) + "\n")
    estimated = {}
    for way in ("count", "lost"):
        answer = json.loads(run("--format", "dynosam", folder, "--json", "--identity", way))
        estimated[way] = answer["presets"][0]["rows"][0]["n_estimated"]
        assert any("exactly the identity" in w and "51-59" in w for w in answer["warnings"]), answer["warnings"]
    assert estimated == {"count": 59, "lost": 50}, estimated


def main():
    found = []
    with tempfile.TemporaryDirectory() as temporary:
        write(pathlib.Path(temporary), np.random.default_rng(1))
        *counts, rows = compare(sys.argv[1], pathlib.Path(temporary), ["back"])
        found.append(counts)
        check_other_ways(sys.argv[1], pathlib.Path(temporary), rows)
    if "SEXTANT_DATA" in os.environ:
        found.append(compare(sys.argv[1], pathlib.Path(os.environ["SEXTANT_DATA"]) / "dynosam_kitti_0000",
                             ["frontend", "rgbd_motion_world_backend"])[:2])
    for n, worst in found:
        print(f"{n} errors of object poses, largest difference {worst:.2g}")
    sys.exit(0 if all(n > 0 and worst <= 1e-9 for n, worst in found) else 1)


if __name__ == "__main__":
    main()
