"""Records as frames, and `sextant export`: the content of the file in every format, also for untrusted records."""

import csv
import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import numpy
import pandas

import sextant

HOSTILE = 'a,"b"\n=1+1;\'); DROP TABLE records; --'


def record(**other):
    return {"schema": 1, "dataset": "d", "sequence": "s", "estimator": "e", "noise": "none", "level": 0.0, "seed": 0, "frame": 1,
            "body": "ego", "status": "ok", "n_points": 10, "n_inliers": 9, "flow_truth": "given", "errors": {"Et_m": 0.1},
            "values": {}, "bound": {}, "time_ms": {"total": 1.5}, **other}


def strangers():
    gated = record(body="object:3", status="gated", n_points=0, n_inliers=0, errors={}, time_ms={}, level=0.1 + 0.2)
    del gated["flow_truth"]
    gated = {key: gated[key] for key in list(gated)[:10]} | {"gate": "area"} | {key: gated[key] for key in list(gated)[10:]}
    return [record(), gated,
            record(dataset=HOSTILE, estimator="é 日本 🙂", seed=2**64 - 1, frame=2,
                   errors={"Et_m": 1e-300, 'x"y,../../z\n': 2.5}, values={"Et_m": 7.0}, bound={"both_Et_m": 0.25})]


class Folder(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def write(self, records, **more):
        text = "".join(json.dumps(item, ensure_ascii=False, separators=(",", ":")) + "\n" for item in records)
        (self.folder / "records.jsonl").write_text(text, encoding="utf-8")
        for name, content in more.items():
            (self.folder / f"{name}.json").write_text(json.dumps(content))

    def export(self, format):
        out = self.folder / f"out.{format}"
        exported = sextant.export(self.folder, format=format, out=out)
        self.assertFalse([path for path in self.folder.iterdir() if path.suffix in (".part", ".tmp", ".columns")])
        return out, exported


class Frames(Folder):
    def test_one_row_a_record_one_column_a_field(self):
        self.write(strangers(), run={"schema": 1, "version": "x"})
        frame = sextant.read(self.folder)
        self.assertEqual(len(frame), 3)
        self.assertEqual(list(frame.columns),
                         ["dataset", "sequence", "estimator", "noise", "level", "seed", "frame", "body", "status", "gate",
                          "n_points", "n_inliers", "flow_truth", "errors_Et_m", 'errors_x"y,../../z\n', "values_Et_m",
                          "bound_both_Et_m", "time_ms_total"])
        self.assertEqual(frame.dataset[2], HOSTILE)
        self.assertEqual(frame.seed[2], 2**64 - 1)
        self.assertEqual(frame.level[1], 0.1 + 0.2)
        self.assertEqual(list(frame.gate.isna()), [True, False, True])
        self.assertEqual(frame.gate[1], "area")
        self.assertTrue(numpy.isnan(frame.errors_Et_m[1]))
        self.assertEqual(frame.errors_Et_m[2], 1e-300)
        self.assertEqual(frame.attrs["run"]["version"], "x")
        self.assertEqual(list(frame.groupby("body", observed=True).n_points.sum()), [20, 0])
        self.assertEqual(list(frame.estimator.cat.categories), sorted(frame.estimator.cat.categories))

    def test_of_a_run_are_its_records(self):
        run = sextant.run("synthetic:s18@0-3", out=self.folder / "run", noise={"depth": {"delta_d_px": 0.2}}, seeds=2)
        frame = run.records()
        lines = [json.loads(line) for line in (self.folder / "run" / "records.jsonl").read_text().splitlines()]
        self.assertEqual(len(frame), len(lines))
        for k, line in enumerate(lines):
            self.assertEqual((frame.body[k], frame.status[k], frame.seed[k]), (line["body"], line["status"], line["seed"]))
            for group in ("errors", "values", "bound", "time_ms"):
                for name, value in line[group].items():
                    self.assertEqual(frame[f"{group}_{name}"][k], value)
        self.assertTrue((frame.dtypes[[c for c in frame if c.startswith("errors_")]] == float).all())

    def test_refused(self):
        with self.assertRaisesRegex(sextant.Error, "folder: expected a path, got 3"):
            sextant.read(3)
        with self.assertRaisesRegex(sextant.Error, "records.jsonl"):
            sextant.read(self.folder)
        self.write([record(), {"schema": 1}])
        with self.assertRaisesRegex(sextant.Error, "records.jsonl:2: "):
            sextant.read(self.folder)
        with self.assertRaisesRegex(sextant.Error, "folder: expected a path"):
            sextant.read("a\ud800")
        self.write([record()])
        (self.folder / "run.json").write_text("[" * 100_000)
        with self.assertRaisesRegex(sextant.Error, "run.json: expected at most 100 levels"):
            sextant.read(self.folder)


class Export(Folder):
    def test_csv(self):
        self.write(strangers())
        out, exported = self.export("csv")
        self.assertEqual((exported.records, exported.columns), (3, 18))
        with open(out, newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        frame = sextant.read(self.folder)
        self.assertEqual(rows[0], list(frame.columns))
        self.assertEqual(len(rows), 4)
        for k, row in enumerate(rows[1:]):
            for name, field in zip(rows[0], row):
                value = frame[name][k]
                if pandas.isna(value):
                    self.assertEqual(field, "")
                else:
                    self.assertEqual(type(value)(field) if not isinstance(value, str) else field, value)

    def test_npz_needs_no_pickle(self):
        self.write(strangers())
        out, _ = self.export("npz")
        frame = sextant.read(self.folder)
        with numpy.load(out, allow_pickle=False) as arrays:
            self.assertEqual(arrays["seed"].dtype, numpy.uint64)
            for name in frame.columns:
                stored = "errors_x%22y%2C..%2F..%2Fz%0A" if "x" in name and "y" in name else name
                values = arrays[stored]
                if stored + "_names" in arrays:
                    names = arrays[stored + "_names"]
                    texts = [names[code] if code >= 0 else None for code in values]
                    self.assertEqual(texts, [None if pandas.isna(text) else text for text in frame[name]])
                else:
                    numpy.testing.assert_array_equal(values, frame[name].to_numpy())
            self.assertFalse([name for name in arrays.files if "/" in name])

    def test_sqlite(self):
        self.write(strangers())
        out, _ = self.export("sqlite")
        frame = sextant.read(self.folder)
        with sqlite3.connect(out) as base:
            self.assertEqual(base.execute("PRAGMA integrity_check").fetchall(), [("ok",)])
            self.assertEqual([row[1] for row in base.execute("PRAGMA table_info(records)")], list(frame.columns))
            rows = base.execute("SELECT * FROM records").fetchall()
        base.close()
        for k, row in enumerate(rows):
            for name, value in zip(frame.columns, row):
                expected = frame[name][k]
                if pandas.isna(expected):
                    self.assertIsNone(value)
                elif name == "seed":
                    self.assertEqual(int(value), int(expected))
                else:
                    self.assertEqual(value, expected)

    def test_an_export_replaces_and_repeats(self):
        self.write(strangers())
        for format in ("csv", "npz"):
            first = self.export(format)[0].read_bytes()
            self.assertEqual(first, self.export(format)[0].read_bytes())
        before = (self.folder / "out.csv").read_bytes()
        self.write([record(), {"schema": 1}])
        with self.assertRaisesRegex(sextant.Error, "records.jsonl:2"):
            self.export("csv")
        self.assertEqual((self.folder / "out.csv").read_bytes(), before)
        self.assertFalse(list(self.folder.glob("*.part")) + list(self.folder.glob("*.tmp")) + list(self.folder.glob("*.columns")))

    def test_refused(self):
        self.write([record()])
        for format, out, message in (("cvs", self.folder / "a", "expected one of"), ("csv", self.folder, "is a folder"),
                                  ("csv", self.folder / "no" / "a", "there is no folder")):
            with self.assertRaisesRegex(sextant.Error, message):
                sextant.export(self.folder, format=format, out=out)
        self.write([record(errors={"Et_m": 1.0, "ET_M": 2.0})])
        with self.assertRaisesRegex(sextant.Error, "duplicate column name"):
            self.export("sqlite")

    def test_memory_does_not_grow_with_the_records(self):
        """SEXTANT_EXPORT_RECORDS=1000000 for the number of the documents."""
        wanted = int(os.environ.get("SEXTANT_EXPORT_RECORDS", "60000"))
        line = (json.dumps(record(errors={f"e{k}_m": 0.125 * k for k in range(10)}, values={f"v{k:02}": 1 / (k + 3) for k in range(20)},
                                  time_ms={f"t{k}": k / 7 for k in range(5)}), separators=(",", ":")) + "\n").encode()
        peaks = {}
        for n in (wanted // 10, wanted):
            with open(self.folder / "records.jsonl", "wb") as file:
                for _ in range(n // 1000):
                    file.write(line * 1000)
            for format in ("csv", "npz", "sqlite"):
                script = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True); "
                          "used = resource.getrusage(resource.RUSAGE_CHILDREN); print(used.ru_maxrss / 1000, used.ru_utime)")
                out = self.folder / f"out.{format}"
                done = subprocess.run([sys.executable, "-c", script, sextant.program(), "export", self.folder, "--format", format,
                                       "--out", out, "--quiet"], capture_output=True, text=True, check=True)
                peak, seconds = map(float, done.stdout.split())
                peaks.setdefault(format, []).append(peak)
                print(f"{format}: {n} records, {peak:.0f} MB, {seconds:.1f} CPU s, {out.stat().st_size / 1e6:.1f} MB written")
        for format, (small, large) in peaks.items():
            self.assertLess(large, small + 25, format)


if __name__ == "__main__":
    unittest.main()
