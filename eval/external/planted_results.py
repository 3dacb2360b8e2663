#!/usr/bin/env python3
"""Warnings of `sextant run` and `sextant sweep` about a program whose results have other conventions than its configuration declares.

usage: planted_results.py PROGRAM

An external program copies the results of a built-in estimator, unchanged and with one mistake each. Unchanged results
must cause no warning, and each mistake one that names its cause; the exit code is 0, and the numbers are those of the results as declared.
Exit codes: 0 as expected, 1 not, 77 numpy is missing (the test is skipped).
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed for this python (Debian: python3-numpy)")
    sys.exit(77)

SOURCE = "synthetic:city@0-10"
NOISE = '{"flow":{"epe_px":0.3}}'


def read_rows(path):
    """{frame: T} of rows of 12 values, with or without a frame number."""
    out = {}
    for row, line in enumerate(path.read_text().splitlines()):
        v = [float(x) for x in line.split()]
        T = np.eye(4)
        T[:3] = np.reshape(v[-12:], (3, 4))
        out[int(v[0]) if len(v) == 13 else row] = T
    return out


def kitti(rows):
    return "".join(f"{k} " + " ".join(repr(float(x)) for x in T[:3].ravel()) + "\n" for k, T in rows.items())


def w_first(rows):
    """TUM rows with the quaternion in the wrong order; of rotations below 180 degrees."""
    text = ""
    for k, T in rows.items():
        R, w = T[:3, :3], np.sqrt(1 + np.trace(T[:3, :3])) / 2
        q = [w, (R[2, 1] - R[1, 2]) / (4 * w), (R[0, 2] - R[2, 0]) / (4 * w), (R[1, 0] - R[0, 1]) / (4 * w)]
        text += " ".join(repr(float(x)) for x in [0.1 * k, *T[:3, 3], *q]) + "\n"
    return text


def of_each(change):
    return lambda rows: {k: change(T) for k, T in rows.items()}


def scaled(factor):
    return of_each(lambda T: np.block([[T[:3, :3], factor * T[:3, 3:]], [T[3:]]]))



def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        wrong = []

        def sextant(*arguments):
            return subprocess.run([program, *arguments], capture_output=True, text=True, check=False, cwd=folder)

        ours = sextant("run", SOURCE, "--estimator", "motion_only", "--noise", NOISE, "--out", "ours")
        if ours.returncode:
            sys.exit(ours.stderr)
        camera, motion = read_rows(folder / "ours/est_camera_kitti.txt"), read_rows(folder / "ours/obj_1_motion.txt")
        inverse = of_each(np.linalg.inv)
        steps = {k: np.linalg.inv(camera.get(k - 1, camera[k])) @ T for k, T in camera.items()}

        def in_axes(opencv_from_axes):
            C = np.eye(4)
            C[:3, :3] = opencv_from_axes
            return of_each(lambda T: C.T @ T @ C)

        opengl = in_axes(np.diag([1.0, -1.0, -1.0]))
        flu = in_axes(np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]))

        def in_camera(rows):
            return {k: np.linalg.inv(camera[k]) @ H @ camera[k - 1] for k, H in rows.items()}
        # (file, expected message; None: no message)
        cameras = {"right": (kitti(camera), None), "centimetres": (kitti(scaled(100)(camera)), "look like centimetres"),
                   "millimetres": (kitti(scaled(1000)(camera)), "look like millimetres"),
                   "inverse": (kitti(inverse(camera)), "look inverted"), "steps": (kitti(steps), "motions from frame to frame"),
                   "w_first": (w_first(camera), "w first")}
        axes = {"opengl": (kitti(opengl(camera)), "opengl axes"), "flu": (kitti(flu(camera)), "flu axes"),
                "scaled": (kitti(scaled(0.37)(camera)), r"multiplied by 2\.7")}
        objects = {"right": (kitti(motion), None), "centimetres": (kitti(scaled(100)(motion)), "look like centimetres"),
                   "too_small": (kitti(scaled(0.01)(motion)), "100 times too small"),
                   "inverse": (kitti(inverse(motion)), "look inverted"), "camera": (kitti(in_camera(motion)), "camera"),
                   "w_first": (w_first(motion), "w first")}
        for kind, plants in (("camera", cameras), ("axes", axes), ("objects", objects)):
            results = {}
            (folder / kind).mkdir()
            (folder / kind / "camera.txt").write_text(kitti(camera))
            for name, (text, _) in plants.items():
                (folder / kind / f"{kind}_{name}_1.txt").write_text(text)
                results[name] = ({"camera": {"file": f"{kind}_{name}_1.txt"}} if kind != "objects" else
                                 {"camera": {"file": "camera.txt"},
                                  "objects": {"format": "motions", "files": f"objects_{name}_*.txt"}})
            (folder / kind / "program.json").write_text(
                json.dumps({"command": "sh -c 'cp {config}/*.txt {output}'", "results": results}))
            estimator = f"external:{kind}/program.json"
            run = sextant("run", SOURCE, "--estimator", estimator, "--out", f"run_{kind}")
            plan = {"sources": [SOURCE], "estimators": [estimator], "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]},
                    "seeds": 1}
            (folder / f"{kind}.json").write_text(json.dumps(plan))
            sweep = sextant("sweep", f"{kind}.json", "--out", f"sweep_{kind}", "--cache", "cache")
            for command, finished in (("run", run), ("sweep", sweep)):
                if finished.returncode:
                    wrong.append(f"{command} of {kind}: exit code {finished.returncode}: {finished.stderr}")
                lines = [line for line in finished.stderr.splitlines() if "warning" in line]
                named = 0
                for name, (_, expected) in plants.items():
                    of_result = [line for line in lines if f"program.{name}," in line]
                    if expected is None and of_result:
                        wrong.append(f"{command} of {kind}, {name}: expected no warning: {of_result}")
                    if expected is not None:
                        if any(re.search(expected, line) for line in of_result):
                            named += 1
                        else:
                            wrong.append(f"{command} of {kind}, {name}: expected '{expected}': {of_result}\n{finished.stderr}")
                n_plants = sum(expected is not None for _, expected in plants.values())
                print(f"{command}: {named} of {n_plants} plants in {kind} are named")
        print("\n".join(wrong))
        sys.exit(1 if wrong else 0)


main()
