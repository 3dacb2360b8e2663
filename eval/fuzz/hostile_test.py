#!/usr/bin/env python3
"""usage: eval/fuzz/hostile_test.py [--minutes N] [--seed N] [--only KIND] [--count N] [--case I] [--program FILE] [--keep]

Feeds the program hostile input of eight kinds and prints, by kind, the number of cases and in how many the program held: it
ended with a documented exit code and a reason, within its limits of memory and time (docs/security.md), and left only the files
that it should.

  json     JSON files of which one value, or some bytes, are hostile
  records  forged records.jsonl through report, compare, trend and export; then what these have written
  headers  images and recordings of few bytes whose headers claim a large size, also damaged ones
  disk     files that may not grow beyond some size (RLIMIT_FSIZE), at every write
  closed   every command with some of standard input, output and error closed
  links    links to other places where a command writes
  two      two commands into one folder at the same time
  signals  SIGINT and SIGTERM at any moment

  --minutes N    for all kinds together (1); each is tried once at least
  --seed N       case I of a kind is the same for the same seed (0)
  --only KIND    this kind alone
  --count N      number of cases of each kind, in place of --minutes
  --case I       with --only: case I alone
  --program FILE the sextant program (build/release/bin/sextant)
  --keep         leave the working folder

Exit codes: 0 all held, 1 some did not, 2 usage.
"""

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time

import hostile_files_testing as files
from program_testing import BUSY, REFUSED_MB, SANITIZED, Program, contents, options, printed_faults, working_folder

PLAN = {"name": "hostile", "sources": ["synthetic:s18@0-1"], "estimators": ["motion_only", "joint_flow"],
        "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2]}, "seeds": 2,
        "options": {"pipeline": {"max_object_distance_m": 35}}}
BENCHMARK = {"context": {"executable": "bench", "num_cpus": 2},
             "benchmarks": [{"name": f"B{i}", "run_name": "B", "run_type": "iteration", "repetitions": 2, "cpu_time": 10.0 + i,
                             "real_time": 11.0 + i, "time_unit": "ns"} for i in range(2)]}
POLICY = {"accuracy": {"alpha": 0.05, "replicates": 200}, "speed": {"minimum_effect": 0.05}, "same": {"data": "note"}}
EXTERNAL = {"name": "other", "command": ["./estimate"], "time_limit_s": 5}
CASE_TIME_S = 60
INTERRUPT_S = 1.0
#: Files that an unfinished command leaves, from which the same command continues.
RESUMED = ("unfinished.jsonl", "journal.jsonl")


class Hostile:
    def __init__(self, file, work, interrupt_s):
        self.work = work
        self.program = Program(file, work)
        self.interrupt_s = interrupt_s
        self.run_words = ["run", "synthetic:s18@0-1", "--quiet", "--jobs", 1, "--out"]
        self.good = work / "good"
        self.must(*self.run_words, self.good)
        self.records = (self.good / "records.jsonl").read_text(encoding="utf-8").splitlines()
        self.run_json = json.loads((self.good / "run.json").read_text(encoding="utf-8"))
        for path in self.program.scratch.iterdir():
            raise SystemExit(f"eval/fuzz/hostile_test.py: {path} was left in the temporary folder by a good run")

    def must(self, *words):
        done = self.program.run(*words, time_limit_s=600)
        if done.code != 0:
            raise SystemExit(f"eval/fuzz/hostile_test.py: {' '.join(map(str, words))}: exit {done.code}: {done.err}")
        return done

    def folder(self, name):
        shutil.rmtree(self.work / name, ignore_errors=True)
        (self.work / name).mkdir()
        return self.work / name

    def tried(self, *words, most_mb=None, codes=(0, 1, 2, 3)):
        done = self.program.run(*words, time_limit_s=CASE_TIME_S)
        fault = done.fault(codes, most_mb)
        return f"{' '.join(map(str, words))}: {fault}" if fault else ""

    # ---- the kinds: each makes a case from the dice, and returns what did not hold

    def json(self, dice):
        here = self.folder("json")
        file = here / "x.json"
        what = dice.choice(["plan", "options", "policy", "external", "benchmark", "run"])
        if what == "run":
            run = self.folder("forged-run")
            shutil.copy(self.good / "records.jsonl", run)
            (run / "run.json").write_bytes(files.mutated_json(self.run_json, dice))
            return self.tried(*dice.choice([("report", run), ("compare", run, self.good), ("trend", run, self.good), ("export", run, "--format", "csv", "--out", here / "e.csv")]))
        tree = {"plan": PLAN, "options": {"pipeline": {"max_object_distance_m": 30}, "estimator": {}}, "policy": POLICY,
                "external": EXTERNAL, "benchmark": BENCHMARK}[what]
        file.write_bytes(files.mutated_json(tree, dice))
        return self.tried(*{"plan": ("sweep", file, "--dry-run", "--out", here / "out"),
                            "options": ("overlay", "synthetic:s18@0-1", "--frame", 1, "--options", f"@{file}", "--out", here / "o.png"),
                            "policy": ("compare", "--policy", file, "--show-policy"),
                            "external": ("sweep", self.plan_of(here, file), "--dry-run", "--out", here / "out"),
                            "benchmark": ("compare", file, file, "--out", here / "c")}[what]) or printed_faults(here / "c")

    def plan_of(self, folder, external):
        plan = folder / "plan.json"
        plan.write_text(json.dumps({**PLAN, "estimators": [f"external:{external}"]}), encoding="utf-8")
        return plan

    def records_(self, dice):
        run = self.folder("forged")
        lines = []
        for _ in range(dice.randrange(1, 5)):
            content = json.loads(dice.choice(self.records)) if dice.random() < 0.7 else files.record()
            for _ in range(dice.randrange(1, 4)):
                content = files.replaced(content, dice.choice(list(files.nodes(content))), files.hostile_value(dice))
            lines.append(files.record_line(content).replace(json.dumps(files.DEEP), "[" * 200 + "]" * 200))
        if dice.random() < 0.5:  # labels of others, which are good records
            label = dice.choice([text for text in files.HOSTILE_TEXTS if text])
            key = dice.choice(["dataset", "sequence", "estimator", "noise"])
            lines = [files.record_line({**json.loads(line), key: label, "level": level, "seed": seed}) for line in self.records
                     for level in (0.1, 0.2) for seed in (0, 1)]
        (run / "records.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8", errors="surrogatepass")
        out = self.folder("forged-out")
        words = dice.choice([("report", run, "--out", out / "r", "--quiet"), ("report", run), ("compare", run, run, "--out", out / "c"),
                             ("trend", run, run), ("export", run, "--format", "csv", "--out", out / "e.csv"),
                             ("export", run, "--format", "sqlite", "--out", out / "e.db"), ("compare", self.good, run)])
        return self.tried(*words) or printed_faults(out)

    def headers(self, dice):
        here = self.folder("headers")
        size = lambda: dice.choice([1, 2, 100, 4000, 11585, 40000, 65500, 10**6, 2**31 - 1])
        kind = dice.choice(["png", "png16", "rgb16", "bomb", "jpeg", "flo", "mask", "mcap", "bag", "tum"])
        name, data, words = here / "x.png", b"", None
        depth = ("evaluate", "depth", name, name, "--est-format", "depth256", "--gt-format", "depth256")
        flow = ("evaluate", "flow", name, name, "--est-format", "kitti", "--gt-format", "kitti")
        if kind == "png":
            data, words = files.png(min(size(), 2**31 - 1), size(), depth=16, claimed_bytes=dice.randrange(20)), depth
        elif kind == "png16":
            data, words = files.png(size(), size(), depth=16, rows=bytes(dice.randrange(1000))), depth
        elif kind == "rgb16":
            data, words = files.png(size(), size(), depth=16, colour=2, claimed_bytes=dice.randrange(1000)), flow
        elif kind == "bomb":
            data, words = files.png_of_zeros(dice.choice([3000, 6000, 9000]), dice.choice([3000, 6000, 9000])), depth
        elif kind == "jpeg":
            folder = self.vdo(here)
            data = files.jpeg(min(size(), 65500), min(size(), 65500), progressive=dice.random() < 0.5)
            (folder / "image_0" / "000000.jpg").write_bytes(data)
            (folder / "image_0" / "000000.png").unlink()
            return self.tried("data", "check", f"vdo:{folder}", most_mb=self.most_mb(len(data)))
        elif kind == "flo":
            name = here / "x.flo"
            data, words = files.flo(dice.choice([-1, 0, size()]), size(), dice.randrange(100)), ("evaluate", "flow", name, name)
        elif kind == "mask":
            folder = self.vdo(here)
            data = files.mask_text(dice.choice([10, 1000, 100000]), dice.choice([10, 1000, 100000]))
            (folder / "semantic" / "000000.txt").write_bytes(data)
            return self.tried("data", "check", f"vdo:{folder}", most_mb=self.most_mb(len(data)))
        elif kind == "mcap":
            name = here / "x.mcap"
            claims = dice.choice([0, 10**6, 2**28, 2**28 + 1, 2**40, 2**63])
            data = files.mcap(files.mcap_chunk(dice.randbytes(100), claims, dice.choice([b"", b"lz4", b"zstd", b"bz2", b"what"])))
            words = ("evaluate", "ego", name, name)
        elif kind == "bag":
            name = here / "x.bag"
            claims = dice.choice([0, 10**6, 2**28, 2**28 + 1, 2**32 - 1])
            data = files.bag(files.bag_chunk(dice.randbytes(100), claims, dice.choice([b"none", b"lz4", b"bz2", b"what"])))
            words = ("evaluate", "ego", name, name)
        else:
            name = here / "x.tum"
            text = "".join(files.tum_line(i) for i in range(5))
            at = dice.randrange(len(text))
            data = (text[:at] + dice.choice(["+-1 ", "nan", "1e400", "\0", "0x1p3", "é", " ", "-", "1e-320", "9" * 400]) + text[at:]).encode()
            words = ("evaluate", "ego", name, name, "--format", "tum")
        if dice.random() < 0.3 and len(data) > 40:
            data = bytearray(data)
            data[dice.randrange(len(data))] = dice.randrange(256)
        name.write_bytes(bytes(data))
        return self.tried(*words, most_mb=self.most_mb(len(data), n_files=max(1, words.count(name))))

    @staticmethod
    def most_mb(n_bytes, n_files=1):
        return n_files * max(REFUSED_MB, 200 * n_bytes / 1e6)

    def vdo(self, here):
        """A small folder of the layout vdo, made once."""
        made = self.work / "vdo"
        if not made.exists():
            self.must("data", "make", "synthetic:s18@0-1", "--layout", "vdo", "--out", made, "--quiet")
        source = next(path.parent for path in made.rglob("image_0"))
        shutil.copytree(source, here / "vdo")
        return here / "vdo"

    def writing_commands(self, out):
        return [(*self.run_words, out / "o"), ("report", self.good, "--quiet", "--out", out / "o"),
                ("export", self.good, "--format", "csv", "--out", out / "o.csv"), ("export", self.good, "--format", "npz", "--out", out / "o.npz"),
                ("export", self.good, "--format", "sqlite", "--out", out / "o.db"), ("compare", self.good, self.good, "--quiet", "--out", out / "o"),
                ("trend", self.good, self.good, "--quiet", "--out", out / "o.html"), ("man", "--out", out / "o"),
                ("overlay", "synthetic:s18@0-1", "--frame", 1, "--out", out / "o.png"),
                ("data", "make", "synthetic:s18@0-1", "--layout", "vdo", "--quiet", "--out", out / "o")]

    def disk(self, dice):
        out = self.folder("disk")
        words = dice.choice(self.writing_commands(out))
        smallest = 1 if SANITIZED else 0  # the thread sanitizer itself writes a file when a program starts
        limit = dice.choice([smallest, 1, 100, 4096, dice.randrange(1, 300_000)])
        done = self.program.run(*words, limits=[(resource.RLIMIT_FSIZE, limit)], time_limit_s=CASE_TIME_S)
        fault = done.fault((0, 2))
        # Standard error is a file here too: where nothing may be written, its reason is lost.
        if fault.startswith("exit 2 without a reason") and limit < 400:
            fault = ""
        left = [name for name in contents(out) if not name.endswith(RESUMED) and ".incomplete" not in name] if done.code == 2 else []
        if not fault and left:
            fault = f"failed, and left {left[:3]}"
        return f"{' '.join(map(str, words))} with files of at most {limit} bytes: {fault}" if fault else ""

    def closed(self, dice):
        if not hasattr(self, "tree"):
            self.tree = self.program.commands()
        out = self.folder("closed")
        words = [*dice.choice(self.tree), *dice.choice([[], ["--help"], ["--no-such-flag"], ["x", "y"]])]
        if dice.random() < 0.4:
            words = list(dice.choice(self.writing_commands(out)))
        streams = dice.choice([(0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)])
        run = lambda close: subprocess.run([self.program.file, *map(str, words)], preexec_fn=lambda: [os.close(n) for n in close],
            env=self.program.environment, cwd=self.work, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, timeout=BUSY * CASE_TIME_S, check=False).returncode
        wanted = run(())
        shutil.rmtree(out)
        out.mkdir()
        got = run(streams)
        return "" if got == wanted else f"{' '.join(map(str, words))} with {streams} closed: exit {got}, else {wanted}"

    def links(self, dice):
        out, outside = self.folder("links"), self.folder("outside")
        words = dice.choice(self.writing_commands(out))
        first = self.program.run(*words, time_limit_s=CASE_TIME_S)
        if first.code not in (0, 1, 3):
            return f"{' '.join(map(str, words))}: exit {first.code}: {first.err.strip()}"
        # The folder that the user names may be a link of the user's, which is followed; whatever lies in it may not.
        places = [path for path in sorted(out.rglob("*")) if not path.is_symlink() and not (path.parent == out and path.is_dir())]
        place = dice.choice(places)
        target = outside / "target"
        if place.is_dir():
            shutil.copytree(place, target)
            shutil.rmtree(place)
        else:
            target.write_text("mine", encoding="utf-8")
            place.unlink()
        place.symlink_to(target)
        before = contents(outside)
        done = self.program.run(*words, time_limit_s=CASE_TIME_S)
        fault = done.fault((0, 1, 2, 3))
        if not fault and contents(outside) != before:
            fault = f"wrote through the link {place.relative_to(out)}"
        return f"{' '.join(map(str, words))}: {fault}" if fault else ""

    def two(self, dice):
        other = self.work / "other"
        if not other.exists():
            self.must("run", "synthetic:s18@0-2", "--quiet", "--jobs", 1, "--estimator", "motion_only", "--out", other)
        out = self.folder("two")
        command = dice.choice([lambda run: ("report", run, "--no-figures", "--quiet", "--out", out / "o"),
                               lambda run: ("export", run, "--format", "csv", "--out", out / "o.csv"),
                               lambda run: ("compare", run, run, "--quiet", "--out", out / "o")])
        whole = []
        for run in (self.good, other):
            self.must(*command(run))
            whole.append(without_times(contents(out)))
            shutil.rmtree(out)
            out.mkdir()
        both = [self.program.start(*command(run), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for run in (self.good, other)]
        codes = [process.wait(CASE_TIME_S) for process in both]
        if not set(codes) <= {0, 2} or codes == [2, 2]:
            return f"{' '.join(map(str, command('A')))} twice at once: exit {codes}"
        left = {name: data for name, data in contents(out).items() if ".lock" not in name}
        return "" if without_times(left) in whole else f"{' '.join(map(str, command('A')))} twice at once: a mixture is left, exit {codes}"

    def signals(self, dice):
        out = self.folder("signals")
        words = dice.choice([*self.writing_commands(out), ("run", "synthetic:s18", "--quiet", "--out", out / "o"),
                             ("evaluate", "ego", self.long_path(), self.long_path(), "--align", "se3", "--quiet")])
        code, seconds = self.program.interrupt(*words, after_s=dice.uniform(0.005, 1.0),
                                               with_signal=dice.choice([signal.SIGINT, signal.SIGTERM]))
        what = " ".join(map(str, words))
        if seconds is None:
            return "" if code == 0 else f"{what}: exit {code} without a signal"
        if seconds > self.interrupt_s:
            return f"{what}: ended {seconds:.2f} s after the signal"
        # Before the handler is there, the signal ends the program at once.
        if code not in (0, 130, -signal.SIGINT, -signal.SIGTERM):
            return f"{what}: exit {code} after the signal"
        left = [path.name for path in self.program.scratch.iterdir()]
        for path in self.program.scratch.iterdir():
            shutil.rmtree(path, ignore_errors=True)
        return f"{what}: left {left} in the temporary folder" if left else ""

    def long_path(self):
        path = self.work / "long.tum"
        if not path.exists():
            path.write_text("".join(files.tum_line(i) for i in range(200_000)), encoding="utf-8")
        return path


def without_times(left):
    """Pages hold the time at which they were written."""
    return {name: data for name, data in left.items() if not name.endswith((".xml", ".html", ".md"))}


KINDS = {"json": Hostile.json, "records": Hostile.records_, "headers": Hostile.headers, "disk": Hostile.disk, "closed": Hostile.closed,
         "links": Hostile.links, "two": Hostile.two, "signals": Hostile.signals}


def main():
    arguments = options(__doc__, KINDS, 1, count=None, case=None, interrupt_s=INTERRUPT_S)
    kinds = [arguments.only] if arguments.only else list(KINDS)
    all_held = True
    with working_folder("hostile", arguments.keep) as work:
        hostile = Hostile(arguments.program, work, arguments.interrupt_s)
        print(f"{'kind':<10} {'tried':>6} {'held':>6}")
        for kind in kinds:
            end = time.monotonic() + 60 * arguments.minutes / len(kinds)
            first = arguments.case or 0
            tried, faults = 0, []
            while tried == 0 or (arguments.case is None and
                                 (tried < arguments.count if arguments.count else time.monotonic() < end)):
                at = first + tried
                fault = KINDS[kind](hostile, random.Random(f"{arguments.seed}/{kind}/{at}"))
                tried += 1
                if fault:
                    faults.append(f"  --only {kind} --seed {arguments.seed} --case {at}: {fault}")
            print(f"{kind:<10} {tried:>6} {tried - len(faults):>6}", flush=True)
            for line in faults[:10]:
                print(line.encode(errors="backslashreplace").decode(), flush=True)
            all_held = all_held and not faults
    return 0 if all_held else 1


if __name__ == "__main__":
    sys.exit(main())
