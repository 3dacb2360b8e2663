"""Display of results: a short line, a table with a picture in a notebook, and figures by matplotlib."""

import base64
import dataclasses
import html
import io
import pathlib

import numpy

from ._core import Error

__all__ = ["Shown", "axes_of", "figure_html"]


def _short(value):
    """Returns a value in a few words; empty if it should not be shown."""
    if isinstance(value, numpy.ndarray):
        return f"{value.dtype} {value.shape}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, pathlib.Path):
        return str(value)
    if isinstance(value, (list, tuple, dict)):
        return f"{len(value)}" if value else ""
    if value is None or value == "":
        return ""
    return str(value) if isinstance(value, Shown) or not isinstance(value, str) else repr(value)


class Shown:
    """Mixin of dataclasses: a repr of one short line, and the fields as a table in a notebook."""

    def _shown(self):
        """Returns (name, text) of the fields that are shown."""
        fields = ((field.name, _short(getattr(self, field.name))) for field in dataclasses.fields(self) if field.repr)
        return [(name, text) for name, text in fields if text]

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{name}: {text}' for name, text in self._shown())})"

    def _table(self):
        """Returns the titles of the columns, and rows of texts."""
        return [], [list(row) for row in self._shown()]

    def _repr_html_(self):
        titles, rows = self._table()
        head = "<tr>" + "".join(f"<th>{html.escape(title)}</th>" for title in titles) + "</tr>" if titles else ""
        body = "".join("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
        return f"<b>{type(self).__name__}</b><table>{head}{body}</table>{figure_html(self)}"


def axes_of(ax=None, n=1, figsize=(6, 4)):
    """Returns the axes to draw on: the given ones, or new ones of matplotlib, which is imported only here."""
    if ax is not None:
        if not (hasattr(ax, "plot") if n == 1 else numpy.shape(ax) == (n,)):
            raise Error(f"ax: expected {n} axes of matplotlib, got {ax!r}")
        return ax
    try:
        import matplotlib.pyplot
    except ImportError:
        raise Error("plot needs matplotlib (Debian: python3-matplotlib)") from None
    return matplotlib.pyplot.subplots(1, n, figsize=figsize, layout="constrained")[1]


def figure_html(result):
    """Returns the picture drawn by .plot() as HTML; empty without .plot() or matplotlib, and if plotting raises an Error."""
    if not hasattr(result, "plot"):
        return ""
    n = getattr(result, "_n_axes", 1)
    try:
        from matplotlib.figure import Figure  # not pyplot, which a notebook sets up for its own figures
        figure = Figure(figsize=(6 if n == 1 else 11, 4), layout="constrained")
        result.plot(ax=figure.subplots(1, n))
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=80)
    except (ImportError, Error):
        return ""
    return f'<img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'
