#!/usr/bin/env python3
"""Compares a reproduction with the committed reference run of the embedded part.

usage: scripts/maintain/check_baseline.py DIR [--update] [--self-test]

DIR is what `sextant reproduce --out DIR` has written, with or without data. Every measured row of
results/baseline/*.json has to be in DIR/report/tables with equal texts and numbers equal within rounding:
|a - b| <= 1e-6 max(|a|, |b|) + 1e-9. Run times are not part of the baseline.
--update writes the baseline from DIR, which has to be a run without data.
Exit codes: 0 equal, 1 differences, 2 usage.
"""

import argparse
import collections
import json
import pathlib
import sys

TABLES = ["table_1_classification", "table_2_flow_error", "table_3_sets", "table_6_limit", "table_8_attribution", "claims"]
RELATIVE, ABSOLUTE = 1e-6, 1e-9
BASELINE = pathlib.Path(__file__).resolve().parents[2] / "results" / "baseline"


def is_stable(row):
    """Returns True if the row was measured and holds no run time."""
    return row.get("verdict") != "not measured here" and row.get("claim") != "frame_rate"


def read_rows(path):
    if not path.exists():
        sys.exit(f"check_baseline.py: {path}: no such file: expected the tables of a reproduction")
    return json.loads(path.read_text(encoding="utf-8"))


def key_of(row):
    """Returns the texts that identify a row: all but its verdict and its files of records."""
    return tuple(sorted((k, v) for k, v in row.items() if isinstance(v, str) and k != "verdict" and not k.endswith("_file")))


def equal(a, b):
    """Returns True for equal texts, and for numbers that are equal within rounding."""
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return abs(a - b) <= RELATIVE * max(abs(a), abs(b)) + ABSOLUTE
    return a == b


def differences(wanted, rows):
    """One line per row that is missing or has another number or verdict."""
    present, lines = collections.defaultdict(list), []
    for row in rows:
        present[key_of(row)].append(row)
    for row in filter(is_stable, wanted):
        key = key_of(row)
        name = ", ".join(text for _, text in key)
        now = present[key].pop(0) if present[key] else None
        if now is None:
            lines.append(f"missing: {name}")
            continue
        lines += [f"{name}: {field}: baseline {row.get(field)}, now {now.get(field)}"
                  for field in sorted(row.keys() | now.keys()) if not equal(row.get(field), now.get(field))]
    return lines


def self_test():
    row = {"body": "Ego", "value": 1.0, "verdict": "within"}
    assert differences([row], [dict(row, value=1 + 1e-8)]) == []
    assert len(differences([row], [dict(row, value=1.001)])) == 1
    assert len(differences([row], [dict(row, verdict="outside")])) == 1
    assert len(differences([row], [])) == 1
    assert len(differences([row], [{k: v for k, v in row.items() if k != "value"}])) == 1
    assert differences([dict(row, verdict="not measured here")], []) == []
    print("self test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", nargs="?", type=pathlib.Path)
    parser.add_argument("--update", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    if options.dir is None:
        parser.error("DIR is missing")
    n_rows, lines = 0, []
    for table in TABLES:
        rows, baseline = read_rows(options.dir / "report" / "tables" / f"{table}.json"), BASELINE / f"{table}.json"
        if options.update:
            baseline.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows if is_stable(row)) + "\n]\n", encoding="utf-8")
        wanted = read_rows(baseline)
        n_rows += len(wanted)
        lines += [f"{table}: {line}" for line in differences(wanted, rows)]
    print(*lines[:40], f"{n_rows} rows of the baseline, {len(lines)} differences", sep="\n")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
