"""The folder of a run or sweep: the given one, or a temporary folder that exists as long as a result in this process."""

import os
import pathlib
import shutil
import tempfile
import weakref

from .arguments import path

_temporary = weakref.WeakValueDictionary()  # the folders of this process by name


class _Temporary:
    """A folder that is removed with the last reference to this object, which copies of a result share."""

    def __init__(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="sextant_"))
        _temporary[str(self.folder)] = self
        weakref.finalize(self, _remove, self.folder, os.getpid())

    def __reduce__(self):
        return _temporary_folder, (str(self.folder),)


def _temporary_folder(name):
    """Returns the object of this process that keeps the folder; None in another process, or if the folder was removed."""
    return _temporary.get(name)


def _remove(folder, owner):
    if os.getpid() == owner:  # not in a forked child
        shutil.rmtree(folder, ignore_errors=True)


def results_folder(out):
    """Returns (path, the object that keeps a temporary folder or None)."""
    if out is not None:
        return path("out", out), None
    kept = _Temporary()
    return str(kept.folder / "out"), kept
