"""The records of a run or sweep as a pandas frame."""

import json
import pathlib

import numpy

from . import _core
from ._core import Error
from .arguments import path


def read(folder):
    """Reads records as a frame with one row per record and one flat column per field: dataset, sequence, estimator, noise, level,
    seed, frame, body, status, ..., errors_Et_m, values_v_kmh, bound_Et_m, time_ms_total (docs/metrics.md).

    Columns of texts are categorical; numbers that a record lacks are NaN. `attrs["run"]` contains run.json, if the folder has it.

    >>> run = sextant.run("synthetic:s18@0-2", estimator="motion_only")
    >>> sorted(sextant.read(run.out).status.unique())
    ['gated', 'ok']
    """
    try:
        import pandas  # imported here because nothing else needs it: a data loader starts in a tenth of the time
    except ImportError:
        raise Error("sextant.read needs pandas (Debian: python3-pandas); `sextant export` does not") from None
    folder = pathlib.Path(path("folder", folder))
    columns = {}
    for name, values, texts in _core.read_records(str(folder)):
        if texts is not None:
            order = sorted(range(len(texts)), key=texts.__getitem__)
            place = numpy.empty(len(texts) + 1, dtype=numpy.int32)
            place[order] = numpy.arange(len(texts))
            place[-1] = -1  # the value for -1 in `values`
            values = pandas.Categorical.from_codes(place[values], [texts[k] for k in order])
        columns[name] = values
    frame = pandas.DataFrame(columns, copy=False)
    run = folder / "run.json"
    if run.is_file():
        try:
            frame.attrs["run"] = json.loads(run.read_text(encoding="utf-8"))
        except ValueError as error:
            raise Error(f"{run}: not valid JSON: {error}") from None
        except RecursionError:
            raise Error(f"{run}: expected at most 100 levels of objects and lists, got more") from None
    return frame
