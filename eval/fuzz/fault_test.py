#!/usr/bin/env python3
"""usage: eval/fuzz/fault_test.py [--minutes N] [--seed N] [--only NAME] [--kills N] [--reproduce N] [--program FILE] [--keep]

Kills runs, fills disks, damages journals and correspondence caches, and compares the final files with those of an
undisturbed run, byte by byte. Only the times in records may differ.

  --minutes N    duration; rounds of every fault are repeated until it is over, each at least once (2)
  --seed N       seed of the moments and places of faults (0)
  --only NAME    one kind of fault: kill, merge, pack, hosts, node, refused, interrupt, journal, packs, disk, scratch,
                 report, make, output
  --kills N      instead: kill -9 of sweep, of merge and of writing the cache, N times each at random moments; with
                 --only kill, merge or pack only one of these
  --reproduce N  instead: `sextant reproduce` killed N times, then compared; takes N times half a minute
  --program FILE the sextant program (build/release/bin/sextant)
  --keep         leave the working folder

Full disks are file systems of a few hundred kB in memory, which needs root; without it those faults are skipped with a
message. Exit codes: 0 no difference, 1 something differed, 2 usage.
"""

import collections
import contextlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from program_testing import ROOT, options, working_folder
from shard_faults_testing import Broken, ShardFaults, compare, contents

PLAN = {
    "name": "faults",
    "sources": ["synthetic:s18@0-3"],
    "estimators": ["motion_only", "joint_flow"],
    "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2, 0.4]},
    "seeds": 10,
    "options": {"pipeline": {"max_object_distance_m": 35, "min_object_area": 0.002}},
}
# Files of `sextant reproduce` that contain times as well as results; every byte of all other files is compared.
HOLDS_TIMES = re.compile(r"^report/((report|details|paper)\.(html|md)|tables/(table_7_run_time|claims)\.\w+)$")

class Faults(ShardFaults):
    def __init__(self, program, work, dice):
        self.program, self.work, self.dice = program, work, dice
        self.root, self.source = ROOT, PLAN["sources"][0]
        self.plans = {keep: work / f"plan-{keep}.json" for keep in ("records", "summary")}
        for keep, file in self.plans.items():
            file.write_text(json.dumps({**PLAN, "keep": keep}), encoding="utf-8")
        self.cache = work / "cache"
        self.sharded = {}
        self.skipped = set()
        self.mounts = []

    def command(self, *words):
        return [str(self.program), *map(str, words)]

    def sweep_words(self, out, keep="records"):
        return self.command("sweep", self.plans[keep], "--out", out, "--cache", self.cache, "--jobs", 2, "--quiet")

    def run(self, words, expected=(0,), **more):
        done = subprocess.run(words, capture_output=True, text=True, errors="replace", **more)
        if done.returncode not in expected:
            raise Broken(f"{' '.join(words[1:])}: exit {done.returncode}: {done.stderr.strip()[-300:]}")
        return done

    def stop(self, words, after_s, with_signal=signal.SIGKILL):
        """Ends the command after a while. Returns true if it had not ended by itself."""
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            process.wait(after_s)
            return False
        except subprocess.TimeoutExpired:
            process.send_signal(with_signal)
            process.wait(60)
            return True

    def stop_at(self, words, folder, pattern):
        """Kills the command when a file of this pattern appears. Returns true if it had not ended by itself."""
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while process.poll() is None and not any(folder.glob(pattern)):
            pass
        process.kill()
        return process.wait(60) == -signal.SIGKILL

    def prepare(self):
        out = self.work / "whole"
        start = time.monotonic()
        self.run(self.sweep_words(out))  # also writes the correspondence cache
        shutil.rmtree(out)
        start = time.monotonic()
        self.run(self.sweep_words(out))
        self.sweep_s = time.monotonic() - start
        self.whole = {"records": contents(out)}
        self.run(self.sweep_words(self.work / "sums", "summary"))
        self.whole["summary"] = contents(self.work / "sums")
        self.report_words = lambda to: self.command("report", out, "--out", to, "--quiet", "--jobs", 2)
        start = time.monotonic()
        self.run(self.report_words(self.work / "report"))
        self.report_s = time.monotonic() - start
        self.report_files = contents(self.work / "report")
        self.make_words = lambda to: self.command("data", "make", "s18@0-3", "--layout", "vdo", "--out", to,
                                                  "--sequence", "s18", "--quiet")
        start = time.monotonic()
        self.run(self.make_words(self.work / "made"))
        self.make_s = time.monotonic() - start
        self.made = contents(self.work / "made")

    def fresh(self, name):
        folder = self.work / name
        shutil.rmtree(folder, ignore_errors=True)
        return folder

    def interrupted_sweep(self, out, with_signal=signal.SIGKILL, at_most=20):
        """Stops a sweep at random moments, until it ends by itself or was stopped `at_most` times. Returns how often."""
        n = 0
        while n < at_most and self.stop(self.sweep_words(out), self.dice.uniform(0.02, 0.5 * self.sweep_s), with_signal):
            n += 1
        return n

    def end_sweep(self, out, what):
        self.run(self.sweep_words(out))
        compare(contents(out), self.whole["records"], what)

    # ---- the faults; each returns what it did, in a few words

    def interrupt(self):
        out = self.fresh("interrupted")
        n = self.interrupted_sweep(out, signal.SIGINT, at_most=4)
        self.end_sweep(out, "sweep after Ctrl-C")
        return f"{n} interrupts"

    def unfinished(self, out):
        """Returns the journal of a sweep that was killed in the middle; None if the sweep was always too fast."""
        for _ in range(20):
            self.stop(self.sweep_words(out), self.dice.uniform(0.3, 0.9) * self.sweep_s)
            journal = out / "journal.jsonl"
            if journal.exists() and journal.stat().st_size > 2000:
                return journal
            shutil.rmtree(out, ignore_errors=True)
        return None

    def journal(self):
        kinds = collections.Counter()
        for kind in ("flip", "cut", "garbage", "again", "renumber", "zeros"):
            out = self.fresh("journal")
            path = self.unfinished(out)
            if path is None:
                return "too fast"
            data = bytearray(path.read_bytes())
            if kind == "flip":
                for _ in range(5):
                    data[self.dice.randrange(len(data))] ^= 1 << self.dice.randrange(8)
            elif kind == "cut":
                del data[self.dice.randrange(len(data)):]
            elif kind == "garbage":
                data += bytes(self.dice.randrange(256) for _ in range(300))
            elif kind == "again":
                data += data[: data.find(b'{"case"', 1)]
            elif kind == "renumber":
                data = bytearray(re.sub(rb'^\{"case":\d+', b'{"case":%d' % self.dice.randrange(60), bytes(data), count=1))
            else:  # what a power cut leaves of a block that was not durable
                data += bytes(4096)
            path.write_bytes(data)
            self.end_sweep(out, f"sweep after a damaged journal ({kind})")
            kinds[kind] += 1
        return f"{sum(kinds.values())} damaged journals"

    def packs(self):
        for path in sorted(self.cache.iterdir()):
            data = bytearray(path.read_bytes())
            data[self.dice.randrange(len(data))] ^= 1 << self.dice.randrange(8)
            path.write_bytes(data)
        self.end_sweep(self.fresh("packs"), "sweep after damaged packs")
        return "every file of the cache damaged"

    def mount(self, kilobytes):
        """Returns the folder of a file system of that size; None without the right to mount one."""
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.work, prefix="disk-"))
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", folder], capture_output=True)
        if done.returncode != 0:
            folder.rmdir()
            self.skipped.add("full disks: no right to mount a small file system")
            return None
        self.mounts.append(folder)
        return folder

    def unmount(self, folder):
        subprocess.run(["umount", folder], capture_output=True, check=False)
        self.mounts.remove(folder)

    def disk(self):
        whole = self.whole["records"]
        total = sum(map(len, whole.values())) // 1024
        disk = self.mount(self.dice.randrange(8, total * 2))
        if disk is None:
            return "skipped"
        try:
            full = 0
            out = disk / "sweep"
            for kilobytes in (None, self.dice.randrange(total // 2, total * 2), 10 * total):
                if kilobytes:
                    self.run(["mount", "-o", f"remount,size={max(kilobytes, 64)}k", str(disk)], (0, 1, 32))
                done = self.run(self.sweep_words(out), (0, 2))
                full += done.returncode == 2
                if done.returncode == 2 and "No space left" not in done.stderr:
                    raise Broken(f"sweep on a full disk says: {done.stderr.strip()}")
                final = {name: data for name, data in contents(out).items() if name != "journal.jsonl"} if out.exists() else {}
                compare(final, whole, "sweep on a full disk", may_lack=True)
            compare(contents(out), whole, "sweep after a full disk")
            return f"{full} times full"
        finally:
            self.unmount(disk)

    def scratch(self):
        """Figures are drawn in TMPDIR, and gnuplot does not notice that it is full."""
        disk = self.mount(self.dice.choice([16, 24, 32, 48, 64, 96, 128, 192, 256, 400]))
        if disk is None:
            return "skipped"
        try:
            out = self.fresh("scratch")
            done = self.run(self.report_words(out), (0, 2), env={**os.environ, "TMPDIR": str(disk)})
            compare(contents(out) if out.exists() else {}, self.report_files if done.returncode == 0 else {},
                    "report on a full scratch disk")
            if done.returncode == 2 and "full" not in done.stderr and "No space" not in done.stderr:
                raise Broken(f"report on a full scratch disk says: {done.stderr.strip()}")
            return f"exit {done.returncode}"
        finally:
            self.unmount(disk)

    def report(self):
        out = self.fresh("report-killed")
        n = 0
        while n < 5 and self.stop(self.report_words(out), self.dice.uniform(0.02, self.report_s)):
            n += 1
            left = {k: v for k, v in contents(out).items() if not k.startswith(".incomplete/")} if out.exists() else {}
            compare(left, self.report_files, "report after kill -9", may_lack=True)
        self.run(self.report_words(out))
        compare(contents(out), self.report_files, "report after kill -9")
        return f"{n} kills"

    def make(self):
        for _ in range(5):
            out = self.fresh("made-killed")
            late = self.dice.random() < 0.5  # while its files move into place
            if not (self.stop_at(self.make_words(out), out, ".sextant_incomplete_*/.complete") if late else
                    self.stop(self.make_words(out), self.dice.uniform(0.02, self.make_s))):
                continue
            if contents(out) == self.made:
                continue  # nothing was left to do
            self.run(self.make_words(out))
            compare(contents(out), self.made, "data make after kill -9")
            return "1 kill while files move" if late else "1 kill"
        return "too fast"

    def output(self):
        words = self.command("report", self.work / "whole", "--json", "--quiet")
        with open("/dev/full", "w", encoding="utf-8") as full:
            done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode != 2 or "standard output" not in done.stderr:
            raise Broken(f"report --json > /dev/full: exit {done.returncode}: {done.stderr.strip()}")
        return "/dev/full"


KINDS = ("kill", "merge", "pack", "hosts", "node", "refused", "journal", "packs", "disk", "scratch", "report", "make", "interrupt", "output")


def reproduce(faults, n_kills):
    """Runs `sextant reproduce` undisturbed, then killed again and again, and compares the files."""
    words = lambda to: faults.command("reproduce", "--out", to, "--cache", faults.cache, "--quiet")
    environment = {k: v for k, v in os.environ.items() if k != "SEXTANT_DATA"}
    os.environ.clear()
    os.environ.update(environment)
    whole, killed = faults.work / "reproduce", faults.work / "reproduce-killed"
    start = time.monotonic()
    faults.run(words(whole))
    seconds = time.monotonic() - start
    print(f"undisturbed: {seconds:.0f} s", flush=True)
    n = 0
    for _ in range(n_kills):
        n += faults.stop(words(killed), faults.dice.uniform(0.02, 2 * seconds / n_kills))
    faults.run(words(killed))
    wanted, found = contents(whole), contents(killed)
    with_times = sorted(name for name in wanted if HOLDS_TIMES.match(name))
    compare(found, wanted, "reproduce after kill -9", skip=HOLDS_TIMES)
    print(f"held: {len(wanted)} files after {n} kills; not compared, because they contain times: {', '.join(with_times)}")


def try_all(faults, kinds, end):
    """Tries each kind of fault at least once, and again until the time is over."""
    done = collections.Counter()
    while not done or time.monotonic() < end:
        for kind in kinds:
            if done[kind] > 0 and time.monotonic() > end:
                break
            summary = getattr(faults, kind)()
            done[kind] += 1
            if done[kind] == 1:
                print(f"{kind:<10} {summary}", flush=True)
    print("held: " + ", ".join(f"{kind} x {n}" for kind, n in done.items()))
    for what in sorted(faults.skipped):
        print(f"skipped: {what}")


def main():
    arguments = options(__doc__, KINDS, 2, kills=0, reproduce=0)
    end = time.monotonic() + 60 * arguments.minutes
    with contextlib.ExitStack() as stack:
        work = stack.enter_context(working_folder("faults", arguments.keep))
        faults = Faults(arguments.program, work, random.Random(arguments.seed))
        stack.callback(lambda: [faults.unmount(folder) for folder in list(faults.mounts)])
        try:
            if arguments.reproduce:
                reproduce(faults, arguments.reproduce)
                return 0
            faults.prepare()
            if arguments.kills:
                for kind in (faults.kill, faults.merge, faults.pack):
                    if arguments.only in (None, kind.__name__):
                        print(kind(arguments.kills), flush=True)
                print("held")
                return 0
            try_all(faults, [arguments.only] if arguments.only else KINDS, end)
            return 0
        except Broken as broken:
            print(f"BROKEN: {broken}")
            return 1


if __name__ == "__main__":
    sys.exit(main())
