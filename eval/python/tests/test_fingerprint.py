"""Versions of estimators in Python: what is seen of them, and that no sweep is scored with results of another one."""

import collections
import datetime
import functools
import json
import os
import logging
import pathlib
import subprocess
import sys
import tempfile
import threading
import types
import unittest
import warnings

import numpy

import sextant
from sextant.fingerprint import fingerprint

GAIN = 1.0
TABLE = {"a": [1, 2], "b": numpy.eye(2)}
LOCK = threading.Lock()
LOGGER = logging.getLogger("fingerprint")


def helper(x):
    return GAIN * x


def plain(problem, bias=0):
    LOGGER.info("called")
    return helper(problem.start) + bias + TABLE["a"][0]


def bound(gain):
    def inner(problem):
        return gain * problem.start
    return inner


def even(problem):
    return odd(problem)


def odd(problem):
    return even(problem)


class Holder:
    scale = 1

    def __init__(self, gain):
        self.gain, self.layers = gain, [{"weights": numpy.ones(3)}]

    def __call__(self, problem):
        return self.scale * self.gain * problem.start


class Calibrated(numpy.ndarray):
    """An array with attributes."""


class Queue(collections.deque):
    """Its content is no attribute."""


class Metres(float):
    pass


class Day(datetime.date):
    pass


def with_gain(thing, gain):
    thing.gain = gain
    return thing


class Opaque:
    """An object as of a compiled package: no attributes, no pickle, but numbers."""
    __slots__ = ()

    def __array__(self, dtype=None, copy=None):
        return numpy.arange(3.0)

    def __reduce_ex__(self, protocol):
        raise TypeError("cannot pickle")


class Tensor(Opaque):
    """An object of the array API whose pickle would hold an address."""

    def __init__(self, gain):
        self.gain = gain

    def __dlpack__(self):
        raise AssertionError("not needed")

    def __reduce_ex__(self, protocol):
        return Tensor, (object(),)


Opaque.__module__ = Tensor.__module__ = "numpy"  # as if they were installed


def recompiled(function, old, new):
    """A function with another constant in its code."""
    code = function.__code__
    constants = tuple(new if type(c) is type(old) and c == old else c for c in code.co_consts)
    return types.FunctionType(code.replace(co_consts=constants), function.__globals__, function.__name__,
                              function.__defaults__, function.__closure__)


class Fingerprints(unittest.TestCase):
    def changed(self, before, after):
        a, b = before["parts"], after["parts"]
        return sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))

    def with_global(self, name, value, function):
        before, kept = fingerprint(function), globals()[name]
        self.addCleanup(globals().__setitem__, name, kept)
        globals()[name] = value
        return self.changed(before, fingerprint(function))

    def test_the_same_twice(self):
        for make in (lambda: plain, lambda: bound(2.0), lambda: Holder(2), lambda: Holder(2).__call__, lambda: even,
                     lambda: functools.partial(plain, bias=1), lambda: functools.lru_cache(plain)):
            self.assertEqual(fingerprint(make()), fingerprint(make()))

    def test_globals_helpers_defaults_closures_and_state(self):
        self.assertEqual(self.with_global("GAIN", 1.05, plain), ["global GAIN of helper"])
        self.assertEqual(self.with_global("TABLE", {"a": [1, 2], "b": 2 * numpy.eye(2)}, plain), ["global TABLE of plain"])
        self.assertIn("global helper of plain", self.with_global("helper", bound(1.0), plain))
        self.assertEqual(self.changed(fingerprint(bound(1.0)), fingerprint(bound(1.05))), ["closure gain of bound.<locals>.inner"])
        self.assertEqual(self.changed(fingerprint(Holder(1)), fingerprint(Holder(2))), ["estimator"])
        array = Holder(1)
        array.layers[0]["weights"][2] = 1.5
        self.assertEqual(self.changed(fingerprint(Holder(1)), fingerprint(array)), ["estimator"])
        masked = [fingerprint(bound(numpy.ma.array([1.0, 2.0], mask=mask))) for mask in ([0, 1], [1, 0], [1, 0])]
        self.assertEqual(self.changed(*masked[:2]), ["closure gain of bound.<locals>.inner"])
        self.assertEqual(self.changed(*masked[1:]), [])
        before = fingerprint(Holder(1))
        Holder.scale = 2
        self.addCleanup(setattr, Holder, "scale", 1)
        self.assertEqual(self.changed(before, fingerprint(Holder(1))), ["class Holder"])
        self.assertEqual(self.changed(fingerprint(functools.partial(plain, bias=1)), fingerprint(functools.partial(plain, bias=2))),
                         ["estimator"])

    def distinct(self, *values):
        """Checks that every value is seen, that equal values are equal, and that all values have different fingerprints."""
        found = [fingerprint(bound(make())) for make in values for _ in range(2)]
        self.assertEqual([each["not_seen"] for each in found], [[]] * len(found))
        for k in range(0, len(found), 2):
            self.assertEqual(found[k], found[k + 1], f"value {k // 2}")
        self.assertEqual(len({json.dumps(each) for each in found}), len(values))

    def test_arrays_with_attributes_and_classes_derived_from_compiled_ones(self):
        array = lambda gain: with_gain(numpy.eye(3).view(Calibrated), gain)
        self.distinct(lambda: numpy.eye(3), lambda: array(1.0), lambda: array(2.0), lambda: array([2.0]))
        masked = lambda **how: numpy.ma.array([1.0, 2.0], mask=[0, 1], **how)
        self.distinct(masked, lambda: masked(fill_value=5), lambda: masked(hard_mask=True), lambda: with_gain(masked(), 2))
        used = masked()
        before = fingerprint(bound(used))
        used.filled()
        self.assertEqual(fingerprint(bound(used)), before)
        self.distinct(lambda: Queue([1]), lambda: Queue([2]), lambda: with_gain(Queue([2]), 1))
        self.distinct(lambda: 1.0, lambda: Metres(1), lambda: Metres(2), lambda: with_gain(Metres(2), 1))
        self.distinct(lambda: Day(2020, 1, 1), lambda: Day(2020, 1, 2))
        with tempfile.TemporaryDirectory() as folder:
            files = [pathlib.Path(folder) / name for name in ("a.npy", "b.npy")]
            for file in files:
                numpy.save(file, numpy.arange(3.0))
            mapped = [fingerprint(bound(numpy.load(file, mmap_mode="r"))) for file in files]
        self.assertEqual(mapped[0], mapped[1], "the path does not count")
        self.assertEqual(mapped[0]["not_seen"], [])

    def test_objects_with_numbers(self):
        self.assertEqual(fingerprint(bound(Opaque()))["not_seen"],
                         ["closure gain of bound.<locals>.inner: numpy.Opaque cannot be pickled, so only its numbers are compared"])
        self.distinct(lambda: Tensor(1), lambda: Tensor(2))
        with open(__file__, encoding="utf-8") as file:  # has an attribute, its mode
            self.assertEqual(fingerprint(bound(file))["not_seen"],
                             ["closure gain of bound.<locals>.inner: _io.TextIOWrapper cannot be pickled, so only its attributes are compared"])

    def test_frames_with_index_columns_and_names(self):
        try:
            import pandas
        except ImportError as missing:
            self.skipTest(f"{missing}: scripts/setup --python")
        frame, index = pandas.DataFrame, pandas.Index
        self.distinct(lambda: frame([[1.0, 2.0]]), lambda: frame([[1.0, 3.0]]), lambda: frame([[1, 2]]),
                      lambda: frame([[1.0, 2.0]], index=[1]), lambda: frame([[1.0, 2.0]], index=[1.0]),
                      lambda: frame([[1.0, 2.0]], index=["x"]), lambda: frame([[1.0, 2.0]], index=index(["x"], name="n")),
                      lambda: frame([[1.0, 2.0]], columns=["x", "y"]), lambda: frame([[1.0, 2.0]], columns=["y", "x"]),
                      lambda: frame([[1.0, 2.0]], columns=index(["y", "x"], name="n")),
                      lambda: with_gain(frame([[1.0, 2.0]]), 3))
        series = pandas.Series
        self.distinct(lambda: series([1.0]), lambda: series([1.0], index=[1.0]), lambda: series([1.0], name="a"),
                      lambda: series([1.0], dtype="float32"), lambda: with_gain(series([1.0]), 3), lambda: series([[1]]),
                      lambda: series([[2]]), lambda: series(["a"]), lambda: series(["a"], dtype="category"))
        table = frame({"a": [1.0, 2.0], "b": ["x", "y"], "c": pandas.date_range("2020", periods=2, tz="UTC")}, index=["p", "q"])
        table["d"] = 2 * table["a"]
        before = fingerprint(bound(table))
        for use in (table.describe, table.isnull().any, table["b"].str.upper, lambda: table.loc["p"]):
            use()  # joins columns into one array, and fills caches
        self.assertEqual(fingerprint(bound(table)), before)
        self.assertEqual(fingerprint(bound(table["b"]))["not_seen"], [])

    def test_the_same_in_every_process(self):
        script = ("import json, numpy, sys\nsys.path.insert(0, sys.argv[1])\nfrom test_fingerprint import *\n"
                  "values = [with_gain(numpy.eye(2).view(Calibrated), {'a', 'b', 'c'}), Queue(['a']), Metres(1), Tensor(1)]\n"
                  "try:\n    import pandas\n    values.append(pandas.DataFrame({'a': ['x'], 'b': pandas.Categorical(['u'])}, index=['i']))\n"
                  "except ImportError:\n    pass\n"
                  "print(json.dumps([fingerprint(bound(value)) for value in values]))\n")
        found = [subprocess.run([sys.executable, "-B", "-c", script, pathlib.Path(__file__).parent], stdout=subprocess.PIPE, check=True,
                                env={**os.environ, "PYTHONHASHSEED": seed}).stdout for seed in ("1", "2")]
        self.assertEqual(*found)

    def test_code_that_no_module_holds(self):
        def loaded(gain):
            names = {}
            exec(f"gain = {gain}\nclass C:\n    g = gain\ndef f(p):\n    return gain * p.start, C\n", names)
            return fingerprint(names["f"])
        self.assertEqual(loaded(1), loaded(1))
        self.assertEqual(self.changed(loaded(1), loaded(2)), ["class C", "global gain of f"])

    def test_code_and_constants(self):
        def constant(problem):
            return problem.start + 0.25
        self.assertNotEqual(fingerprint(constant), fingerprint(recompiled(constant, 0.25, 0.5)))
        self.assertNotEqual(fingerprint(lambda p: p.start), fingerprint(lambda p: p.start.T))
        self.assertEqual(fingerprint(lambda p: p.start), fingerprint(lambda p: p.start))  # lines do not count

    def test_what_has_no_content_is_said(self):
        def locked(problem):
            with LOCK:
                return problem.start
        self.assertEqual(fingerprint(locked)["not_seen"],
                         ["global LOCK of Fingerprints.test_what_has_no_content_is_said.<locals>.locked: "
                          "_thread.lock has no content to compare"])
        self.assertEqual(fingerprint(plain)["not_seen"], [])
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            sextant.run("synthetic:s18@0-1", out=pathlib.Path(folder) / "a", estimator=locked)
        self.assertIn("LOCK", str(caught[0].message))


SCRIPT = """
import json, sys
import numpy
import sextant
import lib_of_mine
from package_of_mine import part

BIAS = 0.0

def forwards(T):
    return T

def make(gain):
    def mine(problem):
        from late_of_mine import late
        T = forwards(problem.start).copy()
        T[0, 3] += BIAS + lib_of_mine.bias(T) + part.bias + late() + gain - 1.0
        return T
    return mine

plan = {"name": "t", "sources": ["synthetic:s18@0-2"], "estimators": ["motion_only", "python:mine"],
        "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]}, "seeds": 6}
flags = json.loads(sys.argv[3])
done = sextant.sweep(plan, out=sys.argv[1], cache=sys.argv[2], estimators={"mine": make(1.0)}, **flags)
print(json.dumps([done.cases_before, done.cases_stale]))
"""
FILES = {"main.py": SCRIPT, "lib_of_mine.py": "import deep_of_mine\n\ndef bias(T):\n    return deep_of_mine.bias\n",
         "deep_of_mine.py": "bias = 0.0\n", "late_of_mine.py": "def late():\n    return 0.0\n",
         "package_of_mine/__init__.py": "", "package_of_mine/part.py": "bias = 0.0\n"}


class Sweeps(unittest.TestCase):
    """A script and its modules in a folder; one process a sweep, as users run it."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "package_of_mine").mkdir()
        self.write({})

    def write(self, changes):
        for name, text in FILES.items():
            for old, new in changes.get(name, {}).items():
                self.assertIn(old, text)
                text = text.replace(old, new)
            (self.folder / name).write_text(text)

    def sweep(self, out, **flags):
        """Returns (cases before, stale cases), and the lines about stale cases."""
        done = subprocess.run([sys.executable, "-B", "main.py", out, "cache", json.dumps(flags)], cwd=self.folder,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return tuple(json.loads(done.stdout)), done.stderr

    def contents(self, out):
        return {path: path.read_bytes() for path in (self.folder / out).rglob("*") if path.is_file()}

    def verdict(self, base, new):
        return sextant.compare(self.folder / base, self.folder / new, only="accuracy").verdict

    def test_every_change_is_noticed(self):
        self.assertEqual(self.sweep("base"), ((0, 0), ""))
        self.assertEqual(self.sweep("new"), ((0, 0), ""))
        before = self.contents("new")
        self.assertEqual(self.sweep("new"), ((12, 0), ""))
        self.assertEqual(self.contents("new"), before)
        self.assertEqual(self.verdict("base", "new"), "ok")
        changes = {"global BIAS of make.<locals>.mine": {"main.py": {"BIAS = 0.0": "BIAS = 1.0"}},
                   "closure gain of make.<locals>.mine": {"main.py": {"make(1.0)": "make(2.0)"}},
                   "function forwards": {"main.py": {"    return T\n\ndef": "    return T @ numpy.diag([1., -1., -1., 1.])\n\ndef"}},
                   "file of module deep_of_mine": {"deep_of_mine.py": {"0.0": "1.0"}},
                   "file of module late_of_mine": {"late_of_mine.py": {"0.0": "1.0"}},
                   "file of module package_of_mine.part": {"package_of_mine/part.py": {"0.0": "1.0"}}}
        for part, change in changes.items():
            with self.subTest(part):
                self.write(change)
                done, told = self.sweep("new")
                self.assertEqual(done, (6, 6))  # motion_only stays
                self.assertRegex(told, "^sextant: note: new: 'mine': another version of it made 6 finished cases")
                self.assertIn(part, told)
                self.assertEqual(self.verdict("base", "new"), "regressed")
                self.write({})
                self.assertEqual(self.sweep("new")[0], (6, 6))
                self.assertEqual(self.verdict("base", "new"), "ok")

    def test_what_does_not_change_it(self):
        self.sweep("a")
        self.write({"main.py": {"BIAS = 0.0": "# a remark\n\nUNUSED = 1\nBIAS = 0.0", 'flags = json': 'other = "x"\nflags = json'}})
        self.assertEqual(self.sweep("a"), ((12, 0), ""))

    def test_stale_cases_are_kept_and_sweeps_begun_anew_where_asked(self):
        self.sweep("a")
        self.write({"main.py": {"BIAS = 0.0": "BIAS = 1.0"}})
        done, told = self.sweep("a", reuse_stale=True)
        self.assertEqual(done, (12, 6))
        self.assertIn("kept", told)
        self.assertEqual(self.sweep("a", force=True), ((0, 0), ""))


if __name__ == "__main__":
    unittest.main()
