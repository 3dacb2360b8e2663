#!/usr/bin/env python3
"""usage: scripts/maintain/real_frames.py SEXTANT

Prints, as Markdown, the errors of the estimators on all real frames in $SEXTANT_DATA: of the camera, of moving objects, and of
parked cars up to 50 m away, whose speed is 0. Objects whose labels move by more than 1 m/s count as moving. Every mean has a 95 %
interval (bootstrap over records). The second table shows for each source the variant of joint_flow_depth that is best on all
other sources (leave one source out), and the errors of all variants on this source."""

import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

PARKED = ["pipeline.max_object_distance_m=50", "pipeline.min_object_area=0.0003", "pipeline.estimate_static_objects=true"]
METHODS = {
    "joint_flow": ("joint_flow", []),
    "joint_flow_depth": ("joint_flow_depth", []),
    "joint_flow_depth, independent": ("joint_flow_depth", ["estimator.covariance=independent"]),
    "joint_flow_depth, disparities": ("joint_flow_depth", ["estimator.sigma_flow_u_px=3", "estimator.sigma_flow_v_px=3",
                                                           "estimator.delta_d_px=0.1"]),
}


def lay_out(data, folder):
    """Lays out two scene-flow pairs as the frames of KITTI tracking that they are."""
    training = folder / "training"
    for name in ("calib", "oxts", "label_02", "instances_txt"):
        (training / name).parent.mkdir(parents=True, exist_ok=True)
        (training / name).symlink_to(data / "kitti_tracking" / "training" / name)
    for camera in ("2", "3"):
        for pair, sequence, frame in (("000002", "0000", 10), ("000007", "0001", 354)):
            images = training / f"image_0{camera}" / sequence
            images.mkdir(parents=True)
            for k in (0, 1):
                image = data / "kitti_sceneflow_2015" / f"image_{camera}" / f"{pair}_{10 + k}.png"
                (images / f"{frame + k:06}.png").symlink_to(image)


def sources(data, pairs):
    return {
        "KITTI 03, PWC-Net": (f"vdo:{data}/kitti_03_demo@0-19", []),
        "KITTI 03, DIS": (f"vdo:{data}/kitti_03_demo@0-19", ["source.flow=dis"]),
        "KITTI 05, SGBM and DIS": (f"kitti:{data}/kitti_tracking#0005@0-15", []),
        "scene flow 000002, SGBM and DIS": (f"kitti:{pairs}#0000@10-11", []),
        "scene flow 000007, SGBM and DIS": (f"kitti:{pairs}#0001@354-355", []),
    }


def records(program, source, estimator, options, folder):
    """Returns the records of all estimates that succeeded."""
    command = [program, "run", source[0], "--estimator", estimator, "--out", str(folder), "--force", "--quiet", "--consistency"]
    for option in source[1] + options:
        command += ["--set", option]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(folder / "records.jsonl", encoding="utf-8") as lines:
        return [record for record in map(json.loads, lines) if record["status"] == "ok"]


def mean(values):
    """Returns the mean and its 95 % interval as text."""
    if not values:
        return "-"
    draw = random.Random(0)
    means = sorted(sum(draw.choices(values, k=len(values))) / len(values) for _ in range(1000))
    return f"{sum(values) / len(values):.4g} [{means[25]:.4g}, {means[974]:.4g}]"


def numbers(rows, kind, key):
    return [row[kind][key] for row in rows if key in row[kind]]


def main():
    if len(sys.argv) != 2 or not os.environ.get("SEXTANT_DATA"):
        sys.exit(__doc__)
    program, data = sys.argv[1], pathlib.Path(os.environ["SEXTANT_DATA"])
    error = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        lay_out(data, folder / "pairs")
        print("| source | method | camera E_t [m] | camera E_R [deg] | moving E_v [km/h] | parked v [km/h] | split NEES of parked "
              "| expansion chi2 of parked |\n|---|---|---|---|---|---|---|---|")
        for name, source in sources(data, folder / "pairs").items():
            for method, (estimator, options) in METHODS.items():
                rows = records(program, source, estimator, options + PARKED, folder / "out")
                camera = [row for row in rows if row["body"] == "ego"]
                moving, parked = ([row for row in rows if row["body"] != "ego" and row["values"].get("dynamic_gt") == dynamic]
                                  for dynamic in (1, 0))
                columns = ((camera, "errors", "Et_m"), (camera, "errors", "ER_deg"), (moving, "errors", "Ev_kmh"),
                           (parked, "values", "v_kmh"), (parked, "values", "split_nees"), (parked, "values", "expansion_chi2"))
                print("|", " | ".join([name, method, *(mean(numbers(*column)) for column in columns)]), "|", flush=True)
                if speeds := numbers(parked, "values", "v_kmh"):
                    error[name, method] = sum(speeds) / len(speeds)
    ours = [method for method in METHODS if method != "joint_flow"]
    names = sorted({name for name, _ in error})
    print(f"\n| left out | best on the others | parked v [km/h] there: {'; '.join(ours)} |\n|---|---|---|")
    for out in names:
        chosen = min(ours, key=lambda method: sum(math.log(error[name, method]) for name in names if name != out))
        print(f"| {out} | {chosen} | {'; '.join(f'{error[out, method]:.2f}' for method in ours)} |")


if __name__ == "__main__":
    main()
