"""The commands of the program as functions with typed results. Arguments are those of the command's flags; `progress=True`
shows progress (with tqdm if it is installed), `progress=f` calls f. If the program reports an error, an Error with its message
is raised. Without `out`, results are stored in a temporary folder that exists as long as the result object."""

import contextlib
import dataclasses
import json
import os
import pathlib
import tempfile
import typing

import numpy

from . import estimators as functions
from ._core import Error
from .arguments import SWITCHES, arguments_named, choice, json_text, number, numbers, optional, path, switch, text, whole
from .plots import draw_errors, draw_lines, grids_of, heading, with_counted_errors
from .program_call import Progress, ProgramError, call, checked_progress, program
from .records import read
from .results_folder import results_folder
from .showing import Shown, axes_of
from .trajectories import ErrorStatistics, measured, statistics_table

__all__ = ["Comparison", "EgoEvaluation", "Export", "Finding", "ObjectEvaluation", "Progress", "ProgramError", "Row", "Run",
           "Sweep", "compare", "evaluate_ego", "evaluate_objects", "export", "program", "run", "sweep"]


@dataclasses.dataclass(frozen=True, repr=False)
class Row(Shown):
    """One body in a summary. `metrics` has the keys of docs/metrics.md: Et_m, ER_deg, Ev_kmh, ..."""
    labels: dict  #: dataset, sequence, estimator; or preset, estimator
    body: str
    n_truth: int
    n_estimated: int
    coverage_percent: typing.Optional[float]
    metrics: dict
    other: str = ""  #: numbers of steps that are not ok, by status

    @staticmethod
    def of(row):
        row = dict(row)
        labels = {key: row.pop(key) for key in ("preset", "dataset", "sequence", "estimator") if key in row}
        body = row.pop("body", None) or row.pop("object", "")
        counts = {key: int(row.pop(key, 0)) for key in ("n_truth", "n_estimated")}
        coverage, other = row.pop("coverage_percent", None), row.pop("other", None) or ""
        metrics = {key: value for key, value in row.items() if isinstance(value, (int, float)) and key != "n_pairs"}
        return Row(labels, body, counts["n_truth"], counts["n_estimated"], coverage, metrics, other)


class _Folder(Shown):
    """Base class of results that are stored in a folder."""

    def records(self):
        """Returns sextant.read() of the folder, with one row per record."""
        return read(self.out)


@dataclasses.dataclass(frozen=True, repr=False)
class Run(_Folder):
    out: pathlib.Path
    preset: str
    aggregate: str
    rows: typing.List[Row]
    classification: dict
    warnings: typing.List[str]
    kept: object = dataclasses.field(default=None, repr=False, compare=False)  #: the temporary folder, if `out` was not given

    def _table(self):
        metrics = list(dict.fromkeys(key for row in self.rows for key in row.metrics))[:6]
        return ["estimator", "body", "n", *metrics], [
            [row.labels.get("estimator", ""), row.body, row.n_estimated, *(_digits(row.metrics.get(key)) for key in metrics)]
            for row in self.rows]

    def plot(self, metric="Et_m", ax=None):
        """Plots the errors that the rows summarise over the frames, averaged over seeds: of estimated bodies that move by truth. A
        line is interrupted where a body has no such error. Returns the axes.

        >>> sextant.run("synthetic:s18@0-3", estimator="motion_only").plot("ER_deg").get_ylabel()
        'mean E_R [deg]'
        """
        records = with_counted_errors(self.records())
        ax = draw_errors(records, metric, "frame", ["estimator", "body"], axes_of(ax))
        sources, noises = (list(dict.fromkeys(names)) for names in (records.dataset.str.cat(records.sequence, " "), records.noise))
        ax.set_title("\n".join(names[0] for names in (sources, noises) if len(names) == 1), fontsize="medium")
        return ax


@dataclasses.dataclass(frozen=True, repr=False)
class Sweep(_Folder):
    out: pathlib.Path
    cases: int
    cases_before: int  #: number of cases finished by an earlier call
    cases_stale: int  #: number finished by another version of an estimator: run again, or kept with reuse_stale
    n_records: int
    wall_time_s: float
    problems: typing.List[str]
    warnings: typing.List[str]
    kept: object = dataclasses.field(default=None, repr=False, compare=False)  #: the temporary folder, if `out` was not given

    def _table(self):
        """Mean errors of the camera and of all moving objects by estimator and level."""
        records = with_counted_errors(self.records())
        records = records.assign(body=records.body.map(lambda name: name if name == "ego" else "objects").astype(str))
        records = records[records.status == "ok"].assign(grid=grids_of(records))
        keys = [name for name in ("dataset", "sequence", "grid") if records[name].nunique() > 1]
        metrics = [name for name in ("errors_Et_m", "errors_ER_deg", "errors_Ev_kmh") if name in records]
        found = records.groupby(["estimator", *keys, "body", "level"], observed=True)[metrics].agg(["count", "mean"])
        rows = [[*map(str, key), int(line[metrics[0], "count"]), *("" if line[name, "mean"] != line[name, "mean"] else
                                                             _digits(line[name, "mean"]) for name in metrics)]
                for key, line in found.iterrows()] if metrics else []
        levels = records.grid.iloc[0] if len(records) and "grid" not in keys else "level"
        return ["estimator", *keys, "body", levels, "n", *(f"mean {heading(name.removeprefix('errors_'))}" for name in metrics)], rows

    def plot(self, metric="Et_m", ax=None, *, body="ego"):
        """Plots the error of a body against the noise level, one line for each estimator, sequence and grid of noise; returns the
        axes. If the records have a Cramer-Rao bound of the error, RMS errors and the RMS of the bound are drawn, because it limits
        RMS errors; otherwise mean errors.

        >>> plan = {"name": "p", "sources": ["synthetic:s18@0-2"], "estimators": ["motion_only"],
        ...         "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2]}, "seeds": 2}
        >>> axes = sextant.sweep(plan).plot()
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('depth.delta_d_px', 'mean E_t [m]')
        """
        records = self.records()
        records = records[records.body == body]
        if records.empty:
            raise Error(f"body: expected a body of the records, such as 'ego', got {body!r}")
        grids = grids_of(records)
        records = records.assign(grid=grids, bound="bound")
        bound = f"bound_{metric}"
        has_bound = bound in records and records[bound].notna().any()
        ax = draw_errors(records, metric, "level", ["estimator"], axes_of(ax), rms=has_bound)
        if has_bound:
            draw_lines(records, bound, "level", ["bound"], ax, rms=True, color="0.4", linestyle="--")
            ax.legend(fontsize="small")
        ax.set_xlabel(grids.iloc[0] if grids.nunique() == 1 else "level")
        ax.set_title(body)
        return ax


def _digits(value):
    return "" if value is None else f"{value:.4g}"


def _quiet(progress):
    """Returns whether a run or sweep with functions shows no progress."""
    progress = checked_progress(progress)
    if callable(progress):
        raise Error("progress: expected True or False, because the estimator is a function, got a function")
    return not progress


@dataclasses.dataclass(frozen=True)
class Finding:
    """One row of a comparison; `kind`: accuracy, speed, statuses or findings."""
    kind: str
    row: dict


@dataclasses.dataclass(frozen=True, repr=False)
class Comparison(Shown):
    verdict: str  #: ok, improved, regressed, inconclusive or invalid
    exit_code: int
    headline: str
    records: int  #: number of records that both sides have
    rows: typing.List[Finding]

    @property
    def cases(self):
        """Former name of `records`."""
        return self.records

    def __bool__(self):
        """Returns true if the verdict is ok or improved."""
        return self.verdict in ("ok", "improved")


@dataclasses.dataclass(frozen=True, repr=False)
class EgoEvaluation(Shown):
    """The evaluation of one estimate. With several estimates n, n_matched and statistics are None, and `systems` has one
    evaluation per estimate; with several lengths in `rpe` n and statistics are None, and `lengths` has the statistics."""
    n: typing.Optional[int]
    n_matched: typing.Optional[int]
    statistics: typing.Optional[ErrorStatistics]
    unit: str
    warnings: typing.List[str]
    details: dict  #: everything that --json prints
    name: str = ""
    systems: typing.List["EgoEvaluation"] = dataclasses.field(default_factory=list)  #: one per estimate, in the order given
    lengths: dict = dataclasses.field(default_factory=dict)  #: ErrorStatistics by length ("5m"); None: no poses that far apart

    @property
    def measured(self):
        """What was measured: "APE trans_part [m], align se3", or "RPE trans_part [m] over 10m, align none"."""
        lengths = self.lengths or dict.fromkeys(length for system in self.systems for length in system.lengths)
        delta = ", ".join(lengths) or self.details.get("delta", None if self.details.get("metric", "ape") == "ape" else "pairs")
        return measured(self.details.get("relation", ""), self.unit, delta, self.details.get("align", ""))

    def _columns(self):
        """Returns the statistics by system, or by length, or alone."""
        if len(self.systems) > 1:
            several = [{f"{system.name} {name}".strip(): found for name, found in system._columns().items()} for system in self.systems]
            return {name: found for each in several for name, found in each.items()}
        return self.lengths or {"": self.statistics}

    def _shown(self):
        found = [(f"rmse {name}".strip(), "none" if of is None else f"{of.rmse:.6g} {self.unit}".strip())
                 for name, of in self._columns().items()]
        n = [("errors", self.n), ("poses", self.n_matched), ("warnings", len(self.warnings))]
        return found + [("measured", self.measured)] + [(name, str(count)) for name, count in n if count]

    def _table(self):
        return statistics_table(self.measured, self.unit, self._columns())

    def plot(self, ax=None):
        """Draws the RMSE, the mean and the largest error as bars, of every system or length; returns the axes.

        >>> path = numpy.tile(numpy.eye(4), (9, 1, 1))
        >>> path[:, 2, 3] = numpy.arange(9)
        >>> sextant.write_trajectory("truth.txt", path)
        >>> sextant.evaluate_ego("truth.txt", "truth.txt", format="kitti").plot().get_ylabel()
        'error [m]'
        """
        ax, columns = axes_of(ax), {name: found for name, found in self._columns().items() if found is not None}
        for k, name in enumerate(("rmse", "mean", "max")):
            ax.bar([i + 0.27 * (k - 1) for i in range(len(columns))], [getattr(found, name) for found in columns.values()], 0.25, label=name)
        fits = max(map(len, columns), default=0) * len(columns) < 60  # characters side by side below the axis
        ax.set_xticks(range(len(columns)), columns, **({} if fits else {"rotation": 40, "ha": "right", "rotation_mode": "anchor"}))
        ax.set_ylabel(f"error{f' [{self.unit}]' if self.unit else ''}")
        ax.set_title(self.measured, fontsize="medium")
        ax.legend(fontsize="small")
        return ax

    @staticmethod
    def of(answer, unit):
        """Returns the evaluation of one estimate from its JSON."""
        lengths = {row["delta"]: ErrorStatistics(**row["stats"]) if "stats" in row else None for row in answer.get("rpe", [])}
        n, found = (None, None) if lengths else (answer["n"], ErrorStatistics(**answer["stats"]))
        return EgoEvaluation(n, answer["n_matched"], found, unit, [warning["text"] for warning in answer["warnings"]], answer,
                             answer["name"], [], lengths)


@dataclasses.dataclass(frozen=True, repr=False)
class ObjectEvaluation(Shown):
    rows: typing.List[Row]  #: one per preset and object; the object "all" stands for all objects together
    warnings: typing.List[str]
    details: dict


@dataclasses.dataclass(frozen=True, repr=False)
class Export(Shown):
    out: pathlib.Path
    records: int
    columns: int


def _texts(name, values):
    if isinstance(values, (str, os.PathLike)):
        values = [values]
    try:
        found = [path(name, value) for value in values]
    except TypeError:
        raise Error(f"{name}: expected a text or a list of them, got {values!r}") from None
    if not found:
        raise Error(f"{name}: expected at least one, got none")
    for value in found:
        if value.startswith("-"):
            raise Error(f"{name}: expected no flag, got {value!r}: write ./ before the name of a file")
    return found


def _flags(**given):
    """Returns the flags --name=value; None and False give nothing. Every flag has a value, so none can take the next argument."""
    return [f"--{name.replace('_', '-')}={'true' if value is True else text(name, str(value))}"
            for name, value in given.items() if value is not None and value is not False]


def _joined(value):
    """Returns a list, tuple or array as the text that the program expects, such as "0,0,1"; other values unchanged."""
    if not isinstance(value, (list, tuple, numpy.ndarray)):
        return value
    return ",".join(map(str, numpy.ravel(value).tolist()))


def _data_folder(data):
    """Returns the folder of data sets: the argument, else $SEXTANT_DATA, else None."""
    return optional(path, "data", data if data is not None else os.environ.get("SEXTANT_DATA") or None)


def _noise_text(noise):
    return json_text("noise", noise.options if hasattr(noise, "options") else noise)


def _read(plan):
    try:
        return pathlib.Path(path("plan", plan)).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise Error(f"plan: cannot read {plan}: {error}") from None


@contextlib.contextmanager
def _plan_file(plan):
    """Yields the name of a file that contains the plan. Errors call a dict `plan`, and say how a sweep gets functions."""
    with contextlib.ExitStack() as kept:
        if isinstance(plan, dict):
            file = pathlib.Path(kept.enter_context(tempfile.TemporaryDirectory(prefix="sextant"))) / "plan.json"
            file.write_text(json_text("plan", plan), encoding="utf-8")
        else:
            file = _texts("plan", [plan])[0]
        try:
            yield str(file)
        except ProgramError as error:
            message = _named_plan(error.args[0], file) if isinstance(plan, dict) else error.args[0]
            if "unknown estimator 'python:" in message:
                message += ("; python:NAME is a function of the argument estimators, such as "
                            "sextant.sweep(plan, estimators={'NAME': function})")
            error.args = (message, *error.args[1:])
            raise


def _named_plan(message, file):
    """Returns a message about the file of a dict that names the argument; a dict has no lines."""
    return message.replace(f"{file}:1:", "plan:").replace(str(file), "plan")


@arguments_named
def run(sources, *, out=None, estimator="joint_flow", noise="none", options=None, seeds=1, level=0.0, procedure=None, preset="paper",
        jobs=None, data=None, force=False, progress=None) -> Run:
    """Runs `sextant run`. `estimator` may be a function of a sextant.Problem, which then runs in this process.

    >>> sextant.run("synthetic:s18@0-2", estimator="motion_only")
    Run(out: ..., preset: 'paper', ...)
    """
    sources = _texts("sources", sources)
    out, kept = results_folder(out)
    seeds, level, force = whole("seeds", seeds, 1, 1000000), number("level", level), switch("force", force)
    jobs = None if jobs is None else whole("jobs", jobs, 1, 1024)
    data = _data_folder(data)
    if callable(estimator):
        if procedure is not None:
            raise Error("procedure: expected None with a function as estimator")
        name = functions.name_of(estimator)
        with functions.added({name: estimator}) as inprocess:
            summary = json.loads(inprocess.run(
                sources, f"python:{name}", json_text("options", options or {}), _noise_text(noise), data or "", level, seeds,
                jobs or os.cpu_count(), text("preset", preset), out, force, _quiet(progress)))
        warnings = summary["problems"]
    else:
        if text("estimator", estimator).startswith("python:"):
            raise Error(f"estimator: expected a function or the name of an estimator, got {estimator!r}: give the function itself")
        flags = _flags(out=out, estimator=estimator, noise=_noise_text(noise), seeds=seeds, level=level,
                       options=optional(json_text, "options", options), procedure=procedure,
                       preset=text("preset", preset), jobs=jobs, data=data, force=force)
        _, summary, warnings = call(["run", *sources, *flags, "--json"], progress=progress)
    return Run(pathlib.Path(out), summary["preset"], summary["aggregate"], [Row.of(row) for row in summary["rows"]],
               summary["classification"], warnings, kept)


@arguments_named
def sweep(plan, *, out=None, estimators=None, cache=None, jobs=None, data=None, force=False, reuse_stale=False, progress=None) -> Sweep:
    """Runs `sextant sweep` on a plan, a file or a dict. `estimators`: functions by name, to which the plan refers as python:NAME.
    Finished cases of a function that has changed are run again, or kept with `reuse_stale`; `force` starts over.

    >>> plan = {"name": "p", "sources": ["synthetic:s18@0-2"], "estimators": ["motion_only"],
    ...         "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]}, "seeds": 2}
    >>> sextant.sweep(plan).cases
    2
    """
    out, kept = results_folder(out)
    jobs = None if jobs is None else whole("jobs", jobs, 1, 1024)
    data, cache = _data_folder(data), optional(path, "cache", cache)
    force, reuse_stale = switch("force", force), switch("reuse_stale", reuse_stale)
    if estimators:
        content = json_text("plan", plan) if isinstance(plan, dict) else _read(plan)
        name = "plan" if isinstance(plan, dict) else path("plan", plan)
        with functions.added(estimators) as inprocess:
            try:
                done = json.loads(inprocess.sweep(content, name, data or "", cache or "", jobs or os.cpu_count(), out, force,
                                                  reuse_stale, _quiet(progress)))
            except Error as error:
                if isinstance(plan, dict):
                    error.args = (_named_plan(str(error), name),)
                raise
        warnings = []
    else:
        with _plan_file(plan) as file:
            flags = _flags(out=out, cache=cache, jobs=jobs, data=data, force=force, reuse_stale=reuse_stale)
            _, done, warnings = call(["sweep", file, *flags, "--json"], progress=progress)
        if isinstance(plan, dict):
            warnings = [_named_plan(text, file) for text in warnings]
    return Sweep(pathlib.Path(out), done["cases"], done["cases_before"], done["cases_stale"], done["records"],
                 done["wall_time_s"], done["problems"], warnings, kept)


@arguments_named
def compare(base, new, *, policy=None, only=None, allow=(), out=None, jobs=None) -> Comparison:
    """Runs `sextant compare`. The result is true if its verdict is ok or improved; the verdict is invalid if `base` and `new` are
    not comparable.

    >>> run = sextant.run("synthetic:s18@0-2", estimator="motion_only")
    >>> sextant.compare(run.out, run.out, only="accuracy").verdict
    'ok'
    """
    if only is not None:
        choice("only", only, ("accuracy", "speed"))
    allowed = [flag for what in (_texts("allow", allow) if allow not in ((), []) else []) for flag in _flags(allow=what)]
    flags = _flags(policy=optional(path, "policy", policy), only=only, out=optional(path, "out", out), jobs=jobs)
    _, answer, _ = call(["compare", *_texts("base", base), *_texts("new", new), *flags, *allowed, "--json"],
                      good=(0, 1, 2, 3))
    rows = [Finding(kind, row) for kind in ("findings", "statuses", "accuracy", "speed") for row in answer[kind]]
    return Comparison(answer["verdict"], answer["exit_code"], answer["headline"], answer["cases"], rows)


@arguments_named
def evaluate_ego(reference, estimates, *, align="none", relation="trans_part", rpe=None, all_pairs=False, format=None,
                 out=None, save_zip=None, data=None, **flags) -> EgoEvaluation:
    """Runs `sextant evaluate ego` on files, each FILE or SYSTEM=FILE. Several lengths in `rpe` are a text, "1f,10m", or a list. Other
    flags are given by name: n_to_align=100, offset=0.2, estimate_offset=True, up=(0, 0, 1), body_from_camera="..." or an array.

    >>> path = numpy.tile(numpy.eye(4), (9, 1, 1))
    >>> path[:, 2, 3] = numpy.arange(9)
    >>> sextant.write_trajectory("truth.txt", path)
    >>> sextant.evaluate_ego("truth.txt", "truth.txt", format="kitti").statistics.rmse
    0.0
    """
    flags.update({name: switch(name, flags[name]) for name in SWITCHES if name in flags})
    if not isinstance(flags.get("up"), (str, type(None))):
        flags["up"] = numbers("up", flags["up"], 3)
    flags.update({name: _joined(flags[name]) for name in ("up", "body_from_camera", "ref_body_from_camera") if name in flags})
    arguments = ["evaluate", "ego", *_texts("reference", reference), *_texts("estimates", estimates),
                 *_flags(align=text("align", align), relation=text("relation", relation), rpe=_joined(rpe),
                         all_pairs=switch("all_pairs", all_pairs),
                         format=format, out=optional(path, "out", out), save_zip=optional(path, "save_zip", save_zip),
                         data=data, **flags), "--json"]
    _, answer, warnings = call(arguments)
    common = {key: answer[key] for key in ("metric", "relation", "unit", "align", "up", "delta", "all_pairs") if key in answer}
    systems = [EgoEvaluation.of({**common, **run}, answer["unit"]) for run in answer.get("runs", [answer])]
    if len(systems) == 1:
        return dataclasses.replace(systems[0], warnings=warnings + systems[0].warnings, systems=systems)
    warnings += [f"{system.name}: {text}" for system in systems for text in system.warnings]
    return EgoEvaluation(None, None, None, answer["unit"], warnings, answer, "", systems)


@arguments_named
def evaluate_objects(folders, *, format, preset=None, truth=None, rate=None, stage=None, out=None, data=None) -> ObjectEvaluation:
    """Runs `sextant evaluate objects` on folders of logs.

    >>> sextant.evaluate_objects("no_such_folder", format="dynosam")
    Traceback (most recent call last):
    ...
    sextant.program_call.ProgramError: no_such_folder...
    """
    arguments = ["evaluate", "objects", *_texts("folders", folders),
                 *_flags(format=text("format", format), preset=preset, truth=truth, rate=rate, stage=stage,
                         out=optional(path, "out", out), data=data), "--json"]
    _, answer, _ = call(arguments)
    rows = [Row.of({"preset": preset_rows["preset"], **row}) for preset_rows in answer["presets"] for row in preset_rows["rows"]]
    return ObjectEvaluation(rows, answer["warnings"], answer)


@arguments_named
def export(folder, *, format, out) -> Export:
    """Runs `sextant export`: writes the records of a folder as csv, npz or sqlite.

    >>> run = sextant.run("synthetic:s18@0-2", estimator="motion_only")
    >>> sextant.export(run.out, format="csv", out="records.csv")
    Export(out: records.csv, records: ..., columns: ...)
    """
    _, answer, _ = call(["export", *_texts("folder", folder),
                       *_flags(format=choice("format", format, ("csv", "npz", "sqlite")), out=path("out", out)), "--json"])
    return Export(pathlib.Path(answer["out"]), answer["records"], answer["columns"])
