"""Fingerprint of a Python function used as an estimator, by content (eval/records/provenance.h).

Its parts are named by their kind: "function mine", "global gain of mine", "file helper.py". They are collected from the function:

  functions   byte code, constants, defaults, attributes; the values of closure cells and of the globals that the code names,
              and so on from there
  classes     bases and members; objects: their class and their state
  modules     those of the user: the source file, the files that it imports, and the values of the module that the code
              names; all others (installed packages, the standard library): name and version
  numbers, texts, lists, dicts, sets, numpy arrays: by content
  objects of installed packages: their state as pickle would store it, so a data frame counts with its index and columns

The user's modules are those that are neither in the standard library nor installed in site-packages, or that belong to the same
package as the function. Objects without comparable content (a file, a lock, a generator) are named in `not_seen`.
Paths, addresses, line numbers and comments of functions are ignored; files are compared as a whole.
"""

import ast
import dis
import functools
import hashlib
import importlib.machinery
import pathlib
import sys
import sysconfig
import types

import numpy

#: Types whose values are compared by their text. A class derived from one of them may hold more than this text.
_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis), type(NotImplemented), range, slice)
_BUILTIN = (types.BuiltinFunctionType, types.MethodWrapperType, types.WrapperDescriptorType, types.MethodDescriptorType,
            types.ClassMethodDescriptorType, types.GetSetDescriptorType, types.MemberDescriptorType, numpy.ufunc)
#: Members of a class that do not affect its behaviour.
_OF_EVERY_CLASS = {"__dict__", "__weakref__", "__module__", "__doc__", "__qualname__", "__annotations__", "__firstlineno__",
                   "__static_attributes__", "__abstractmethods__", "_abc_impl", "__dataclass_fields__", "__match_args__"}
_OF_EVERY_FUNCTION = {"__wrapped__", "__doc__", "__annotations__"}
_MADE_BY_A_CLASS_STATEMENT = 1 << 9  #: Py_TPFLAGS_HEAPTYPE
#: Type of the objects that functools.lru_cache makes in C; the user's function is their __wrapped__.
_CACHES = (functools._lru_cache_wrapper,)
#: A user's class derived from one of these has content in addition to its attributes.
_CONTAINERS = (list, tuple, set, frozenset, dict, str, bytes, bytearray, int, float, complex)
#: Attributes with which numpy implements its own subclasses of ndarray; what they mean is compared by _array().
_OF_NUMPY = {*vars(numpy.ma.array(0.0)), "_mmap", "filename", "offset", "mode"}


def _installed_folders():
    paths = sysconfig.get_paths()
    return [pathlib.Path(paths[name]).resolve() for name in ("stdlib", "platstdlib", "purelib", "platlib")]


def _sha256(text):
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _code_text(code):
    constants = [_code_text(c) if isinstance(c, types.CodeType) else _constant_text(c) for c in code.co_consts]
    return repr((code.co_code.hex(), constants, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars,
                 code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags,
                 getattr(code, "co_exceptiontable", b"").hex()))


def _constant_text(constant):
    if isinstance(constant, frozenset):
        return f"frozenset({sorted(map(_constant_text, constant))})"
    if isinstance(constant, tuple):
        return f"({', '.join(map(_constant_text, constant))},)"
    return f"{type(constant).__name__} {constant!r}"


def _codes(code):
    """Yields `code`, and the code of the functions that it contains."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _compiled_base(kind):
    """Returns the class, `kind` or the first of its bases, whose instances are made by compiled code; object: none but Python's own."""
    return next(base for base in kind.__mro__ if not base.__flags__ & _MADE_BY_A_CLASS_STATEMENT
                or isinstance(vars(base).get("__new__"), types.BuiltinFunctionType))


class _Finder:
    def __init__(self, package):
        self.parts, self.not_seen = {}, []
        self._package = package  # of the function; "" or __main__: none
        self._installed = _installed_folders()
        self._named = {}  # id of an object that is a part -> its name
        self._first = {}  # id of an object that was looked at -> where
        self._alive = []  # so that no id is reused
        self._open = []  # (name, function that computes the part's text)
        self._files = set()

    def fingerprint(self, function):
        text = self._value(function, "the estimator")
        while self._open:
            name, part = self._open.pop(0)
            self.parts[name] = _sha256(part(name))
        self.parts["estimator"] = _sha256(text)
        return {"parts": dict(sorted(self.parts.items())), "not_seen": sorted(set(self.not_seen))}

    # ---- parts

    def _part(self, thing, kind, name, text):
        """Registers `thing` as a part, whose text the function `text` will compute; returns its name."""
        if id(thing) in self._named:
            return self._named[id(thing)]
        unique, n = f"{kind} {name}", 1
        while unique in self._named.values():
            n += 1
            unique = f"{kind} {name} ({n})"
        self._named[id(thing)] = unique
        self._alive.append(thing)
        self._open.append((unique, text))
        return unique

    def _variable(self, name, of, value):
        """Adds a global, a closure cell or a default."""
        where = f"{name} of {of}"
        try:
            text = self._value(value, where)
        except RecursionError:
            self.not_seen.append(f"{where}: too deep to compare")
            text = ""
        self.parts[where] = _sha256(text)

    def _function(self, function):
        code = function.__code__

        def text(part):
            of = part.split(" ", 1)[1]
            for name, cell in zip(code.co_freevars, function.__closure__ or ()):
                try:
                    self._variable(f"closure {name}", of, cell.cell_contents)
                except ValueError:
                    continue  # not bound yet
            defaults = function.__defaults__ or ()
            for name, value in zip(code.co_varnames[code.co_argcount - len(defaults):], defaults):
                self._variable(f"default {name}", of, value)
            for name, value in (function.__kwdefaults__ or {}).items():
                self._variable(f"default {name}", of, value)
            for name, value in sorted(vars(function).items()):
                if name not in _OF_EVERY_FUNCTION:
                    self._variable(f"attribute {name}", of, value)
            if hasattr(function, "__wrapped__"):
                self._variable("wrapped function", of, function.__wrapped__)
            self._globals(code, function.__globals__, of)
            return _code_text(code)

        return self._part(function, "function", function.__qualname__, text)

    def _globals(self, code, of_module, of):
        for one in _codes(code):
            instructions = list(dis.get_instructions(one))
            for instruction in instructions:
                if instruction.opname in ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS"):
                    name = instruction.argval
                    if name in of_module and not name.startswith("__"):
                        self._variable(f"global {name}", of, of_module[name])
                        self._members(of_module[name], one.co_names, name, of)
                elif instruction.opname == "IMPORT_NAME":
                    package, level = of_module.get("__package__") or "", self._level_of(instructions, instruction)
                    self._import(instruction.argval, package, level)
                    imported = instruction.argval
                elif instruction.opname == "IMPORT_FROM":  # from . import helper
                    self._import(f"{imported}.{instruction.argval}".lstrip("."), package, level)

    @staticmethod
    def _level_of(instructions, of):
        """Returns the level of a relative import in a function (the second constant before it); 0 for others."""
        at = instructions.index(of)
        constants = [i.argval for i in instructions[max(0, at - 3):at] if i.opname == "LOAD_CONST"]
        return constants[-2] if len(constants) > 1 and isinstance(constants[-2], int) else 0

    def _members(self, value, names, prefix, of):
        """Adds the values of a user's module that the code may name: mine.gain, mine.sub.gain."""
        if not isinstance(value, types.ModuleType) or not self._is_users_module(value):
            return
        for name in names:
            if name in vars(value) and not name.startswith("__"):
                member = vars(value)[name]
                if f"global {prefix}.{name} of {of}" not in self.parts:
                    self._variable(f"global {prefix}.{name}", of, member)
                    self._members(member, names, f"{prefix}.{name}", of)

    def _class(self, kind):
        def text(part):
            of = part.split(" ", 1)[1]
            lines = [self._value(base, f"base of {of}") for base in kind.__bases__]
            for name, member in sorted(vars(kind).items()):
                if name in _OF_EVERY_CLASS:
                    continue
                lines.append(f"{name}: {self._value(member, f'{name} of {of}')}")
            return "\n".join(lines)

        return self._part(kind, "class", kind.__qualname__, text)

    # ---- modules

    def _is_users_file(self, file):
        if file is None:
            return False
        path = pathlib.Path(file).resolve()
        return not ({"site-packages", "dist-packages"} & set(path.parts) or any(folder in path.parents for folder in self._installed))

    def _is_users_name(self, name):
        top = (name or "").split(".")[0]
        if top in ("sextant", "builtins", ""):
            return False
        if top == self._package or top == "__main__":
            return True
        module = sys.modules.get(top)
        if module is None:
            return False
        file = getattr(module, "__file__", None)
        if file is None:  # a namespace package, or built in
            folders = list(getattr(module, "__path__", []))
            return bool(folders) and all(self._is_users_file(folder) for folder in folders)
        return self._is_users_file(file)

    def _is_users(self, thing):
        """Returns true for a function or a class of the user."""
        name = thing.__module__
        if name in sys.modules and name != "builtins":
            return self._is_users_name(name)
        if isinstance(thing, types.FunctionType):  # of code that no module holds: exec(), a module that is not registered
            return thing.__code__.co_filename.startswith("<") or self._is_users_file(thing.__code__.co_filename)
        return bool(thing.__flags__ & _MADE_BY_A_CLASS_STATEMENT)

    def _is_users_module(self, module):
        if sys.modules.get(module.__name__) is not module:
            return self._is_users_file(getattr(module, "__file__", None))
        return self._is_users_name(module.__name__)

    def _module(self, module):
        name = module.__name__
        if not self._is_users_module(module):
            return f"module {name} {self._version(name)}"
        file = getattr(module, "__file__", None)
        if file is not None and name != "__main__":
            self._file(name, file)
        return f"module {name}"

    @staticmethod
    def _version(name):
        module = sys.modules.get(name.split(".")[0])
        version = getattr(module, "__version__", None)
        return version if isinstance(version, str) else f"of Python {sys.version_info[0]}.{sys.version_info[1]}"

    def _file(self, name, file):
        """Adds the source of a module, and the modules that it imports."""
        if name in self._files:
            return
        self._files.add(name)
        try:
            content = pathlib.Path(file).read_bytes()
        except OSError as error:
            self.not_seen.append(f"module {name}: {error.strerror}")
            return
        self.parts[f"file of module {name}"] = hashlib.sha256(content).hexdigest()
        if not str(file).endswith(".py"):
            return
        package = name if pathlib.Path(file).name == "__init__.py" else name.rpartition(".")[0]
        try:
            tree = ast.parse(content)
        except (SyntaxError, ValueError):
            return
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    self._import(alias.name, package, 0)
            elif isinstance(node, ast.ImportFrom):
                self._import(node.module or "", package, node.level)
                for alias in node.names:  # from . import helper
                    if alias.name != "*":
                        self._import(f"{node.module or ''}.{alias.name}".lstrip("."), package, node.level)

    def _import(self, name, package, level):
        if level > 0:
            above = package.split(".")
            name = ".".join(above[:len(above) - level + 1] + ([name] if name else []))
        if not name or name.split(".")[0] == "sextant":
            return
        pieces = name.split(".")
        for n in range(1, len(pieces) + 1):  # a package's own file runs too
            one = ".".join(pieces[:n])
            file = getattr(sys.modules.get(one), "__file__", None) or self._file_of(one)
            if file is not None and (self._is_users_file(file) or pieces[0] == self._package):
                self._file(one, file)

    @staticmethod
    def _file_of(name):
        """Returns the file of a module without importing it."""
        pieces, spec = name.split("."), None
        try:
            for n in range(1, len(pieces) + 1):
                path = None if n == 1 else spec.submodule_search_locations
                if n > 1 and path is None:
                    return None
                spec = importlib.machinery.PathFinder.find_spec(".".join(pieces[:n]), path)
                if spec is None:
                    return None
        except (ImportError, AttributeError, ValueError):
            return None
        return spec.origin if spec.has_location else None

    # ---- values

    def _value(self, value, where):
        """Returns a text that represents the value's content; parts are represented by their names."""
        if type(value) in _PLAIN:
            return f"{type(value).__name__} {value!r}"
        if isinstance(value, types.FunctionType):
            return self._function(value) if self._is_users(value) else self._foreign(value)
        if isinstance(value, type):
            return self._class(value) if self._is_users(value) else self._foreign(value)
        if isinstance(value, types.ModuleType):
            return self._module(value)
        if isinstance(value, _BUILTIN):
            owner = getattr(value, "__self__", None)
            if owner is None or isinstance(owner, (types.ModuleType, type)):
                return self._foreign(value)
            return f"method {value.__name__} of {self._value(owner, where)}"
        if isinstance(value, types.MethodType):
            return f"method {self._value(value.__func__, where)} of {self._value(value.__self__, where)}"
        if isinstance(value, (staticmethod, classmethod)):
            return f"{type(value).__name__} {self._value(value.__func__, where)}"
        if isinstance(value, property):
            return f"property {[self._value(one, where) for one in (value.fget, value.fset, value.fdel)]}"
        if isinstance(value, functools.partial):
            return f"partial {[self._value(one, where) for one in (value.func, value.args, value.keywords)]}"
        if isinstance(value, _CACHES):
            return f"cache of {self._value(value.__wrapped__, where)}"
        if isinstance(value, types.CodeType):
            return _code_text(value)
        if isinstance(value, numpy.generic):
            return f"{value.dtype.str} {value.tobytes().hex()}"
        if isinstance(value, numpy.dtype):
            return f"dtype {value.str} {value.descr!r}"
        if type(value) is tuple:
            return f"tuple {[self._value(one, where) for one in value]}"
        if id(value) in self._first:  # again, or inside itself
            return f"as {self._first[id(value)]}"
        self._first[id(value)] = where
        self._alive.append(value)
        return self._content(value, where)

    def _content(self, value, where):
        if isinstance(value, numpy.ndarray):
            return self._array(value, where)
        kind = self._value(type(value), where)
        if type(value) is list:
            return f"{kind} {[self._value(one, where) for one in value]}"
        if type(value) in (set, frozenset):
            return f"{kind} {sorted(self._value(one, where) for one in value)}"
        if type(value) is dict:
            return f"{kind} {sorted(f'{self._value(k, where)}: {self._value(v, where)}' for k, v in value.items())}"
        if type(value) in (bytearray, memoryview):
            return f"{kind} {bytes(value).hex()}"
        pandas = sys.modules.get("pandas")
        if pandas is not None and isinstance(value, (pandas.DataFrame, pandas.Series)):
            return f"{kind} {self._frame(value, pandas, where)}"
        if not self._is_users(type(value)) or isinstance(value, _CONTAINERS):
            return f"{kind} {self._state(value, where)}"
        attributes = self._attributes(value, where)
        if _compiled_base(type(value)) is object:
            return f"{kind} {attributes}"
        return f"{kind} {attributes} {self._state(value, where)}"

    def _array(self, value, where):
        if value.dtype.hasobject:
            content = str([self._value(one, where) for one in value.ravel().tolist()])
        else:
            content = hashlib.sha256(numpy.ascontiguousarray(value).tobytes()).hexdigest()
        if isinstance(value, numpy.ma.MaskedArray):
            content += self._array(numpy.ma.getmaskarray(value), where)
            content += f" {self._value(value.fill_value, where)} {value.hardmask}"
        kind = ""
        if type(value) is not numpy.ndarray:
            kind = self._value(type(value), where)
            content += f" {self._attributes(value, where, but=_OF_NUMPY)}"
        return f"array {kind} {value.dtype.str} {value.dtype.descr if value.dtype.names else ''} {value.shape} {content}"

    def _frame(self, value, pandas, where):
        """Returns the columns, index and names of a frame or series of pandas. What pickle would store changes without a change of
        content, since methods of a frame join its columns into one array."""
        columns = [value.iloc[:, k] for k in range(value.shape[1])] if value.ndim == 2 else [value]
        content = [*value.axes, getattr(value, "name", None), *(column.array for column in columns), value.attrs,
                   value.flags.allows_duplicate_labels]
        of_pandas = {*vars(pandas.DataFrame()), *vars(pandas.Series(dtype=float)), *getattr(value, "_accessors", ()), "_cacher"}
        return f"{self._value(content, where)} {self._attributes(value, where, but=of_pandas)}"

    def _foreign(self, value):
        module = getattr(value, "__module__", None) or getattr(getattr(value, "__objclass__", None), "__module__", "builtins")
        name = getattr(value, "__qualname__", getattr(value, "__name__", repr(type(value))))
        if module.split(".")[0] in ("sextant", "builtins"):
            return f"{module}.{name}"
        if self._is_users_name(module) and module in sys.modules:  # compiled
            return f"{name} of {self._module(sys.modules[module])}"
        return f"{module}.{name} {self._version(module)}"

    def _attributes(self, value, where, but=()):
        attributes = dict(getattr(value, "__dict__", None) or {})
        for kind in type(value).__mro__:
            slots = vars(kind).get("__slots__", ())
            for name in (slots,) if isinstance(slots, str) else slots:
                if name not in ("__dict__", "__weakref__") and hasattr(value, name):
                    attributes[name] = getattr(value, name)
        return str([f"{name}: {self._value(one, f'{where}, its {name}')}" for name, one in sorted(attributes.items())
                    if name not in but])

    def _state(self, value, where):
        """Returns the state of an object of a third-party class: what pickle would store. A tensor is compared by its numbers and
        attributes instead, because pickle stores addresses of tensors of torch."""
        if hasattr(type(value), "__dlpack__"):  # the array API: it holds nothing but numbers
            numbers = self._numbers(value, where)
            if numbers is not None:
                return f"{numbers} {self._attributes(value, where)}"
        try:
            reduced = value.__reduce_ex__(4)
        except Exception:  # pylint: disable=broad-except
            return self._unpickled(value, where)
        if isinstance(reduced, str):
            return reduced
        pieces = [list(piece) if index in (3, 4) and piece is not None else piece for index, piece in enumerate(reduced)]
        return str([self._value(piece, where) for piece in pieces[1:]])

    def _numbers(self, value, where):
        """Returns the numbers of an object that numpy can convert; None for others."""
        if not hasattr(type(value), "__array__"):
            return None
        try:
            return self._array(numpy.asarray(value), where)
        except Exception:  # pylint: disable=broad-except
            return None  # a third-party class may raise anything

    def _unpickled(self, value, where):
        """Returns the numbers and attributes of an object that pickle refuses. A compiled one may hold more, so it is listed in
        `not_seen`."""
        numbers, attributes = self._numbers(value, where), self._attributes(value, where)
        compared = [name for name, is_there in (("numbers", numbers is not None), ("attributes", attributes != "[]")) if is_there]
        if attributes == "[]" or _compiled_base(type(value)) is not object:
            kind = f"{type(value).__module__}.{type(value).__qualname__}"
            self.not_seen.append(f"{where}: {kind} cannot be pickled, so only its {' and '.join(compared)} are compared" if compared else
                                 f"{where}: {kind} has no content to compare")
        return f"{numbers or ''}{attributes}"


def fingerprint(function):
    """Returns {"parts": {name: SHA-256}, "not_seen": [text]} of an estimator."""
    called = function
    while isinstance(called, functools.partial):
        called = called.func
    module = getattr(called, "__module__", None) or type(called).__module__
    return _Finder(module.split(".")[0]).fingerprint(function)

