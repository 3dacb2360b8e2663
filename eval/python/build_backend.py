"""PEP 517 backend of `pip install .`: setuptools with a CMake step.

pip builds in an environment that contains only the packages that pyproject.toml requires, and would download them. Therefore
nothing is required, and setuptools and wheel are those of the system (scripts/setup --python).

SEXTANT_BUILD_DIR names the build folder. Without it, build/release is used if it was configured for the same Python, otherwise
build/wheel is made. The source distribution holds the files that git tracks; outside a git checkout, as in an unpacked source
distribution, it holds all files except those in build.
"""

import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
try:
    import setuptools
    import wheel  # noqa: F401
except ModuleNotFoundError:
    sys.path.append("/usr/lib/python3/dist-packages")
    for name in [name for name in sys.modules if name.split(".")[0] in ("setuptools", "pkg_resources", "_distutils_hack")]:
        del sys.modules[name]
    try:
        import setuptools
        import wheel  # noqa: F401
    except ModuleNotFoundError as missing:
        raise SystemExit(f"{missing.name} is missing: run scripts/setup --python") from None
from setuptools import build_meta  # noqa: E402
from setuptools.command.build_ext import build_ext  # noqa: E402

MODULES = ("core", "files", "inprocess")


def version():
    found = re.search(r"^project\(Sextant VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise SystemExit("CMakeLists.txt: expected a line that begins with 'project(Sextant VERSION <number>'")
    return found[1]


def call(*command, environment=None):
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise SystemExit("\n".join([*done.stdout.splitlines()[-40:], f"failed: {' '.join(map(str, command))}"]))


def build_folder(interpreter):
    """Returns the folder in which CMake builds, and the arguments that configure it."""
    if named := os.environ.get("SEXTANT_BUILD_DIR"):
        return pathlib.Path(named).resolve(), []
    release = ROOT / "build" / "release"
    cache = release / "CMakeCache.txt"
    known = re.search(r"^Python3_EXECUTABLE:\w+=(.*)$", cache.read_text(), re.MULTILINE) if cache.is_file() else None
    if known and os.path.realpath(known[1]) == interpreter and (release / "python").is_dir():
        return release, []
    return ROOT / "build" / "wheel", ["--preset", "release", "-DSEXTANT_TESTS=OFF", "-DSEXTANT_BENCHMARKS=OFF"]


class CMakeBuild(build_ext):
    """Builds the modules and the program by CMake; the program becomes bin/sextant of the environment."""

    def run(self):
        if shutil.which("cmake") is None:
            raise SystemExit("cmake is missing: run scripts/setup --python, which installs what the build needs")
        # A virtual environment hides Debian's numpy from its interpreter; the one that it was made from sees it.
        interpreter = os.path.realpath(sys.executable)
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        build, options = build_folder(interpreter)
        if options or not (build / "CMakeCache.txt").is_file():
            call("cmake", "-S", ROOT, "-B", build, *options, "-DSEXTANT_PYTHON=ON", f"-DPython3_EXECUTABLE={interpreter}",
                 environment=environment)
        jobs = os.environ.get("SEXTANT_JOBS", str(os.cpu_count() or 1))
        call("cmake", "--build", build, "-j", jobs, "--target", "sextant", *(f"sextant_python_{name}" for name in MODULES),
             environment=environment)
        for extension in self.extensions:
            target = pathlib.Path(self.build_lib, self.get_ext_filename(extension.name))
            self.place(build / "python" / "sextant" / target.name, target)
        program = pathlib.Path(self.build_temp, "sextant")
        self.place(build / "bin" / "sextant", program)
        self.distribution.data_files = [("bin", [str(program)])]

    @staticmethod
    def place(source, target):
        if not source.is_file():
            raise SystemExit(f"{source} was not built: expected a build folder for {sys.executable}; name one in SEXTANT_BUILD_DIR")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source, target)
        call("strip", "--strip-unneeded", target)


class Backend(build_meta._BuildMetaBackend):
    """Backend of setuptools with the arguments of setup() in place of a setup.py."""

    def run_setup(self, setup_script="setup.py"):
        work = pathlib.Path(os.environ.get("SEXTANT_BUILD_DIR") or ROOT / "build", "setuptools")
        work.mkdir(parents=True, exist_ok=True)
        setuptools.setup(
            name="sextant", version=version(), license="Apache-2.0", python_requires=">=3.10",
            description="Evaluation and benchmarking of multi-body visual odometry: noise, errors, records, and the program",
            long_description=(ROOT / "README.md").read_text(encoding="utf-8"), long_description_content_type="text/markdown",
            packages=["sextant"], package_dir={"sextant": "eval/python/sextant"},
            package_data={"sextant": ["py.typed", "*.pyi"]}, install_requires=["numpy"],
            extras_require={"pandas": ["pandas"], "plot": ["matplotlib"], "progress": ["tqdm"]},
            ext_modules=[setuptools.Extension(f"sextant._{name}", sources=[]) for name in MODULES],
            cmdclass={"build_ext": CMakeBuild}, script_args=sys.argv[1:],
            options={"egg_info": {"egg_base": str(work)}, "build": {"build_base": str(work)}})


def in_root(function, *arguments):
    """Calls a function in the folder ROOT, because setuptools resolves paths against the current folder."""
    before = os.getcwd()
    os.chdir(ROOT)
    try:
        return function(*arguments)
    finally:
        os.chdir(before)


def get_requires_for_build_wheel(config_settings=None):
    return []


def get_requires_for_build_sdist(config_settings=None):
    return []


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    return in_root(Backend().prepare_metadata_for_build_wheel, metadata_directory, config_settings)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    return in_root(Backend().build_wheel, wheel_directory, config_settings, metadata_directory)


def source_files():
    """Returns the paths of the source distribution's files, relative to ROOT and sorted."""
    listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if (ROOT / ".git").exists() and listed.returncode == 0:
        names = [name for name in listed.stdout.decode().split("\0") if name]
    else:
        names = [path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*")
                 if path.relative_to(ROOT).parts[0] not in ("build", "PKG-INFO")]
    return sorted(name for name in names if (ROOT / name).is_file())


def build_sdist(sdist_directory, config_settings=None):
    base = f"sextant-{version()}"
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH", 0)) or int((ROOT / "CMakeLists.txt").stat().st_mtime)
    with tarfile.open(pathlib.Path(sdist_directory, base + ".tar.gz"), "w:gz", format=tarfile.PAX_FORMAT) as archive:
        for name in source_files():
            entry = archive.gettarinfo(str(ROOT / name), f"{base}/{name}")
            entry.uid, entry.gid, entry.uname, entry.gname, entry.mtime = 0, 0, "", "", seconds
            with open(ROOT / name, "rb") as content:
                archive.addfile(entry, content if entry.isfile() else None)
        text = f"Metadata-Version: 2.1\nName: sextant\nVersion: {version()}\nLicense: Apache-2.0\n".encode()
        entry = tarfile.TarInfo(f"{base}/PKG-INFO")
        entry.size, entry.mtime = len(text), seconds
        archive.addfile(entry, io.BytesIO(text))
    return base + ".tar.gz"
