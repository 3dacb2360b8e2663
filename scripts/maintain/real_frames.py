#!/usr/bin/env python3
"""usage: scripts/maintain/real_frames.py SEXTANT

Prints, as Markdown, the errors of the estimators on the real sequences in $SEXTANT_DATA: of the camera, of moving objects, and of
parked cars up to 50 m away, whose speed is 0. Objects whose labels move by more than 1 m/s count as moving. Every mean has a 95 %
interval (bootstrap over records). The last two sources are pairs of KITTI scene flow, which are frames of KITTI tracking."""

import json
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
SOURCES = {
    "KITTI 03, PWC-Net": ("vdo:{data}/kitti_03_demo@0-19", []),
    "KITTI 03, DIS": ("vdo:{data}/kitti_03_demo@0-19", ["source.flow=dis"]),
    "KITTI 05, SGBM and DIS": ("kitti:{data}/kitti_tracking#0005@0-15", []),
    "KITTI 0000, frame 10": ("kitti:{pairs}#0000@10-11", []),
    "KITTI 0001, frame 354": ("kitti:{pairs}#0001@354-355", []),
}
PAIRS = (("000002", "0000", 10), ("000007", "0001", 354))  # pair of scene flow, sequence and first frame of tracking


def lay_out_pairs(data, root):
    """Links the pairs of scene flow below `root` as frames of KITTI tracking."""
    training, text = root / "training", data / "kitti_tracking/training"
    for pair, sequence, first in PAIRS:
        for part in ("calib", "oxts", "label_02", "instances_txt"):
            (training / part).mkdir(parents=True, exist_ok=True)
            (training / part / f"{sequence}.txt").symlink_to(text / part / f"{sequence}.txt")
        for side in "23":
            folder = training / f"image_0{side}" / sequence
            folder.mkdir(parents=True)
            for k in (0, 1):
                image = data / f"kitti_sceneflow_2015/image_{side}/{pair}_1{k}.png"
                (folder / f"{first + k:06}.png").symlink_to(image)


def records(program, source, estimator, options, folder):
    """Returns the records of all estimates that succeeded."""
    command = [program, "run", source, "--estimator", estimator, "--out", str(folder), "--force", "--quiet", "--consistency"]
    for option in options:
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


def main():
    if len(sys.argv) != 2 or not os.environ.get("SEXTANT_DATA"):
        sys.exit(__doc__)
    program, data = sys.argv[1], pathlib.Path(os.environ["SEXTANT_DATA"]).resolve()
    print("| source | method | camera E_t [m] | camera E_R [deg] | moving E_v [km/h] | parked v [km/h] | split NEES of parked "
          "| expansion chi2 of parked |\n|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        pairs = pathlib.Path(folder) / "pairs"
        lay_out_pairs(data, pairs)
        for name, (source, of_source) in SOURCES.items():
            for method, (estimator, of_method) in METHODS.items():
                options = of_source + of_method + PARKED
                rows = records(program, source.format(data=data, pairs=pairs), estimator, options, pathlib.Path(folder) / "out")
                camera = [row for row in rows if row["body"] == "ego"]
                moving, parked = ([row for row in rows if row["body"] != "ego" and row["values"].get("dynamic_gt") == dynamic]
                                  for dynamic in (1, 0))
                columns = ((camera, "errors", "Et_m"), (camera, "errors", "ER_deg"), (moving, "errors", "Ev_kmh"),
                           (parked, "values", "v_kmh"), (parked, "values", "split_nees"), (parked, "values", "expansion_chi2"))
                means = [mean([row[kind][key] for row in of_kind if key in row[kind]]) for of_kind, kind, key in columns]
                print("|", " | ".join([name, method, *means]), "|", flush=True)


if __name__ == "__main__":
    main()
