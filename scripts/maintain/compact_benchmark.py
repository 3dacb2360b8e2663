#!/usr/bin/env python3
"""Copies the folder of an estimator that `sextant benchmark` wrote, without the data that no card reads, to store it as a reference.

usage: scripts/maintain/compact_benchmark.py OUT/ESTIMATOR results/benchmark/NAME [--digits N] [--no-times]

Kept: the bodies that a track of the suite counts; the errors E_t, E_R and E_v and their bounds, the normalised error
(NEES), the true step, the total time and the peak memory. The card must be written again afterwards:
sextant benchmark card results/benchmark/NAME.
"""

import argparse
import json
import pathlib
import shutil

ROOT = pathlib.Path(__file__).resolve().parents[2]
ERRORS = ("Et_m", "ER_deg", "Ev_kmh")
VALUES = ("nees", "step_gt_m", "distance_gt_m", "dynamic_gt", "peak_memory_mb")


def counted_objects():
    """Returns the objects that count, by plan and sequence."""
    suite = json.loads((ROOT / "eval/suites/sextant-1.json").read_text())
    return {plan: track.get("objects", {}) for track in suite["tracks"] for plan in track["plans"]}


def compact(record, digits, times):
    def kept(numbers, keys):
        return {key: float(f"%.{digits}g" % value) for key, value in numbers.items() if key in keys}

    record["errors"] = kept(record["errors"], ERRORS)
    record["bound"] = kept(record["bound"], ERRORS)
    record["values"] = kept(record["values"], VALUES)
    record["time_ms"] = kept(record["time_ms"], ("total",)) if times else {}
    return json.dumps(record, separators=(",", ":")) + "\n"


def copy_sweep(source, target, objects, digits, times):
    target.mkdir(parents=True, exist_ok=True)
    cases = [json.loads(line) for line in (source / "cases.jsonl").open()]
    cases.sort(key=lambda case: case["case"])
    with (source / "records.jsonl").open() as lines, (target / "records.jsonl").open("w") as records:
        for case in cases:
            n_kept = 0
            for _ in range(case["records"]):
                record = json.loads(next(lines))
                body = record["body"]
                if objects and body != "ego" and int(body.split(":")[1]) not in objects.get(record["sequence"], []):
                    continue
                records.write(compact(record, digits, times))
                n_kept += 1
            case["records"] = n_kept
    with (target / "cases.jsonl").open("w") as file:
        for case in cases:
            file.write(json.dumps({"case": case["case"], "records": case["records"]}, separators=(",", ":")) + "\n")
    shutil.copy(source / "plan.json", target)
    run = json.loads((source / "run.json").read_text())
    for key in ("noise", "sources"):
        run.pop(key, None)
    run["records"] = sum(case["records"] for case in cases)
    (target / "run.json").write_text(json.dumps(run, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("target", type=pathlib.Path)
    parser.add_argument("--digits", type=int, default=9)
    parser.add_argument("--no-times", action="store_true", help="for programs whose times were not measured on an idle machine")
    arguments = parser.parse_args()
    plans = counted_objects()
    for plan, objects in plans.items():
        if (arguments.source / plan / "records.jsonl").exists():
            copy_sweep(arguments.source / plan, arguments.target / plan, objects, arguments.digits, not arguments.no_times)
    if (arguments.source / "left_out.json").exists():
        shutil.copy(arguments.source / "left_out.json", arguments.target)


if __name__ == "__main__":
    main()
