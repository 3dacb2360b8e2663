"""Checks of arguments: arrays, numbers, texts, options. Each raises an Error with the argument's name if it is invalid."""

import functools
import inspect
import json
import math
import os
import re
from numbers import Integral, Real

import numpy

from ._core import Error


_FLAG = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)(?: (none|origin|se3|sim3|scale|yaw|trans_part|rot_part|angle_deg|angle_rad|full|"
                   r"point_distance|[-+]?\d[\w.]*)\b)?")
_OTHER_NAMES = {"rpe": "delta", "delta_tolerance": "tolerance", "align": "method"}  #: arguments that are not named as their flag
#: Flags of `sextant evaluate ego` without a value. evaluate_ego() takes them, and those with a value, by name.
SWITCHES = ("estimate_offset", "inverse", "ref_inverse", "pairs_from_reference", "quiet")
_OF_EVALUATE_EGO = (*SWITCHES, "rate", "interpolate", "t_start", "t_end", "format", "ref_format", "est_format", "axes", "ref_axes",
                    "body_from_camera", "ref_body_from_camera", "covariance")


def arguments_named(function):
    """Returns the function, whose Errors give advice by its arguments where the program's messages name flags: "align='se3'" for
    "--align se3". A flag of `sextant evaluate ego` that the function does not have is called an argument of evaluate_ego; any other
    stays as it is."""
    parameters = inspect.signature(function).parameters
    takes_all = any(each.kind == inspect.Parameter.VAR_KEYWORD for each in parameters.values())

    def argument(found):
        name, value = found[1].replace("-", "_"), found[2]
        if name not in parameters and _OTHER_NAMES.get(name) in parameters:
            name = _OTHER_NAMES[name]
        whose = "" if name in parameters or takes_all else " of sextant.evaluate_ego"
        if name == "help" or whose and name not in _OF_EVALUATE_EGO:
            return found[0]
        if name in SWITCHES or name in parameters and parameters[name].default is False:
            return f"{name}=True{whose}{f' {value}' if value else ''}"
        if value is None:
            return f"{name}{whose}"
        try:
            float(value)
        except ValueError:
            value = repr(value)
        return f"{name}={value}{whose}"

    @functools.wraps(function)
    def named(*values, **others):
        try:
            return function(*values, **others)
        except Error as error:
            if error.args and isinstance(error.args[0], str):
                message = error.args[0]
                if takes_all and message.startswith("unknown flag"):  # a list of names follows
                    message = re.sub(r"--([a-z-]+)", lambda flag: flag[1].replace("-", "_"), message.replace(" --help,", ""))
                    message = message.replace("unknown flag", "unknown argument")
                error.args = (_FLAG.sub(argument, message), *error.args[1:])
            raise

    return named


def whole(name, value, low, high):
    """Returns an int within low..high."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise Error(f"{name}: expected a whole number, got {value!r} of type {type(value).__name__}")
    if not low <= value <= high:
        raise Error(f"{name}: expected {low} to {high}, got {value}")
    return int(value)


def switch(name, value):
    """Returns a bool. A text is refused, because bool("False") is True."""
    if not isinstance(value, (bool, numpy.bool_)):
        raise Error(f"{name}: expected True or False, got {value!r} of type {type(value).__name__}")
    return bool(value)


def number(name, value, *, above=-math.inf, low=-math.inf, high=math.inf):
    """Returns a finite float above a bound, and within low..high."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise Error(f"{name}: expected a number, got {value!r} of type {type(value).__name__}")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not (math.isfinite(found) and found > above and low <= found <= high):
        limit = f" above {above:g}" if above > -math.inf else f" from {low:g} to {high:g}" if high < math.inf else \
            f" of at least {low:g}" if low > -math.inf else ""
        raise Error(f"{name}: expected a finite number{limit}, got {found if found == math.inf else repr(value)}")
    return found


def numbers(name, value, n, **limits):
    """Returns a list of n finite floats."""
    try:
        found = [number(name, each, **limits) for each in value]
    except TypeError:
        raise Error(f"{name}: expected {n} numbers, got {value!r} of type {type(value).__name__}") from None
    if len(found) != n:
        raise Error(f"{name}: expected {n} numbers, got {len(found)}")
    return found


def text(name, value):
    """Returns a str that is not empty."""
    if not isinstance(value, str):
        raise Error(f"{name}: expected a text, got {value!r} of type {type(value).__name__}")
    return _filled(name, unicode(name, value))


def _filled(name, value):
    """Returns a str for the program, where an empty one would be no value and a zero byte would end it."""
    if not value:
        raise Error(f"{name}: expected a text, got an empty one")
    if "\0" in value:
        raise Error(f"{name}: expected a text without zero bytes, got {value!r}")
    return value


def unicode(name, value):
    """Returns a str that UTF-8 can represent."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise Error(f"{name}: expected Unicode text, got the lone surrogate {value[error.start]!r} at character "
                    f"{error.start + 1}") from None
    return value


def path(name, value):
    """Returns a path as a str. The program accepts only names in UTF-8."""
    try:
        value = os.fsdecode(value)
        value.encode("utf-8")
    except TypeError:
        raise Error(f"{name}: expected a path, got {value!r} of type {type(value).__name__}") from None
    except UnicodeEncodeError:
        raise Error(f"{name}: expected a path that is UTF-8, got {value!r}: rename the file or folder") from None
    return _filled(name, value)


def optional(check, name, value):
    """Returns the checked value; None for None."""
    return None if value is None else check(name, value)


def choice(name, value, known):
    if value not in known:
        raise Error(f"{name}: expected one of {', '.join(known)}, got {value!r}")
    return value


def _plain(value):
    """Returns the plain number or list of a scalar or array of numpy; a float32 as the decimal that it prints, 0.2."""
    if isinstance(value, numpy.ndarray) and not isinstance(value, numpy.ma.MaskedArray):
        return [_plain(each) for each in value] if value.ndim else _plain(value[()])
    if isinstance(value, numpy.floating):
        return float(str(value))
    if isinstance(value, (numpy.integer, numpy.bool_, numpy.str_)):
        return value.item()
    raise TypeError(f"{value!r} of type {type(value).__name__} is no dict, list, number or text")


def json_text(name, value):
    """Returns JSON: a str unchanged, otherwise an object of dicts, lists, numbers and texts, also of numpy."""
    if isinstance(value, str):
        return unicode(name, value)
    if not isinstance(value, dict):
        raise Error(f"{name}: expected a dict or JSON text, got {value!r} of type {type(value).__name__}")
    try:
        return json.dumps(value, allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: expected values that JSON can represent, got {value!r}: {error}") from None
    except RecursionError:
        raise Error(f"{name}: expected at most 100 levels of dicts and lists, got more") from None


def floats(name, value, dtype=numpy.float64):
    """Returns a C-contiguous array of the type `dtype`, converted from lists, whole numbers and other floats; None for None."""
    if value is None:
        return None
    if isinstance(value, numpy.ma.MaskedArray):
        raise Error(f"{name}: expected an array without a mask, got a masked one: give {name}.filled(numpy.nan)")
    try:
        array = numpy.asarray(value)
    except ValueError:
        raise Error(f"{name}: expected an array, got a list whose rows differ in length") from None
    if array.dtype.kind not in "fiu":
        raise Error(f"{name}: expected numbers, got {array.dtype} of type {type(value).__name__}")
    if array.ndim == 0:
        raise Error(f"{name}: expected an array, got the number {array}")
    with numpy.errstate(over="ignore"):  # infinite values are rejected where they are used
        return numpy.ascontiguousarray(array, dtype=dtype)


def ascending(name, value, n):
    """Returns n finite numbers, each above the one before, as an array; None for None."""
    array = floats(name, value)
    if array is None:
        return None
    if array.shape != (n,):
        raise Error(f"{name}: expected {n} numbers, one per pose, got shape {array.shape}")
    if not numpy.isfinite(array).all():
        raise Error(f"{name}: expected finite numbers, got {array[~numpy.isfinite(array)][0]}")
    if (numpy.diff(array) <= 0).any():
        k = int(numpy.argmax(numpy.diff(array) <= 0))
        raise Error(f"{name}: expected each above the one before, got {array[k + 1]:.17g} after {array[k]:.17g} at [{k + 1}]")
    return array


def poses(name, value):
    """Returns the array (n, 4, 4) of a path, which is a Trajectory, an array or lists."""
    return floats(name, getattr(value, "poses", value))
