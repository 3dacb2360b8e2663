"""`pip wheel .` without a network, from what was built already; the wheel in a new environment runs a notebook; the source
distribution holds what git tracks."""

import os
import pathlib
import subprocess
import sys
import tarfile
import tempfile
import unittest

import sextant

ROOT = pathlib.Path(os.environ["SEXTANT_ROOT"])
BUILD = pathlib.Path(sextant.__file__).parents[2]  # build/release of build/release/python/sextant
NO_NETWORK = {"PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}

for module in ("pip", "venv", "setuptools", "wheel"):
    if subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True, check=False).returncode:
        print(f"wheels are not tried: no {module}; scripts/setup --python installs it")
        sys.exit(77)


def call(*command, **variables):
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SEXTANT_"))}
    done = subprocess.run([str(word) for word in command], env={**environment, **NO_NETWORK, **variables}, capture_output=True,
                          text=True, check=False)
    if done.returncode:
        raise AssertionError(f"{command}: exit {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


class Wheel(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_in_a_new_environment(self):
        call(sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", self.folder, ROOT, SEXTANT_BUILD_DIR=str(BUILD))
        wheels = list(self.folder.glob("sextant-*.whl"))
        self.assertEqual(len(wheels), 1)
        self.assertIn(f"sextant-{sextant.version()}-cp", wheels[0].name)
        environment = self.folder / "environment"
        call(sys.executable, "-m", "venv", "--system-site-packages", environment)
        python = environment / "bin" / "python"
        call(python, "-m", "pip", "install", "--no-deps", wheels[0])
        said = call(python, "-c", "import sextant\nrun = sextant.run('synthetic:s18@0-2', estimator='motion_only')\n"
                    "print(sextant.__file__, sextant.program(), sextant.version(), len(run.records()), sep='\\n')").split("\n")
        self.assertTrue(said[0].startswith(str(environment)), said)
        self.assertEqual(said[1:3], [str(environment / "bin" / "sextant"), sextant.version()])
        self.assertGreater(int(said[3]), 0)
        package = pathlib.Path(said[0]).parent
        for name in ("py.typed", "_core.pyi", "_files.pyi", "_inprocess.pyi"):
            self.assertTrue((package / name).is_file(), name)
        try:
            import nbclient  # noqa: F401
        except ImportError:
            self.skipTest("no nbclient: notebooks are not executed")
        print(call(python, "-B", ROOT / "eval/python/tests/test_notebooks.py"))

    def test_source_distribution(self):
        name = call(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'eval/python')!r}); import build_backend\n"
                    f"print(build_backend.build_sdist({str(self.folder)!r}))").strip().split("\n")[-1]
        with tarfile.open(self.folder / name) as archive:
            archive.extractall(self.folder)
        top = self.folder / name.removesuffix(".tar.gz")
        found = {path.relative_to(top).as_posix() for path in top.rglob("*") if path.is_file()}
        self.assertLess({"PKG-INFO", "pyproject.toml", "CMakeLists.txt", "eval/python/build_backend.py",
                         "eval/python/sextant/py.typed"}, found)
        self.assertFalse([name for name in found if name.startswith("build/")])
        again = self.folder / "again"
        again.mkdir()
        call(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(top / 'eval/python')!r}); import build_backend\n"
             f"build_backend.build_sdist({str(again)!r})")
        with tarfile.open(again / name) as archive:
            self.assertEqual({member.name.partition("/")[2] for member in archive}, found)


if __name__ == "__main__":
    unittest.main()
