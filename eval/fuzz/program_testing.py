"""Runs of the program under stress, for fault_test.py, hostile_test.py and limits_test.py: how the program ended, its time and
memory, deviations from docs/security.md, and the files that it left behind."""

import argparse
import csv
import contextlib
import dataclasses
import io
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Exit codes of the documentation; 1 and 3 are verdicts of `compare`, 130 is an interrupt.
DOCUMENTED = (0, 1, 2, 3, 130)
#: The program is built with sanitizers, whose own memory has no limit.
SANITIZED = bool(os.environ.get("SEXTANT_SANITIZE"))
REFUSED_MB = 64
#: Wall-clock time that a command may take on a busy machine, as a multiple of the time that it needs.
BUSY = 20
#: U+202A to U+202E and U+2066 to U+2069.
DIRECTIONS = re.compile("[\u202a-\u202e\u2066-\u2069]")
NUMBER = re.compile(r"[-+]?[0-9.]+(e[-+]?[0-9]+)?$")


@dataclasses.dataclass
class Outcome:
    code: int  #: negative: minus the signal
    out: str
    err: str
    seconds: float
    more_mb: float  #: largest resident memory beyond that of `sextant options`, which is the program itself with its libraries
    cpu_s: float

    def fault(self, codes=DOCUMENTED, most_mb=None):
        """Returns the deviation from the documented behaviour; empty if there is none."""
        if self.code not in codes:
            return f"exit {self.code}, expected {codes}: {self.err.strip()[-200:]}"
        if self.code == 2:
            lines = [line for line in self.err.splitlines() if not line.startswith("sextant: warning: ")]
            if not any(line.startswith("sextant: error: ") for line in lines):
                return f"exit 2 without a reason: {self.err.strip()[-200:]!r}"
        if "internal" in self.err or "bad_alloc" in self.err:
            return f"a defect of the program is reported: {self.err.strip()[-200:]}"
        if DIRECTIONS.search(self.out + self.err):
            return "a control character of bidirectional text was printed"
        if most_mb is not None and self.more_mb > most_mb and not SANITIZED:
            return f"{self.more_mb:.0f} MB of memory, expected at most {most_mb:.0f}"
        return ""


def _handles(process, number):
    """Returns true if the process has a handler of the signal."""
    try:
        caught = re.search(r"SigCgt:\s*(\w+)", pathlib.Path(f"/proc/{process.pid}/status").read_text())
    except OSError:  # it has ended
        return False
    return caught is not None and int(caught[1], 16) >> (number - 1) & 1 == 1


class Program:
    """Runs the program in a scratch folder, with a cache and a TMPDIR of its own."""

    own_mb = {}  #: resident memory of the program itself, by its file

    def __init__(self, file, folder):
        self.file = str(file)
        self.folder = pathlib.Path(folder)
        self.scratch = self.folder / "tmp"
        self.scratch.mkdir(exist_ok=True)
        self.environment = {**os.environ, "TMPDIR": str(self.scratch), "SEXTANT_CACHE": str(self.folder / "cache"),
                            "LC_ALL": "C.UTF-8"}
        if self.file not in self.own_mb:
            self.own_mb[self.file] = 0
            self.own_mb[self.file] = self.run("options").more_mb

    def start(self, *words, limits=None, environment=None, **streams):
        """Starts a command; returns its process. `limits`: arguments of resource.setrlimit, (RLIMIT_FSIZE, n), ..."""

        def prepare():
            for what, value in limits or ():
                resource.setrlimit(what, (value, value))

        return subprocess.Popen([self.file, *map(str, words)], cwd=self.folder, env={**self.environment, **(environment or {})},
                                preexec_fn=prepare if limits else None, stdin=subprocess.DEVNULL, **streams)

    def run(self, *words, time_limit_s=600 if SANITIZED else 120, limits=None, environment=None):
        """Runs a command, which may use `time_limit_s` of processor time and, on a busy machine, BUSY times as long. The system counts
        the memory of the starting process as that of a new one at first, so keep this process small."""
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            start = time.monotonic()
            process = self.start(*words, limits=[(resource.RLIMIT_CPU, time_limit_s), *(limits or ())], environment=environment,
                                 stdout=out, stderr=err)
            status, used = self._wait(process, start + BUSY * time_limit_s)
            seconds = time.monotonic() - start
            out.seek(0)
            err.seek(0)
            return Outcome(os.waitstatus_to_exitcode(status), out.read().decode(errors="replace"),
                           err.read().decode(errors="replace"), seconds, used.ru_maxrss / 1000 - self.own_mb[self.file],
                           used.ru_utime + used.ru_stime)

    def interrupt(self, *words, after_s, with_signal=signal.SIGINT, time_limit_s=60, once_handled=False):
        """Sends the signal after a while, which begins when the command has its handler of the signal if `once_handled`. Returns
        (exit code, seconds from the signal to the end); None instead of the seconds if the command had ended before."""
        process = self.start(*words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while once_handled and process.poll() is None and not _handles(process, with_signal):
            time.sleep(0.005)
        try:
            return process.wait(after_s), None
        except subprocess.TimeoutExpired:
            pass
        start = time.monotonic()
        process.send_signal(with_signal)
        try:
            code = process.wait(time_limit_s)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return None, time_limit_s
        return code, time.monotonic() - start

    def commands(self):
        """Returns every command of the program's tree of commands, as a list of words."""
        found, todo = [], [[]]
        while todo:
            words = todo.pop(0)
            text = self.run(*words, "--help").out
            found.append(words)
            if "Subcommands:" in text:
                below = text.split("Subcommands:")[1].split("\n\n")[0]
                todo += [[*words, line.split()[0]] for line in below.splitlines() if re.match(r"  \w", line)]
        return found

    @staticmethod
    def _wait(process, end):
        while True:
            pid, status, used = os.wait4(process.pid, os.WNOHANG)
            if pid:
                process.returncode = os.waitstatus_to_exitcode(status)
                return status, used
            if time.monotonic() > end:
                process.kill()
                _, _, used = os.wait4(process.pid, 0)
                process.returncode = -signal.SIGKILL
                return signal.SIGKILL, used
            time.sleep(0.002)


def is_formula(cell):
    return cell[:1] in tuple("=+-@\t\r") and cell[:1] != "" and not NUMBER.match(cell)


def printed_faults(folder):
    """Returns the first fault of the tables and pages in a folder, which may be printed from hostile texts; empty if there is none."""
    for path in sorted(pathlib.Path(folder).rglob("*")):
        if not path.is_file() or path.suffix not in (".csv", ".md", ".tex", ".html", ".xml", ".txt"):
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        if DIRECTIONS.search(text):
            return f"{path.name} holds a control character of bidirectional text"
        if path.suffix == ".csv" and any(is_formula(cell) for row in csv.reader(io.StringIO(text)) for cell in row):
            return f"{path.name} holds a cell that a spreadsheet takes for a formula"
        if path.suffix in (".csv", ".md", ".tex") and re.search(r"(?<![\w.])-?(?:inf|nan)(?![\w.])", text):
            return f"{path.name} holds inf or nan"
    return ""


def contents(folder, strip=lambda name, data: data):
    """Returns {path: bytes} of every file below the folder."""
    return {path.relative_to(folder).as_posix(): strip(path.name, path.read_bytes())
            for path in sorted(folder.rglob("*")) if path.is_file()}


def options(text, kinds, minutes, **more):
    """Returns the options of a stress test: `text` is its help; `more` are further options with their defaults, None for an int."""
    parser = argparse.ArgumentParser(usage=text, add_help=False)
    parser.add_argument("--minutes", type=float, default=minutes)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=kinds)
    parser.add_argument("--program", type=pathlib.Path, default=ROOT / "build/release/bin/sextant")
    parser.add_argument("--keep", action="store_true")
    for name, default in more.items():
        parser.add_argument("--" + name.replace("_", "-"), type=type(default) if default is not None else int, default=default)
    parser.add_argument("-h", "--help", action="store_true")
    found = parser.parse_args()
    if found.help:
        print(text.strip())
        sys.exit(0)
    if not found.program.exists():
        print(f"{sys.argv[0]}: {found.program} is not there: run scripts/build first", file=sys.stderr)
        sys.exit(2)
    found.program = found.program.resolve()
    return found


@contextlib.contextmanager
def working_folder(name, keep):
    """Yields a temporary folder, which is removed at the end unless `keep`."""
    work = pathlib.Path(tempfile.mkdtemp(prefix=f"sextant-{name}-"))
    try:
        yield work
    finally:
        if keep:
            print(f"left: {work}")
        else:
            shutil.rmtree(work, ignore_errors=True)
