"""Starting the program `sextant`, and reading its progress and messages."""

import codecs
import dataclasses
import json
import os
import pathlib
import re
import selectors
import shutil
import signal
import subprocess
import sys

import numpy

from ._core import Error
from .arguments import path


class ProgramError(Error):
    """An error of the program: its message, and its exit code (2 bad input, 70 internal error, 130 interrupted)."""

    def __init__(self, message, exit_code):
        super().__init__(message)
        self.exit_code = exit_code

    def __reduce__(self):
        return ProgramError, (str(self), self.exit_code)


@dataclasses.dataclass(frozen=True)
class Progress:
    """Argument of a function given as `progress`."""
    what: str
    done: int
    total: int
    left_s: float


def program() -> str:
    """Returns the path of the program: $SEXTANT_PROGRAM, else bin/sextant of the package's build folder or installation
    prefix, else the one in PATH.

    >>> sextant.program()
    '...sextant'
    """
    named = os.environ.get("SEXTANT_PROGRAM")
    if named:
        if not os.access(named, os.X_OK) or os.path.isdir(named):
            raise Error(f"SEXTANT_PROGRAM: expected the program sextant, got {named!r}, which cannot be run")
        return named
    here = pathlib.Path(__file__).absolute().parent
    for folder in list(here.parents)[:4]:
        beside = folder / "bin" / "sextant"
        if os.access(beside, os.X_OK) and beside.is_file():
            return str(beside)
    found = shutil.which("sextant")
    if found is None:
        raise Error("the program sextant was not found: set SEXTANT_PROGRAM to its path, or add its folder to PATH")
    return found


_PROGRESS = re.compile(r"\x1b\[K(.+?) (\d+)/(\d+)  [\d.]+/s  ([\d.]+) s left")


class _Shown:
    """Shows progress with tqdm if it is installed, otherwise as a line on standard error."""

    def __init__(self):
        try:
            from tqdm.auto import tqdm
        except ImportError:
            tqdm = None
        self._tqdm, self._bar, self._what = tqdm, None, None

    def __call__(self, progress):
        if self._tqdm is None:
            end = "\n" if progress.done == progress.total else ""
            sys.stderr.write(f"\r{progress.what} {progress.done}/{progress.total}, {progress.left_s:.0f} s left \x1b[K{end}")
            sys.stderr.flush()
            return
        if self._what != progress.what:
            self.close()
            self._what, self._bar = progress.what, self._tqdm(total=progress.total, desc=progress.what)
        self._bar.update(progress.done - self._bar.n)

    def close(self):
        if self._bar is not None:
            self._bar.close()


class _Messages:
    """Reader of the program's standard error: progress, warnings, and the final error."""

    def __init__(self, report):
        self._report = report
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._pending = ""
        self.lines = []

    def take(self, data):
        self._pending += self._decoder.decode(data)
        *whole, self._pending = re.split(r"[\n\r]", self._pending)
        for piece in whole:
            self._line(piece)

    def end(self):
        self._line(self._pending)
        self._pending = ""

    def _line(self, piece):
        shown = _PROGRESS.search(piece)
        if shown:
            if self._report:
                self._report(Progress(shown[1], int(shown[2]), int(shown[3]), float(shown[4])))
            piece = piece[:shown.start()] + piece[shown.end():]
        piece = piece.replace("\x1b[K", "").strip()
        if piece:
            self.lines.append(piece)

    def of(self, kind):
        start = f"sextant: {kind}: "
        return [line[len(start):] for line in self.lines if line.startswith(start)]


def _drain(process, error_end, messages):
    """Reads both outputs until both are closed; returns standard output."""
    out = []
    with selectors.DefaultSelector() as ready:
        ready.register(process.stdout.fileno(), selectors.EVENT_READ)
        ready.register(error_end, selectors.EVENT_READ)
        while ready.get_map():
            for key, _ in ready.select():
                try:
                    data = os.read(key.fd, 1 << 16)
                except OSError:  # a terminal whose other end is closed
                    data = b""
                if not data:
                    ready.unregister(key.fd)
                elif key.fd == error_end:
                    messages.take(data)
                else:
                    out.append(data)
    messages.end()
    return b"".join(out)


def checked_progress(progress):
    """Returns True, False, None or a function."""
    if isinstance(progress, numpy.bool_):
        return bool(progress)
    if progress is not None and not isinstance(progress, bool) and not callable(progress):
        raise Error(f"progress: expected True, False or a function, got {progress!r}")
    return progress


def call(arguments, *, progress=None, good=(0,)):
    """Runs the program; returns (exit code, standard output as JSON, warnings). `progress`: True shows a line on standard error,
    a function is called with a Progress."""
    progress = checked_progress(progress)
    report = _Shown() if progress is True else progress or None
    for argument in arguments:
        path("an argument of the program", argument)
    command = [program(), *arguments]
    if report is None:  # without a listener the program shows no progress
        error_end, other = os.pipe()
    else:
        error_end, other = os.openpty()
    messages = _Messages(report)
    try:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=other)
        except OSError as error:
            raise Error(f"{command[0]}: cannot be started: {error.strerror}") from None
        finally:
            os.close(other)
        with process:
            try:
                out = _drain(process, error_end, messages)
            except BaseException:  # Ctrl-C reaches both processes; the program cleans up
                process.send_signal(signal.SIGINT)
                process.wait()
                raise
    finally:
        os.close(error_end)
        if isinstance(report, _Shown):
            report.close()
    for note in messages.of("note"):
        print(f"sextant: note: {note}", file=sys.stderr)
    if process.returncode not in good:
        errors = messages.of("error") or messages.lines or [f"ended with {process.returncode} and no message"]
        raise ProgramError(errors[-1], process.returncode)
    try:
        return process.returncode, json.loads(out), messages.of("warning")
    except (ValueError, RecursionError):
        if messages.of("error"):
            raise ProgramError(messages.of("error")[-1], process.returncode) from None
        raise Error(f"{command[0]}: expected JSON on its standard output, got {out[:200]!r}") from None
