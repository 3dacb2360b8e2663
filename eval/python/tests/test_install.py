"""The wheel of `pip wheel .` is installed in a new virtual environment without network, and runs the notebooks there. The source
distribution holds what git tracks, makes itself again, and configures."""

import importlib.util
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest

NEEDS = ("pip", "venv", "setuptools", "wheel", "numpy", "pandas", "matplotlib", "nbclient", "ipykernel")
if missing := [name for name in NEEDS if importlib.util.find_spec(name) is None]:
    print(f"the package is not installed: no {', '.join(missing)}; scripts/setup --python installs what it needs")
    sys.exit(77)

ROOT = pathlib.Path(os.environ["SEXTANT_ROOT"])
NO_NETWORK = {"PIP_NO_INDEX": "1", "PIP_DISABLE_PIP_VERSION_CHECK": "1", "http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}


def call(*command, cwd=None, **more):
    """Runs a command with nothing of the build folder's package in its environment; returns standard output."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "SEXTANT_PROGRAM"))}
    done = subprocess.run(list(map(str, command)), cwd=cwd, env={**kept, **NO_NETWORK, **more}, capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")
    return done.stdout


class Install(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_wheel_runs_the_notebooks_in_a_new_environment(self):
        call(sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", self.folder, ROOT)
        wheel, = self.folder.glob("sextant-*.whl")
        call(sys.executable, "-m", "venv", "--system-site-packages", self.folder / "environment")
        python = self.folder / "environment" / "bin" / "python"
        call(python, "-m", "pip", "install", wheel)
        place, program = call(python, "-c", "import sextant; print(sextant.__file__); print(sextant.program())",
                              cwd=self.folder).splitlines()
        self.assertTrue(place.startswith(str(self.folder)), place)
        self.assertEqual(pathlib.Path(program), self.folder / "environment" / "bin" / "sextant")
        call(python, "-m", "ipykernel", "install", "--sys-prefix", "--name", "python3")
        call(python, "-B", ROOT / "eval/python/tests/run_notebooks.py", cwd=self.folder)

    def test_the_source_distribution_makes_itself_again(self):
        make = "import build_backend, sys; print(build_backend.build_sdist(sys.argv[1]))"
        archives, names = [], []
        source = ROOT
        for step in ("first", "second"):
            (self.folder / step).mkdir()
            name = call(sys.executable, "-B", "-c", make, self.folder / step, cwd=source / "eval/python").strip()
            archives.append(self.folder / step / name)
            with tarfile.open(archives[-1]) as archive:
                names.append(archive.getnames())
                archive.extractall(self.folder / step)
            source = self.folder / step / name.removesuffix(".tar.gz")
        self.assertEqual(names[0], names[1])
        tracked = subprocess.run(["git", "-C", str(ROOT), "ls-files"], capture_output=True, text=True)
        if tracked.returncode == 0:
            files = [name for name in tracked.stdout.splitlines() if (ROOT / name).is_file()]
            self.assertEqual(len(names[0]), len(files) + 1)  # and PKG-INFO
        call("cmake", "-G", "Ninja", "-S", source, "-B", self.folder / "build", "-DSEXTANT_TESTS=OFF", "-DSEXTANT_BENCHMARKS=OFF",
             "-DSEXTANT_PYTHON=ON")


if __name__ == "__main__":
    unittest.main()
