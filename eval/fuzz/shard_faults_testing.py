"""Faults of sweeps in shards, for fault_test.py: kills at random moments, two hosts, a full disk on one of several
nodes, and input that must be refused."""

import collections
import hashlib
import json
import os
import re
import shutil
import subprocess
import time

import program_testing

N_SHARDS = 4


class Broken(Exception):
    """Raised when the files differ from those of an undisturbed run."""


TIMES = re.compile(rb'"time_ms":\{[^}]*\}|"wall_time_s": [^,]*')


def contents(folder):
    """Returns {path: bytes} of a folder; records and run.json without their times, and no bytes of a PDF whose date of making
    Cairo has compressed (Ubuntu 24.04)."""
    def without_times(name, data):
        if name.endswith(".pdf") and b"/ObjStm" in data:
            return b""
        return TIMES.sub(b"", data) if name in ("records.jsonl", "run.json") else data

    return program_testing.contents(folder, without_times)


def compare(found, wanted, what, may_lack=False, skip=None):
    """Raises Broken unless the files are the wanted ones, with the same bytes; with `may_lack` files may be missing."""
    for name in sorted(found.keys() | wanted.keys()):
        if skip and skip.match(name):
            continue
        if name not in wanted:
            raise Broken(f"{what}: {name} is left over")
        if name not in found:
            if may_lack:
                continue
            raise Broken(f"{what}: {name} is missing")
        if found[name] != wanted[name]:
            raise Broken(f"{what}: {name} has other bytes ({len(found[name])}, expected {len(wanted[name])})")


# Files that a killed process may leave; the next run removes them or continues with them.
UNFINISHED = re.compile(r"(^|.*/)(journal\.jsonl(\.lock.*)?|plan\.json\.tmp.*|\.incomplete/.*|\.finished/.*)$")


class ShardFaults:
    """Mixed into Faults of fault_test.py; `plans` and `whole` are by what a plan keeps: records or summary."""

    def shard_words(self, keep, folder, shard, n=N_SHARDS, cache=None):
        return self.command("sweep", self.plans[keep], "--shard", f"{shard}/{n}", "--out", folder / "shards" / str(shard),
                            "--cache", cache or self.cache, "--jobs", 1, "--quiet")

    def merge_words(self, folder, to, n=N_SHARDS):
        return self.command("merge", *(folder / "shards" / str(i) for i in range(1, n + 1)), "--out", to, "--quiet")

    def shards(self, keep):
        """Returns a folder of finished shards, which is made once, and the files of their undisturbed merge."""
        if keep not in self.sharded:
            folder = self.work / f"sharded-{keep}"
            for shard in range(1, N_SHARDS + 1):
                self.run(self.shard_words(keep, folder, shard))
            start = time.monotonic()
            self.run(self.merge_words(folder, folder / "merged"))
            self.merge_s = time.monotonic() - start
            merged = contents(folder / "merged")
            self.compare_results(merged, self.whole[keep], f"merge of shards that keep {keep}")
            self.sharded[keep] = folder, merged
        return self.sharded[keep]

    @staticmethod
    def compare_results(found, whole, what):
        """Compares a merge with a whole sweep, except for run.json, which names the shards."""
        compare({k: v for k, v in found.items() if k != "run.json"}, {k: v for k, v in whole.items() if k != "run.json"}, what)

    @staticmethod
    def nothing_partial(out, wanted, what):
        """Checks between a kill and the next run that every file with its final name is complete."""
        if out.exists():
            compare({k: v for k, v in contents(out).items() if not UNFINISHED.match(k)}, wanted, what, may_lack=True)

    def killed(self, n, words, longest_s, after, end):
        """Kills commands n times at random moments. words() returns a command, which is killed at most 10 times and then runs to
        its end. Calls after() after each kill and end() when a command has finished. Returns (kills, finished commands)."""
        kills = finished = 0
        for _ in range(10 * n):
            if kills >= n:
                break
            command = words()
            here = 0
            while here < 10 and kills < n and self.stop(command, self.dice.uniform(0.005, longest_s)):
                kills += 1
                here += 1
                after()
            self.run(command)
            end()
            finished += 1
        return kills, finished

    def kill(self, n=10):
        """Kills sweeps; every second sweep keeps summaries instead of records."""
        at = {"round": 0}

        def words():
            at["round"] += 1
            at["keep"] = ("records", "summary")[at["round"] % 2]
            at["out"] = self.fresh("killed")
            return self.sweep_words(at["out"], at["keep"])

        kills, finished = self.killed(
            n, words, 0.5 * self.sweep_s,
            lambda: self.nothing_partial(at["out"], self.whole[at["keep"]], "sweep after kill -9"),
            lambda: compare(contents(at["out"]), self.whole[at["keep"]], "sweep resumed after kill -9"))
        return f"{kills} kills of sweep, {finished} resumed"

    def merge(self, n=5):
        at = {"round": 0}

        def words():
            at["round"] += 1
            folder, at["wanted"] = self.shards(("records", "summary")[at["round"] % 2])
            at["out"] = self.fresh("merge-killed")
            return self.merge_words(folder, at["out"])

        self.shards("summary")
        kills, finished = self.killed(
            n, words, 1.2 * self.merge_s,
            lambda: self.nothing_partial(at["out"], at["wanted"], "merge after kill -9"),
            lambda: compare(contents(at["out"]), at["wanted"], "merge again after kill -9"))
        return f"{kills} kills of merge, {finished} merged again"

    def pack(self, n=3):
        cache = self.work / "cache-killed"

        def words():
            shutil.rmtree(cache, ignore_errors=True)
            return self.command("data", "pack", self.source, "--cache", cache, "--quiet")

        def check():
            for path in cache.glob("*") if cache.exists() else []:
                data = path.read_bytes()
                if path.suffix == ".pack" and hashlib.sha256(data[:-64]).hexdigest().encode() != data[-64:]:
                    raise Broken(f"pack making after kill -9: {path.name} is partial")
                if path.suffix == ".json":
                    json.loads(data)
                if path.suffix not in (".pack", ".json", ".making", ".TAG") and ".tmp" not in path.name:
                    raise Broken(f"pack making after kill -9: {path.name} is left over")

        def end():
            check()
            out = self.fresh("packed")
            self.run(self.command("sweep", self.plans["summary"], "--out", out, "--cache", cache, "--jobs", 2, "--quiet"))
            compare(contents(out), self.whole["summary"], "sweep from a pack made after kill -9")
            self.run(self.command("cache", "prune", "--cache", cache))
            left = sorted(path.suffix for path in cache.iterdir())
            if left != [".TAG", ".json", ".pack"]:
                raise Broken(f"cache prune after kill -9 leaves {sorted(path.name for path in cache.iterdir())}")

        start = time.monotonic()
        self.run(words())
        kills, finished = self.killed(n, words, time.monotonic() - start, check, end)
        return f"{kills} kills of pack making, {finished} made and swept from"

    def hosts(self):
        """Runs all shards on two hosts whose processes have equal numbers, in one folder and with one cold cache."""
        enter = ["unshare", "--uts", "--pid", "--fork", "--kill-child", "sh", "-c",
                 'hostname "$0" && exec "$@"']
        if subprocess.run([*enter, "node-a", "true"], capture_output=True, check=False).returncode != 0:
            self.skipped.add("two hosts: no right to unshare --uts --pid here")
            return "skipped"
        folder, cache = self.fresh("two-hosts"), self.fresh("two-hosts-cache")
        orders = {"node-a": list(range(1, N_SHARDS + 1)), "node-b": list(range(N_SHARDS, 0, -1))}
        turned_away = collections.Counter()
        while any(orders.values()):
            running = {host: subprocess.Popen([*enter, host, *self.shard_words("records", folder, order[0], cache=cache)],
                                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                       for host, order in orders.items() if order}
            for host, process in running.items():
                error = process.communicate()[1]
                if process.returncode == 0:
                    orders[host].pop(0)
                elif process.returncode == 2 and "is writing" in error:
                    turned_away[host] += 1
                    orders[host].append(orders[host].pop(0))
                else:
                    raise Broken(f"shard on {host}: exit {process.returncode}: {error.strip()[-300:]}")
        # Two processes start the same shard at the same time: one computes it, the other is refused or finds it finished.
        both = self.fresh("one-shard")
        pair = [subprocess.Popen([*enter, host, *self.shard_words("records", both, 1, cache=cache)], stderr=subprocess.PIPE, text=True)
                for host in orders]
        codes = sorted((p.communicate()[1], p.returncode)[1] for p in pair)
        if codes not in ([0, 0], [0, 2]):
            raise Broken(f"two hosts at one shard: exit codes {codes}")
        compare(contents(both / "shards/1"), contents(self.shards("records")[0] / "shards/1"), "one shard on two hosts")
        self.run(self.merge_words(folder, folder / "merged"))
        compare(contents(folder / "merged"), self.shards("records")[1], "merge of two hosts' shards")
        packs = [path for path in cache.iterdir() if path.suffix == ".pack"]
        if len(packs) != 1 or any(".tmp" in path.name for path in cache.iterdir()):
            raise Broken(f"cache of two hosts holds {sorted(path.name for path in cache.iterdir())}")
        return f"{2 * N_SHARDS} shards on 2 hosts, {sum(turned_away.values())} turned away meanwhile, one at the same time"

    def node(self):
        """Fills the disk of one node of several."""
        keep = self.dice.choice(("records", "summary"))
        size = sum(path.stat().st_size for path in (self.shards(keep)[0] / "shards/2").iterdir())
        disk = self.mount(size // 2048)
        if disk is None:
            return "skipped"
        try:
            folder = self.fresh("one-full")
            (folder / "shards").mkdir(parents=True)
            (folder / "shards" / "2").symlink_to(disk)
            for shard in range(1, N_SHARDS + 1):
                done = self.run(self.shard_words(keep, folder, shard), (0, 2))
                if (done.returncode == 2) != (shard == 2):
                    raise Broken(f"shard {shard} beside a full disk of shard 2: exit {done.returncode}")
                if shard == 2:
                    self.says(done, "No space left", "shards/2")
            merging = self.run(self.merge_words(folder, folder / "merged"), (2,))
            self.says(merging, "shards/2", "is not finished")
            self.run(["mount", "-o", "remount,size=20m", str(disk)])
            self.run(self.shard_words(keep, folder, 2))
            self.run(self.merge_words(folder, folder / "merged"))
            compare(contents(folder / "merged"), self.shards(keep)[1], "merge after a full disk on one node")
            return f"1 shard of {N_SHARDS} on a full disk, keep {keep}"
        finally:
            self.unmount(disk)

    @staticmethod
    def says(done, *words):
        """Raises Broken unless a command was refused with exit code 2 and one line that contains these words."""
        lines = done.stderr.strip().split("\n")
        if done.returncode != 2 or len(lines) != 1 or not all(word in lines[0] for word in words):
            raise Broken(f"{' '.join(done.args[1:])}: expected exit 2 and one line with {words}, got {done.returncode}: {done.stderr}")

    def refused(self):
        """Gives shards bad input, which must be refused with exit code 2 and one line that names it; no file may change."""
        folder, _ = self.shards("records")
        before = contents(folder)
        other = self.work / "edited.json"
        plan = json.loads(self.plans["records"].read_text())
        plan["seeds"] += 1
        other.write_text(json.dumps(plan), encoding="utf-8")
        first = folder / "shards" / "1"

        def refused(words, *texts):
            self.says(subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False), *texts)

        def shard(plan_file, text, out):
            return self.command("sweep", plan_file, "--shard", text, "--out", out, "--cache", self.cache, "--quiet")

        n = N_SHARDS
        refused(shard(self.plans["records"], f"{n + 1}/{n}", first), f"--shard {n + 1}/{n}")
        refused(shard(self.plans["records"], "1/0", first), "--shard 1/0")
        refused(shard(self.plans["records"], f"1/{n + 1}", first), str(first), "another shard")
        refused(shard(other, f"1/{n}", first), str(first), "another plan")
        refused(self.command("sweep", "status", folder, "--shards", n + 1), f"expected one in {n + 1}")
        foreign = self.fresh("foreign")
        shutil.copytree(folder / "shards", foreign / "shards")
        shutil.rmtree(foreign / "shards" / "2")
        self.run(shard(other, f"2/{n}", foreign / "shards" / "2"))
        refused(self.merge_words(foreign, foreign / "merged"), str(foreign / "shards" / "2"), "another plan")
        refused(self.command("sweep", "status", foreign), "another plan")
        shutil.rmtree(foreign / "shards" / "2")
        self.run(shard(self.plans["records"], f"2/{n + 1}", foreign / "shards" / "2"))
        refused(self.merge_words(foreign, foreign / "merged"), str(foreign / "shards" / "2"), f"in {n + 1} shards")
        refused(self.command("sweep", "status", foreign), f"one in {n}")
        shutil.rmtree(foreign / "shards" / "2")
        refused(self.merge_words(foreign, foreign / "merged"), str(foreign / "shards" / "2"))
        refused(self.command("merge", foreign / "shards/1", foreign / "shards/3", "--out", foreign / "merged"), "shards 2, 4 of 4")
        for keep, name in (("records", "records.jsonl"), ("summary", "summary.bin")):
            cut = self.fresh("cut")
            shutil.copytree(self.shards(keep)[0] / "shards", cut / "shards")
            file = cut / "shards" / "2" / name
            os.truncate(file, file.stat().st_size // 2)
            refused(self.merge_words(cut, cut / "merged"), str(file))
            refused(self.command("report", cut / "shards" / "2", "--quiet"), str(file))
            if (cut / "merged").exists():
                raise Broken("a refused merge has left a folder")
        slurm = self.fresh("submitted")
        script = self.root / "scripts/slurm_sweep"
        submit = [script, self.plans["records"], "--out", slurm, "--shards", n, "--program", self.program, "--dry-run"]
        self.run([str(word) for word in submit])
        refused([*submit[:5], n + 1, *submit[6:]], str(slurm), "another number of shards")
        refused([script, other, *submit[2:]], str(slurm), "another plan")
        if (foreign / "merged").exists():
            raise Broken("a refused merge has left a folder")
        compare(contents(folder), before, "shards after what was refused")
        return "17 kinds"
