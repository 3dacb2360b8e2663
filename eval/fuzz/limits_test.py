#!/usr/bin/env python3
"""usage: eval/fuzz/limits_test.py SEXTANT [--interrupt-s S] [unittest arguments]

Tests that the program keeps the limits of docs/security.md: memory and time of hostile input, refusals, Ctrl-C, closed streams, and
the output of hostile texts. --interrupt-s: seconds within which a command must end after Ctrl-C (1; more on a busy machine). Exit
codes: 0 all tests passed, 1 some failed.
"""

import bz2
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import hostile_files_testing as files
from program_testing import BUSY, REFUSED_MB, SANITIZED, Program, printed_faults

MB = 1e6
TEXT_RATIO = 20
OPENS_FILES_EARLY = os.environ.get("SEXTANT_OPENS_FILES_EARLY")  # a library that opens files before main()


class Limits(unittest.TestCase):
    file = None
    interrupt_s = 1.0

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="sextant-limits-")
        self.addCleanup(folder.cleanup)
        self.here = pathlib.Path(folder.name)
        self.program = Program(self.file, self.here)

    def write(self, name, data):
        path = self.here / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            for part in [data] if isinstance(data, (bytes, str)) else data:
                file.write(part if isinstance(part, bytes) else part.encode())
        return path

    def refused(self, *words, named="", most_mb=REFUSED_MB, **more):
        done = self.program.run(*words, **more)
        self.assertEqual(done.fault((2,), most_mb), "", words)
        self.assertIn(named, done.err)
        self.assertEqual(len(done.err.splitlines()), 1, done.err)
        self.assertLess(len(done.err), 1000)
        return done

    def good(self, *words, most_mb=None, codes=(0,), **more):
        done = self.program.run(*words, **more)
        self.assertEqual(done.fault(codes, most_mb), "", words)
        return done

    def records(self, lines, name="run"):
        return self.write(f"{name}/records.jsonl", (files.record_line(line) + "\n" for line in lines)).parent

    def trajectory(self, n, name="a.tum"):
        return self.write(name, (files.tum_line(i) for i in range(n)))


class Claims(Limits):
    """Sizes that headers claim, against the length of the file."""

    def depth(self, data):
        file = self.write("x.png", data)
        return self.refused("evaluate", "depth", file, file, "--est-format", "depth256", "--gt-format", "depth256", named="x.png")

    def test_png(self):
        for width, height in ((10**6, 10**6), (40000, 40000), (11585, 11585), (4000, 4000), (2**31 - 1, 1), (0, 0)):
            self.depth(files.png(width, height, depth=16, claimed_bytes=0))
            flow = self.write("f.png", files.png(width, height, depth=16, colour=2, claimed_bytes=1))
            self.refused("evaluate", "flow", flow, flow, "--est-format", "kitti", "--gt-format", "kitti", named="f.png")
        self.depth(files.png_of_zeros(9000, 9000))  # a whole image, 800 times its file
        self.depth(files.png(3000, 3000, depth=16, rows=bytes(100)))

    def vdo(self):
        self.good("data", "make", "synthetic:s18@0-1", "--layout", "vdo", "--out", self.here / "made", "--quiet")
        return next(path.parent for path in (self.here / "made").rglob("image_0"))

    def test_sequence(self):
        folder = self.vdo()
        image = sorted((folder / "image_0").iterdir())[0]
        keep = image.read_bytes()
        for data in (files.png(10**6, 10**6, claimed_bytes=0), files.png(40000, 40000, colour=2, claimed_bytes=0)):
            image.write_bytes(data)
            for command in (("data", "check"), ("run", "--out", self.here / "out"), ("overlay", "--frame", 1, "--out", self.here / "o.png")):
                self.refused(command[0], *([command[1]] if command[0] == "data" else []), f"vdo:{folder}",
                             *([] if command[0] == "data" else command[1:]), named=image.name)
        image.unlink()
        for width, height in ((65500, 65500), (11585, 11585)):
            for progressive in (False, True):
                photo = image.with_suffix(".jpg")
                photo.write_bytes(files.jpeg(width, height, progressive=progressive))
                self.refused("data", "check", f"vdo:{folder}", named=photo.name)
        photo.unlink()
        image.write_bytes(keep)
        mask = sorted((folder / "semantic").iterdir())[0]
        data = files.mask_text(200_000, 300_000)
        mask.write_bytes(data)
        self.refused("data", "check", f"vdo:{folder}", named=mask.name)

    def test_scans(self):
        folder = self.vdo()
        image = sorted((folder / "image_0").iterdir())[0]
        image.unlink()
        image.with_suffix(".jpg").write_bytes(files.progressive_jpeg(80, 80, 150))
        self.refused("data", "check", f"vdo:{folder}", named="more than 100 scans")

    def test_flo(self):
        for width, height in ((10**6, 10**6), (2**31 - 1, 2**31 - 1), (-1, 5), (40000, 40000)):
            file = self.write("x.flo", files.flo(width, height))
            self.refused("evaluate", "flow", file, file, named="x.flo")

    def test_recordings(self):
        packer = bz2.BZ2Compressor(9)
        zeros = b"".join(packer.compress(bytes(2**20)) for _ in range(2**8)) + packer.flush()
        nested = files.mcap(*[files.mcap_chunk(zeros, 2**28, b"bz2")] * 40)
        self.assertLess(len(nested), 35_000)
        start = self.refused("evaluate", "ego", self.write("x.mcap", nested), self.here / "x.mcap", named="x.mcap")
        self.assertLess(start.cpu_s, 10)
        self.refused("evaluate", "ego", self.write("x.bag", files.bag(*[files.bag_chunk(zeros, 2**28, b"bz2")] * 40)), self.here / "x.bag",
                     named="x.bag")
        # Millions of records of nothing, as much as may be unpacked.
        small = files.mcap_record(0x7F, b"") * 1_600_000
        packed = files.mcap(files.mcap_chunk(bz2.compress(small, 9), len(small), b"bz2"))
        self.assertLess(self.refused("evaluate", "ego", self.write("s.mcap", packed), self.here / "s.mcap", named="s.mcap").cpu_s, 10)


class Memory(Limits):
    """Memory against the size of the file: what 100 times as much text takes on top of a small file, without the program itself."""

    def ratio(self, make, words_of, **more):
        few, many = make(200), make(20_000)
        needed = [self.good(*words_of(path), "--quiet", **more).more_mb for path in (few, many)]
        size = lambda path: sum(file.stat().st_size for file in ([path] if path.is_file() else path.iterdir())) / MB
        if not SANITIZED:
            self.assertLess(needed[1] - needed[0], TEXT_RATIO * (size(many) - size(few)))

    def bodies(self, n):
        return self.records((files.record(body=f"object:{i}", values={"distance_gt_m": 5.0, "dynamic_gt": 1.0}) for i in range(1, n)), f"run{n}")

    def test_trajectory(self):
        self.ratio(lambda n: self.trajectory(25 * n, f"{n}.tum"), lambda file: ("evaluate", "ego", file, file))

    def test_compare(self):
        self.ratio(self.bodies, lambda run: ("compare", run, run), codes=(0, 3))

    def test_report(self):
        self.ratio(self.bodies, lambda run: ("report", run, "--out", self.here / f"{run.name}-report", "--jobs", 1))

    @unittest.skipIf(SANITIZED, "sanitizers reserve more addresses than the limit")
    def test_too_little_memory_is_bad_input(self):
        file = self.trajectory(1_000_000)
        starts = lambda mb: self.program.run("options", limits=[(resource.RLIMIT_AS, mb * 10**6)]).code == 0
        needed_mb = next(mb for mb in range(300, 4000, 20) if starts(mb))
        done = self.program.run("evaluate", "ego", file, file, "--quiet", limits=[(resource.RLIMIT_AS, (needed_mb + 60) * 10**6)])
        self.assertEqual(done.code, 2, done.err)
        self.assertIn("a.tum", done.err)
        self.assertIn("memory", done.err)


class Times(Limits):
    def bodies(self, n):
        return self.records((files.record(body=f"object:{i}", values={"distance_gt_m": 5.0, "dynamic_gt": 1.0}, seed=seed)
                             for seed in (0, 1) for i in range(1, n // 2)), f"run{n}")

    def test_report_is_linear(self):
        few, many = self.bodies(1_000), self.bodies(8_000)
        used = [self.good("report", run, "--out", self.here / run.name / "r", "--no-figures", "--quiet", "--jobs", 1).cpu_s for run in (few, many)]
        self.assertLess(used[1], 8 * 3 * max(used[0], 0.05), "8 times the bodies")

    def test_json_of_many_keys(self):
        file = self.write("x.json", ["{", *(f'"key{i}":{i},' for i in range(200_000)), '"last":0}'])
        self.assertLess(self.refused("compare", "--policy", file, "--show-policy", named="key", most_mb=None).cpu_s, 20)


class Refusals(Limits):
    """Inputs that must be refused; earlier versions accepted them or ended with exit code 70."""

    def test_source_date_epoch(self):
        run = self.records([files.record(seed=seed) for seed in range(3)])
        for epoch in ("9223372036854775807", "-1", "x", "99999999999999999999", ""):
            self.refused("compare", run, run, "--out", self.here / "c", named="SOURCE_DATE_EPOCH", environment={"SOURCE_DATE_EPOCH": epoch})
        self.good("compare", run, run, "--out", self.here / "c", "--quiet", codes=(0, 3), environment={"SOURCE_DATE_EPOCH": "0"})
        self.assertIn("1970-01-01T00:00:00", (self.here / "c/junit.xml").read_text())

    def test_records(self):
        for change, named in (({"body": "object:99999999999"}, "body"),
                              ({"errors": {"Et_m": -0.1}}, "errors.Et_m"), ({"values": {"nees": 1e308}}, "values.nees"),
                              ({"time_ms": {"total": 1e308}}, "time_ms.total"), ({"level": 1e308}, "level")):
            run = self.records([files.record(), files.record(seed=1, **change)])
            for words in (("report", run), ("compare", run, run), ("trend", run, run), ("export", run, "--format", "csv", "--out", self.here / "e.csv")):
                self.refused(*words, named=f"records.jsonl:2: key '{named}'")
        self.assertEqual(list(self.here.glob("e.csv")), [])
        run = self.records([files.record(level=level, seed=seed, errors={"Et_m": 1e-320, "ER_deg": 5e-324}, bound={"Et_m": 1e-320})
                            for seed in range(3) for level in (0.1, 0.2)], "tiny")
        for words in (("report", run), ("compare", run, run), ("trend", run, run)):  # in statistics they are 0
            self.good(*words, codes=(0, 3))

    def test_benchmark_times(self):
        for time_ns in (1e308, 1e-320, -1.0):
            entry = {"name": "B", "run_type": "iteration", "cpu_time": time_ns, "real_time": 1.0, "time_unit": "ms"}
            file = self.write("benchmark.json", json.dumps({"context": {}, "benchmarks": [entry, entry]}))
            self.refused("compare", file, file, named="cpu_time")
            self.refused("trend", file, file, named="cpu_time")

    def test_numbers_of_flags(self):
        for words in (("run", "synthetic:s18@0-1", "--out", "out", "--level", "nan"), ("view", "run", "--out", "v", "--level", "inf"),
                      ("evaluate", "ego", "a", "b", "--max-difference", "-1"), ("evaluate", "ego", "a", "b", "--t-start", "nan"),
                      ("evaluate", "ego", "a", "b", "--offset", "1e999"), ("evaluate", "depth", "a", "b", "--bf", "nan")):
            done = self.refused(*words, named=words[-2])
            self.assertLess(len(done.err), 200)

    def test_trajectory_values(self):
        for value in ("+-1", "-+1", "nan", "1e400"):
            file = self.write("a.tum", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n2 %s 0 0 0 0 0 1\n" % value)
            self.refused("evaluate", "ego", file, file, "--format", "tum", named="a.tum:3")

    def test_camera(self):
        self.good("data", "make", "synthetic:s18@0-1", "--layout", "vdo", "--out", self.here / "made", "--quiet")
        camera = next((self.here / "made").rglob("camera.yaml"))
        camera.write_text(re.sub(r"Camera.fx: .*", "Camera.fx: 1e-320", camera.read_text()))
        self.refused("data", "check", f"vdo:{camera.parent}", named="Camera.fx")


class Interrupts(Limits):
    """Ctrl-C on the slowest input of each kind."""

    def soon(self, *words, after_s=1.0):
        """Interrupts a command after some time, sooner where it is so fast that it ends by itself about then."""
        while True:
            code, seconds = self.program.interrupt(*words, after_s=after_s, once_handled=True)
            if seconds is not None:
                self.assertLess(seconds, self.interrupt_s, words)
            if seconds is not None and code == 130:
                break
            self.assertIn(code, (0, 1, 2, 3), words)  # its own result
            after_s /= 2
            if after_s < 0.02:
                return
        left = list(self.program.scratch.iterdir())
        self.assertEqual(left, [], words)

    def test_image(self):
        self.good("data", "make", "synthetic:s18@0-1", "--layout", "vdo", "--out", self.here / "made", "--quiet")
        image = sorted(next((self.here / "made").rglob("image_0")).iterdir())[0]
        image.unlink()
        image.with_suffix(".jpg").write_bytes(files.progressive_jpeg(8000, 8000, 90))
        self.soon("data", "check", f"vdo:{image.parent.parent}", after_s=0.3)

    def test_trajectory(self):
        file = self.trajectory(1_500_000)
        self.soon("evaluate", "ego", file, file, "--align", "se3", "--quiet", after_s=0.5)
        self.soon("evaluate", "ego", file, file, "--align", "se3", "--quiet", after_s=2)

    def test_recording(self):
        header = files.mcap_record(3, b"\x01\x00" + files.mcap_text(b"geometry_msgs/PoseStamped") + files.mcap_text(b"ros1msg") + files.mcap_text(b""))
        channel = files.mcap_record(4, b"\x01\x00\x01\x00" + files.mcap_text(b"/p") + files.mcap_text(b"ros1") + bytes(4))
        first, last = files.mcap(header, channel, b"@").split(b"@")
        self.write("x.mcap", [first, *[files.mcap_record(0x7F, b"") * 100_000] * 200, last])
        self.soon("evaluate", "ego", self.here / "x.mcap", self.here / "x.mcap", after_s=0.2)

    def test_report(self):
        run = self.records(files.record(body=f"object:{i}", level=level, noise=f"n{level}", values={"distance_gt_m": 5.0, "dynamic_gt": 1.0})
                           for level in (0.1, 0.2) for i in range(1, 60_000))
        self.soon("report", run, "--out", self.here / "r", "--quiet")
        self.soon("compare", run, run, "--quiet")

    def test_run(self):
        self.soon("run", "synthetic:city", "--out", self.here / "out", "--quiet")


class Streams(Limits):
    def exit_code(self, closed, *words, preload=""):
        """Exit code of a command that is started with the descriptors `closed`, for example "012", closed."""
        environment = {**self.program.environment, **({"LD_PRELOAD": preload} if preload else {})}
        return subprocess.run([self.program.file, *map(str, words)], preexec_fn=lambda: [os.close(int(n)) for n in closed],
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment,
                              cwd=self.here, check=False, timeout=BUSY * 120).returncode

    def test_closed_streams_of_every_command(self):
        run = self.records([files.record(seed=seed) for seed in range(3)])
        real = [["compare", run, run], ["export", run, "--format", "csv", "--out", self.here / "e.csv"], ["trend", run, run], ["options"],
                ["evaluate", "ego", self.trajectory(20), self.here / "a.tum"],
                ["baseline", "update", run, self.here / "b"], ["run", "synthetic:s18@0-1", "--out", self.here / "o", "--force"]]
        commands = self.program.commands()
        for words in [*commands, *([*words, "--no-such-flag"] for words in commands), *real]:
            wanted = self.exit_code("", *words)
            self.assertIn(wanted, (0, 2, 3), words)
            for closed in ("012", "2", "1") if words in real else ("012",):
                self.assertEqual(self.exit_code(closed, *words), wanted, (words, closed))

    @unittest.skipIf(SANITIZED or not OPENS_FILES_EARLY, "needs the library that opens files early, and no sanitizer")
    def test_a_library_that_opens_files_before_main(self):
        for closed in ("012", "2", "1"):
            for words, wanted in (["options"], 0), (["options", "--no-such-flag"], 2):
                self.assertEqual(self.exit_code(closed, *words, preload=OPENS_FILES_EARLY), wanted, (words, closed))

    def test_full_standard_error(self):
        with open("/dev/full", "wb") as full:
            done = subprocess.run([self.program.file, "evaluate", "ego", "a", "b"], stderr=full, stdout=full, check=False)
        self.assertEqual(done.returncode, 2)


class Printed(Limits):
    """Labels of untrusted records in tables, pages, LaTeX and CSV."""

    def report(self, **labels):
        run = self.records((files.record(seed=seed, level=level, noise=f"depth {level}", **{**labels, "values": {"nees": 5.0, "step_gt_m": 0.6}})
                            for level in (0.1, 0.2) for seed in range(3)), "labels")
        out = self.here / "report"
        shutil.rmtree(out, ignore_errors=True)
        output = self.good("report", run, "--out", out)
        self.assertEqual(printed_faults(out), "")
        return out, output.out

    def test_latex(self):
        for label in ("[5cm] x", "[p] x", "*x", "[5cm]"):
            out, _ = self.report(dataset=label, sequence=label, estimator=label)
            for tex in out.rglob("*.tex"):
                lines = tex.read_text().splitlines()
                for before, line in zip(lines, lines[1:]):
                    if before.endswith("\\\\") or before.endswith("rule"):
                        self.assertFalse(line.lstrip().startswith(("[", "*")), f"{tex.name}: {line}")

    def test_csv(self):
        for label in ("=HYPERLINK(1)", "+1+1", "@SUM(1)", "-2+3", "\t=1"):
            out, _ = self.report(estimator=label, dataset=label)
            csv = (out / "tables/noise_levels.csv").read_text()
            self.assertIn("\"'" + label, csv)
            run = self.records([files.record(estimator=label)])
            self.good("export", run, "--format", "csv", "--out", self.here / "e.csv")
            self.assertIn("\"'" + label, (self.here / "e.csv").read_text())
        self.report(estimator="-5")  # a number stays one
        self.assertNotIn("'-5", (self.here / "report/tables/noise_levels.csv").read_text())

    def test_directions(self):
        for sign in ("\u202a", "\u202e", "\u2066", "\u2069"):
            _, output = self.report(estimator=f"a{sign}b")
            self.assertIn(f"aU+{ord(sign):04X}b", output)
            run = self.records([files.record(estimator=f"a{sign}b")])
            self.assertIn(f"\\u{ord(sign):04X}", self.good("report", run, "--json").out)

    def test_long_labels(self):
        for label in ("x" * 200, "é" * 120, "y" * 255):
            out, _ = self.report(dataset=label, sequence=label, estimator=label)
            self.assertTrue(list(out.rglob("*.svg")))
            self.assertLess(max(len(path.name.encode()) for path in out.rglob("*")), 220)


def main():
    arguments = sys.argv[1:]
    if not arguments or arguments[0] in ("-h", "--help"):
        print(__doc__.strip())
        return 0 if arguments else 1
    Limits.file = pathlib.Path(arguments.pop(0)).resolve()
    if "--interrupt-s" in arguments:
        at = arguments.index("--interrupt-s")
        Limits.interrupt_s = float(arguments[at + 1])
        del arguments[at:at + 2]
    start = time.monotonic()
    program = unittest.main(argv=["limits_test", *arguments], exit=False)
    print(f"{time.monotonic() - start:.0f} s")
    return 0 if program.result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
