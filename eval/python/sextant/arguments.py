"""Arguments that are no arrays: numbers, texts, options. Messages are as those of arrays."""

import json
import math
import numbers
import os

from ._core import Error


def whole(name, value, low, high):
    """An int within low..high."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise Error(f"{name}: expected a whole number, got {value!r} of type {type(value).__name__}")
    if not low <= value <= high:
        raise Error(f"{name}: expected {low} to {high}, got {value}")
    return int(value)


def number(name, value, *, above=-math.inf):
    """A finite float above a limit."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise Error(f"{name}: expected a number, got {value!r} of type {type(value).__name__}")
    if not (math.isfinite(value) and value > above):
        limit = "" if above == -math.inf else f" above {above:g}"
        raise Error(f"{name}: expected a finite number{limit}, got {value!r}")
    return float(value)


def text(name, value):
    if not isinstance(value, str):
        raise Error(f"{name}: expected a text, got {value!r} of type {type(value).__name__}")
    return unicode(name, value)


def unicode(name, value):
    """A str that UTF-8 can hold."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise Error(f"{name}: expected Unicode text, got the lone surrogate {value[error.start]!r} at character "
                    f"{error.start + 1}") from None
    return value


def path(name, value):
    """A path as a str. The program takes names that are UTF-8 alone."""
    try:
        value = os.fsdecode(value)
        value.encode("utf-8")
    except TypeError:
        raise Error(f"{name}: expected a path, got {value!r} of type {type(value).__name__}") from None
    except UnicodeEncodeError:
        raise Error(f"{name}: expected a path that is UTF-8, got {value!r}: rename the file or folder") from None
    return value


def choice(name, value, known):
    if value not in known:
        raise Error(f"{name}: expected one of {', '.join(known)}, got {value!r}")
    return value


def json_text(name, value):
    """What is JSON already, as it is; else an object of dicts, lists, numbers and texts."""
    if isinstance(value, str):
        return unicode(name, value)
    if not isinstance(value, dict):
        raise Error(f"{name}: expected a dict or JSON text, got {value!r} of type {type(value).__name__}")
    try:
        return json.dumps(value, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: expected what JSON can hold, got {value!r}: {error}") from None
    except RecursionError:
        raise Error(f"{name}: expected at most 100 levels of dicts and lists, got more") from None
