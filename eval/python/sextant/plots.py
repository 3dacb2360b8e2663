"""Figures of records, and the grids of noise of a sweep."""

import json

from . import _core
from ._core import Error


def _numbers(options, prefix=""):
    """Returns the numbers in the options of a noise by dotted key."""
    found = {}
    for key, value in options.items():
        found.update(_numbers(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value})
    return {key: value for key, value in found.items() if isinstance(value, (int, float))}


def _other(noise, key):
    """Returns the options of the models of a noise other than that of the number `key`."""
    return {model: options for model, options in noise.items() if model != key.partition(".")[0]}


def _swept(a, b):
    """Returns the keys of the numbers that are the level at both of two levels in run.json, whose other noise is equal. Noise without
    an effect is not listed, as at level 0. Returns {"scale"} if the numbers that differ are in the ratio of the levels."""
    numbers = [_numbers(level["noise"]) for level in (a, b)]

    def fits(key):
        others = [_other(level["noise"], key) for level in (a, b)]
        is_level = all(found.get(key, 0) == level["level"] for found, level in zip(numbers, (a, b)))
        is_equal = others[0] == others[1] or any(not level["noise"] and set(other) <= {"correlation"}
                                                 for level, other in ((a, others[1]), (b, others[0])))
        return is_level and is_equal

    keys = {key for key in {*numbers[0], *numbers[1]} if fits(key)}
    changed = [key for key in numbers[0] if numbers[0][key] != numbers[1].get(key)]
    if keys or not changed or numbers[0].keys() != numbers[1].keys() or not a["level"] or not b["level"]:
        return keys
    ratio = b["level"] / a["level"]
    return {"scale"} if all(abs(numbers[1][key] - ratio * numbers[0][key]) <= 1e-9 * abs(numbers[1][key]) for key in changed) else keys


def _grids_of(configured):
    """Returns the grid of each (noise, level) of run.json: its parameter, such as "depth.delta_d_px", with the other noise if several
    grids have this parameter. A grid consists of successive levels with one parameter."""
    def name(noise):
        return _core.Noise(json.dumps(noise)).name()

    grids, first, keys = [], 0, set()
    for i in range(1, len(configured) + 1):
        found = _swept(configured[i - 1], configured[i]) if i < len(configured) else set()
        longer = found & keys if i > first + 1 else found
        if not longer:
            if keys:
                grids.append((min(keys), configured[first:i]))
            first = i
        keys = longer
    parameters = [key for key, _ in grids]
    names = {}
    for key, levels in grids:
        highest = max(levels, key=lambda level: level["level"])["noise"]
        title = key if parameters.count(key) == 1 else f"{key} with {name(_other(highest, key))}"
        names.update({(name(level["noise"]), level["level"]): title for level in levels})
    return names


def grids_of(records):
    """Returns the grid of the noise of each record; the noise itself where run.json does not show a grid."""
    noise = records.noise.astype(str)
    try:
        names = _grids_of(records.attrs["run"]["configuration"]["noise"])
    except (Error, AttributeError, KeyError, TypeError):  # no run.json, or that of another version
        return noise
    grids = noise.copy()
    grids[:] = [names.get(key, key[0]) for key in zip(noise, records.level)]
    is_unique = records.assign(grid=grids, noise=noise).groupby(["grid", "level"]).noise.nunique().max() == 1
    return grids if is_unique else noise


def heading(metric):
    """Returns the symbol and the unit of a metric: "E_t [m]" for "Et_m"."""
    stem, _, unit = metric.rpartition("_")
    units = {"m": "m", "deg": "deg", "kmh": "km/h", "px": "px", "percent": "%"}
    if unit not in units or not stem:
        return metric
    symbol = f"E_{stem[1:]}" if stem in ("Et", "ER", "Ev") else stem.replace("_", " ")
    return f"{symbol} [{units[unit]}]"


def with_counted_errors(records):
    """Returns the records without the errors that are not counted in summaries: of bodies that are not estimated, are static by
    truth or whose true motion is unknown (has_truth() in records/record.h)."""
    errors = [name for name in records if name.startswith("errors_")]
    of_motion = [name for name in errors if not name.startswith("errors_epe_")]
    counted = (records.status == "ok") & records[of_motion].notna().any(axis=1)
    if "values_dynamic_gt" in records:
        counted &= records.values_dynamic_gt != 0
    records[errors] = records[errors].where(counted)
    return records


def draw_lines(records, column, over, groups, ax, *, rms=False, **style):
    """Draws means, or RMS values, of a column, with one line per group, and also per data set, sequence and grid of noise if there
    are several. A line over frames is interrupted at frames without a value."""
    groups = groups + [name for name in ("dataset", "sequence", "grid") if name in records and records[name].nunique() > 1]
    values = records.dropna(subset=[column])
    if rms:
        values = values.assign(**{column: values[column] ** 2})
    found = values.groupby([*groups, over], observed=True)[column].mean()
    for name, line in found.groupby(level=list(range(len(groups))), observed=True):
        line = line.droplevel(groups)
        if over == "frame":
            line = line.reindex(range(line.index.min(), line.index.max() + 1))
        ax.plot(line.index, line.values ** 0.5 if rms else line.values, **style,
                label=" ".join(map(str, name)) if isinstance(name, tuple) else str(name))


def draw_errors(records, metric, over, groups, ax, *, rms=False):
    column = f"errors_{metric}"
    known = sorted(name.removeprefix("errors_") for name in records if name.startswith("errors_"))
    with_values = [name for name in known if records[f"errors_{name}"].notna().any()]
    if metric not in (with_values or known):
        raise Error(f"metric: expected one of {', '.join(with_values or known)}, got {metric!r}")
    draw_lines(records, column, over, groups, ax, rms=rms, marker=".")
    ax.set_xlabel(over)
    ax.set_ylabel(f"{'RMS of' if rms else 'mean'} {heading(metric)}")
    ax.set_ylim(bottom=0)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax
