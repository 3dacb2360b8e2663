#!/usr/bin/env python3
"""Checks that includes follow the layers of docs/architecture.md.

usage: scripts/maintain/check_layers.py [--root DIR] [--self-test]

1. A file includes project headers as "sextant/<folder>/<file>.h", and the header exists.
2. A folder includes only the folders that LAYERS allows it.
3. Only TRUTH_READERS include sextant/truth/ directly.
4. No file of TRUTH_FREE reaches sextant/truth/, not even through other headers: an estimator that can see
   the ground truth cannot be evaluated with it.
5. Only the files in ENTRY_POINTS parse JSON (its limits are in base/json.h), run a program, or create files and folders.
6. A reader that a header of lib, datasets or eval declares (decode_*, parse_*, read_* of text, bytes or a path) is
   called in eval/fuzz/targets.cc, or by a reader that is: see READERS_WITHIN.
7. No two files have the same name, except for ONE_A_FOLDER: the name of a file must describe it.
8. String literals of reports (REPORTS) contain no name of a data set, estimator or measured system: these names come from
   zhang2020_data.json and the records. Reports read typed rows: no cell is compared with a text or found by its number.
9. A test uses no folder that others use and no clock: it works in a TempFolder of base/testing.h.
10. A module of which a source or a test starts threads declares THREADS in its CMakeLists.txt (preset tsan).
11. Comments and messages use the field's terms instead of the words in PRIVATE_WORDS.
12. A comment of a header begins with its subject, not with a word of NO_SUBJECT.
13. A document or a section of one that a comment or message names exists: docs/NAME.md, "SECTION".
14. docs/modules.svg shows the modules of LAYERS, those of TRUTH_FREE with a blue frame.
15. No line of C++ is longer than the ColumnLimit of .clang-format, not even a comment or a text.

Tests (*_test.cc, *testing.h) are exempt from 1 to 8.
Exit codes: 0 clean, 1 violations, 2 usage.
"""

import argparse
import fnmatch
import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]

# Folder -> the folders it may include, bottom to top. A folder may always include itself.
_MEASUREMENT = ["base", "geometry", "measurement"]
_ESTIMATOR = ["estimator/points", "estimator/solvers", "estimator/start", "estimator/flow_depth",
              "estimator/estimators", "estimator"]
_DATASETS = ["datasets/codec", "datasets/channels", "datasets/synthetic", "datasets"]
_PAPER = ["eval/report/figures", "eval/report/tables", "eval/report/paper", "eval/report/claims", "eval/report/html"]
LAYERS = {
    "base": [],
    "geometry": ["base"],
    "measurement": ["base", "geometry"],
    "truth": _MEASUREMENT,
    "noise": _MEASUREMENT,
    "estimator/points": _MEASUREMENT,
    "estimator/solvers": _MEASUREMENT,
    "estimator/start": _MEASUREMENT + ["estimator/solvers"],
    "estimator/flow_depth": _MEASUREMENT + ["estimator/solvers"],
    "estimator/estimators": _MEASUREMENT + ["estimator/solvers", "estimator/flow_depth"],
    "estimator/reference": _MEASUREMENT + ["estimator/solvers", "estimator/flow_depth", "estimator/estimators"],
    "estimator": _MEASUREMENT + ["estimator/points", "estimator/solvers", "estimator/start", "estimator/flow_depth",
                                 "estimator/estimators", "estimator/reference"],
    "metrics": _MEASUREMENT + ["truth"],
    "stats": ["base"],
    "datasets/codec": _MEASUREMENT,
    "datasets/channels": _MEASUREMENT + ["datasets/codec"],
    "datasets/synthetic": _MEASUREMENT + ["truth", "datasets/codec"],
    "datasets": _MEASUREMENT + ["truth", "datasets/codec", "datasets/channels", "datasets/synthetic"],
    "eval/records": ["base", "stats", "metrics"],
    "eval/diagnosis": ["base", "geometry", "stats"],
    "eval/check": _MEASUREMENT + _DATASETS + ["truth", "metrics", "stats", "eval/diagnosis", "eval/report"],
    "eval/experiment": _MEASUREMENT + _ESTIMATOR + _DATASETS + ["truth", "noise", "metrics", "eval/records", "eval/diagnosis"],
    "eval/profile": _MEASUREMENT + _DATASETS + ["truth", "noise", "estimator", "estimator/points", "estimator/start", "stats", "eval/records",
                                               "eval/report", "eval/report/figures"],
    "eval/pictures": _MEASUREMENT + _DATASETS + ["estimator", "eval/records", "eval/experiment"],
    "eval/report": ["base", "stats", "metrics", "eval/records"],
    "eval/report/figures": ["base", "stats", "eval/records", "eval/report"],
    "eval/report/html": ["base", "eval/records", "eval/report"],
    "eval/report/tables": ["base", "stats", "eval/records", "eval/report"],
    "eval/report/paper": ["base", "stats", "eval/records", "eval/report", "eval/report/html", "eval/report/tables"],
    "eval/report/claims": ["base", "stats", "eval/records", "eval/report", "eval/report/figures", "eval/report/tables"],
    "eval/benchmark": ["base", "stats", "metrics", "datasets", "noise", "estimator", "eval/records", "eval/experiment",
                       "eval/report", "eval/report/figures", "eval/report/html"],
    "eval/export": ["base", "metrics", "eval/records"],
    "eval/view": _MEASUREMENT + ["estimator", "datasets", "datasets/codec", "metrics", "stats", "eval/records", "eval/experiment",
                                 "eval/logs", "eval/pictures", "eval/report", "eval/report/figures", "eval/report/html"],
    "eval/gate": ["base", "stats", "metrics", "eval/records", "eval/report", "eval/report/html"],
    "eval/logs": _MEASUREMENT + _DATASETS + ["truth", "metrics", "eval/diagnosis"],
    "eval/evaluation": _MEASUREMENT + _DATASETS + ["truth", "metrics", "stats", "eval/records", "eval/diagnosis", "eval/logs",
                                               "eval/report", "eval/report/figures"],
    "eval/external": _MEASUREMENT + _ESTIMATOR + _DATASETS + ["truth", "noise", "eval/records", "eval/experiment",
                                                              "eval/diagnosis", "eval/logs"],
    "eval/reproduce": ["base", "datasets/codec", "eval/records", "eval/experiment", "eval/pictures", "eval/logs", "eval/evaluation",
                       "eval/report"] + _PAPER,
    "eval/workflow": ["base", "eval/records", "eval/experiment", "eval/external", "eval/view", "eval/evaluation",
                      "eval/report", "eval/report/paper", "eval/reproduce"] + _PAPER,
    "eval/cli": ["base", "geometry", "noise", "estimator", "datasets", "datasets/synthetic", "eval/records", "eval/check", "eval/benchmark",
                 "eval/experiment", "eval/profile", "eval/pictures", "eval/view", "eval/export", "eval/logs",
                 "eval/evaluation", "eval/external", "eval/gate", "eval/report", "eval/reproduce",
                 "eval/workflow"] + _PAPER,
    "eval/python": _MEASUREMENT + ["datasets/codec", "estimator/solvers", "estimator/estimators", "estimator", "noise",
                                   "metrics", "eval/logs", "eval/records", "eval/experiment", "eval/export", "eval/external", "eval/report",
                                   "eval/workflow"],
    "eval/fuzz": ["base", "noise", "estimator", "estimator/points", "datasets", "datasets/codec", "datasets/channels",
                  "eval/records", "eval/benchmark", "eval/experiment", "eval/logs", "eval/evaluation", "eval/external", "eval/gate",
                  "eval/report"],
}

# Patterns over "<folder>/<file>" with lib/ dropped; "*" also crosses "/".
TRUTH_READERS = ["truth/*", "metrics/*", "datasets/*", "eval/check/*", "eval/experiment/*", "eval/logs/*",
                 "eval/evaluation/*", "eval/external/*"]
TRUTH_READERS_EXCEPT = ["datasets/codec/*", "datasets/channels/*"]
TRUTH_FREE = ["base/*", "geometry/*", "measurement/*", "estimator/*", "noise/*", "datasets/codec/*",
              "datasets/channels/*"]

# Names that stand in several folders.
ONE_A_FOLDER = ["registry.h", "registry.cc", "main.cc"]

# Action -> (pattern, files that may do it).
ENTRY_POINTS = {
    "parses JSON: use base/json.h": (re.compile(r"\b(?:Json|json)::(?:parse|sax_parse|accept|from_\w+)\s*\("),
                                     ["base/json.cc"]),
    "runs a program": (re.compile(r"(?:\b(?:popen|posix_spawnp?|exec[lv]p?e?)|::(?:system|fork))\s*\("),
                       ["eval/cli/help_command.cc", "eval/report/figure.cc", "eval/external/process.cc", "eval/external/supervisor.cc"]),
    "makes a folder for temporary files: use base/new_file.h": (
        re.compile(r"\b(?:temp_directory_path|mkdtemp|mkstemp|tmpfile|tmpnam)\b"),
        ["base/new_file.h", "datasets/layout.cc", "eval/external/external_case.cc", "eval/experiment/pack.cc"]),
    "creates a file: use base/new_file.h or write_file()": (
        re.compile(r"\bO_CREAT\b|\bstd::ofstream\b|\bfopen(?:64)?\("),
        ["base/new_file.cc", "base/files.cc", "base/file_lock.cc", "eval/records/journal.cc", "eval/report/figure.cc",
         "eval/external/process.cc", "eval/fuzz/input.cc"]),
    "makes folders, through links too: use base/new_file.h or base/file_lock.h": (
        re.compile(r"\bcreate_directories\("),
        ["base/new_file.cc", "datasets/layout.cc", "datasets/vdo_folder.cc", "datasets/vkitti_layout.cc", "datasets/kitti_layout.cc", "eval/external/external_case.cc", "eval/records/output.cc", "eval/fuzz/input.cc"]),
}

# Files that make tables, figures, claims and pages from typed rows.
REPORTS = ["eval/report/*", "eval/gate/*"]
NOT_IN_REPORTS = {
    "compares a cell with a text: decide by the row": re.compile(r"[=!]=\s*Cell\(|\bCell\([^()]*\)\s*[=!]="),
    "finds a cell by its number: read the row's member, or Table::place()":
        re.compile(r"\b(?:\w*row|\w*rows|cells|fields|columns)(?:\[\d+\]|\.at\(\d+\))"),
}
# Lists of the names that a report must not contain -> pattern of an entry.
NAME_LISTS = {
    "datasets/registry.cc": re.compile(r'\{"([\w-]+)",'),
    "lib/estimator/registry.cc": re.compile(r'entry<\w+, \w+>\(\s*"(\w+)"'),
    "results/systems/systems.json": re.compile(r'"estimator":\s*"(\w+)'),
}

# Patterns that no test contains: it would depend on other tests, on the user or on the speed of the machine.
NOT_IN_TESTS = {
    "is a folder that others use: TempFolder (base/testing.h) is the test's own":
        re.compile(r"\btemp_directory_path\b|\bTempDir\(\)|\bmkdtemp\b|\"/(?:tmp|var/tmp|home|root)\b"),
    "depends on the speed of the machine": re.compile(r"\b(?:steady|system|high_resolution)_clock\b"),
}

STARTS_THREADS = re.compile(r"^ +parallel_for\(|\bstd::(?:jthread|thread|async)\b[ (]", re.MULTILINE)

# Readers that need no call of their own in TARGETS -> what leads to them, or why they are none.
TARGETS = "eval/fuzz/targets.cc"
READERS_WITHIN = {
    "read_file": "bytes, whatever they are", "read_json": "parse_json", "read_records": "parse_records",
    "read_plan_file": "merge_sweeps",
    "read_bag": "trajectory format bag", "read_mcap": "trajectory format mcap",
    "read_rosbag2": "trajectory format rosbag2",
    "read_vdo_frontend_xml": "trajectory format vdo_xml", "read_trajectory": "decode_trajectory",
    "parse_body_from_camera": "decode_body_from_camera", "read_kitti_truth": "adapter kitti",
    "read_vkitti1_truth": "adapter vkitti1", "read_vkitti2_truth": "adapter vkitti2",
    "read_image": "adapters vkitti1 and vkitti2", "parse_field": "every trajectory format of numbers",
}

# Formatting breaks neither comments nor texts.
COLUMN_LIMIT = int(re.search(r"ColumnLimit: (\d+)", (ROOT / ".clang-format").read_text())[1])

# Words of 10 -> the terms of the field. The words part, subject and limit are left out: a pattern cannot distinguish their
# private meanings from the ordinary ones.
PRIVATE_WORDS = {
    r"rooms?|houses?": "module", r"doors?": "entry point", r"strangers?": "untrusted input, third-party file",
    r"halves of (?:a|the) bod\w+": "split-half consistency", r"limit of (?:the )?accuracy": "Cramer-Rao lower bound",
    r"what holds them": "prior that regularises weakly observable directions", r"packs?": "correspondence cache",
    r"tells?|told": "report, print; determine", r"said": "given, requested", r"anew": "again; resampled",
}
NO_SUBJECT = re.compile(r"(?:that|those|what|whether|the same|of)\b", re.IGNORECASE)
# Words that stay: the houses of synthetic streets, the content of a file that marks a folder, the command `data pack` and the
# key `packs` of run.json.
ORDINARY_WORDS = {"datasets/synthetic/*": r"houses?", "eval/experiment/pack.cc": r"packs?",
                  "eval/cli/*": r"packs?", "eval/fuzz/fault_test.py": r"packs?", "eval/gate/side.cc": r"packs?"}
_WORDS = re.compile("|".join(rf"(?<![\w./-])(?:{word})(?![\w-])" for word in PRIVATE_WORDS), re.IGNORECASE)
_COMMENT_OR_STRING = re.compile(r'(?P<comment>//[^\n]*)|"(?P<string>(?:\\.|[^"\\\n])*)"')
_PYTHON_TEXT = re.compile(r'"""(?P<string>.*?)"""|(?P<comment>#[^\n]*)|"(?:\\.|[^"\\\n])*"', re.DOTALL)

_READER = re.compile(r"\b((?:decode|parse|read)_\w+)\(\s*(?:std::string_view|(?:const )?std::string|ByteSource"
                     r"|(?:const )?(?:std::filesystem|fs)::path|(?:const )?std::vector<(?:std::filesystem|fs)::path)\b")
_INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def listed_names(root):
    """Returns the names of data sets, estimators and measured systems in the files of NAME_LISTS."""
    return {name for path, pattern in NAME_LISTS.items() if (root / path).exists()
            for name in pattern.findall((root / path).read_text(encoding="utf-8"))}


def report_problems(text, names):
    """Returns [(line, problem)] of a source that makes reports."""
    code = re.sub(r"//[^\n]*", "", text)
    found = [(m.start(), what) for what, pattern in NOT_IN_REPORTS.items() for m in pattern.finditer(code)]
    for literal in re.finditer(r'"(?:[^"\\\n]|\\.)*"', code):
        if code.rfind("\n", 0, literal.start()) < code.rfind("#include", 0, literal.start()):
            continue
        for word in re.findall(r"[\w-]+", literal[0]):
            if word in names:
                found.append((literal.start(), f"names '{word}' in a text: take it from the records or from paper()"))
    return [(code.count("\n", 0, at) + 1, what) for at, what in found]


def matches(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def folder_of(name):
    return name.rpartition("/")[0]


def read_tree(root):
    """{"geometry/se3.h": (path, [(line, include text), ...], [(line, problem), ...])}, tests left out."""
    targets = root / TARGETS
    targets = targets.read_text(encoding="utf-8") if targets.exists() else ""
    names = listed_names(root)
    files = {}
    for top in ("lib", "datasets", "eval"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix not in (".h", ".cc") or path.name.endswith(("_test.cc", "testing.h")):
                continue
            name = path.relative_to(root).as_posix().removeprefix("lib/")
            if "/example" in name:  # a project of its own, for users to copy
                continue
            text = path.read_text(encoding="utf-8")
            includes = [(text.count("\n", 0, m.start(1)) + 1, m.group(1)) for m in _INCLUDE.finditer(text)]
            uses = [(text.count("\n", 0, m.start()) + 1, what) for what, (pattern, users) in ENTRY_POINTS.items()
                     if name not in users for m in pattern.finditer(text)]
            if matches(name, REPORTS):
                uses += report_problems(text, names)
            if path.suffix == ".h":
                uses += [(text.count("\n", 0, m.start()) + 1,
                           f"{m.group(1)}() reads untrusted files and has no target in {TARGETS}")
                          for m in _READER.finditer(text)
                          if m.group(1) not in READERS_WITHIN and not re.search(rf"\b{m.group(1)}\b", targets)]
            files[name] = (path.relative_to(root).as_posix(), includes, uses)
    return files


def test_problems(root):
    for top in ("lib", "datasets", "eval"):
        for path in sorted([*(root / top).rglob("*_test.cc"), *(root / top).rglob("*testing.h")]):
            text = path.read_text(encoding="utf-8")
            for what, pattern in NOT_IN_TESTS.items():
                for match in pattern.finditer(text):
                    yield f"{path.relative_to(root)}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]} {what}"


def thread_problems(root):
    for listing in sorted(path for top in ("lib", "datasets", "eval") for path in (root / top).rglob("CMakeLists.txt")):
        module = re.search(r"sextant_module\(\w+(?! THREADS)[\s)]", listing.read_text(encoding="utf-8"))
        if module and any(STARTS_THREADS.search(source.read_text(encoding="utf-8")) for source in listing.parent.glob("*.cc")):
            yield f"{listing.relative_to(root)}: a source starts threads: expected 'sextant_module(NAME THREADS ...'"


def texts(path, text):
    """(line, text) of the comments and messages of a file; strings without a blank are names, keys or formats. Of a
    document: its lines without code."""
    if path.suffix == ".md":
        text = re.sub(r"^```.*?^```|`[^`\n]*`", lambda match: "\n" * match[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
        yield from enumerate(text.splitlines(), 1)
        return
    for match in (_PYTHON_TEXT if path.suffix == ".py" else _COMMENT_OR_STRING).finditer(text):
        found = match["comment"] or match["string"] or ""
        if match["comment"] or " " in found:
            yield text.count("\n", 0, match.start()) + 1, found


def comments_without_subject(text):
    """(line, text) of the comments that begin with a word of NO_SUBJECT; a comment continues over lines of one kind."""
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r"(\s*///?(?!<)|.*///<)\s*(?:----\s*)?(.*)", line)
        kind = match[1] if match else ""
        if match and kind != before and NO_SUBJECT.match(match[2]):
            yield number, match[2]
        before = "" if "///<" in kind or (match and not match[2]) else kind


def language_problems(root):
    for top in ("lib", "datasets", "eval", "docs"):
        for path in sorted((root / top).rglob("*")):
            name = path.relative_to(root).as_posix()
            if path.suffix not in (".h", ".cc", ".py", ".md") or "/example" in name:
                continue
            text = path.read_text(encoding="utf-8")
            ordinary = [word for pattern, word in ORDINARY_WORDS.items() if fnmatch.fnmatchcase(name, pattern)]
            for line, words in texts(path, text):
                for match in _WORDS.finditer(words):
                    if not any(re.fullmatch(word, match[0], re.IGNORECASE) for word in ordinary):
                        term = next(t for w, t in PRIVATE_WORDS.items() if re.fullmatch(w, match[0], re.IGNORECASE))
                        yield f"{name}:{line}: '{match[0]}' is a private word: write {term}"
            if path.suffix == ".h":
                for line, comment in comments_without_subject(text):
                    yield f"{name}:{line}: a comment begins with its subject, got '{comment[:40]}'"


def citation_problems(root):
    """Citations of documents, docs/NAME.md or docs/NAME.md, "SECTION", that lead nowhere. A section may be named by its beginning."""
    for top in ("lib", "datasets", "eval"):
        for path in sorted([*(root / top).rglob("*.h"), *(root / top).rglob("*.cc")]):
            text = re.sub(r"\s*\n\s*//+\s*", " ", path.read_text(encoding="utf-8"))
            for name, section in re.findall(r'docs/([a-z-]+\.md)(?:, "([^"\\]+)")?', text):
                document = root / "docs" / name
                if not document.exists():
                    yield f"{path.relative_to(root)}: docs/{name} does not exist"
                elif section and f"# {section}" not in document.read_text(encoding="utf-8"):
                    yield f"{path.relative_to(root)}: docs/{name} has no section '{section}'"


def picture_problems(root):
    picture = root / "docs" / "modules.svg"
    if not picture.exists():
        return
    shown = {name: frame for frame, name in re.findall(
        r'stroke="([^"]+)"[^>]*/><text [^>]*text-anchor="middle">([^<]+)</text>', picture.read_text(encoding="utf-8"))}
    for module in sorted(LAYERS.keys() ^ shown.keys()):
        yield "docs/modules.svg: " + (f"{module} is missing" if module in LAYERS else f"there is no module {module}")
    for module in sorted(LAYERS.keys() & shown.keys()):
        if (shown[module] == "#0072b2") != matches(module + "/x", TRUTH_FREE):
            yield f"docs/modules.svg: {module}: a blue frame means that it cannot see the truth"


def length_problems(root):
    for top in ("lib", "datasets", "eval", "bench"):
        for path in sorted([*(root / top).rglob("*.h"), *(root / top).rglob("*.cc")]):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if len(line) > COLUMN_LIMIT:
                    yield f"{path.relative_to(root)}:{number}: {len(line)} characters, expected at most {COLUMN_LIMIT}"


def path_to_truth(files, start):
    """Returns the chain of headers from `start` to the first header of truth/, or None."""
    seen = {start}
    queue = [[start]]
    while queue:
        chain = queue.pop(0)
        for _, include in files[chain[-1]][1]:
            header = include.removeprefix("sextant/")
            if header.startswith("truth/"):
                return chain + [header]
            if header in files and header not in seen:
                seen.add(header)
                queue.append(chain + [header])
    return None


def check(root):
    files = read_tree(root)
    problems = [*test_problems(root), *thread_problems(root), *language_problems(root), *citation_problems(root),
                *picture_problems(root), *length_problems(root)]
    first = {}
    for name, (path, includes, uses) in files.items():
        file = name.rpartition("/")[2]
        if first.setdefault(file, path) != path and file not in ONE_A_FOLDER:
            problems.append(f"{path}: there is {first[file]} too: give one a name that says what it is")
        problems += [f"{path}:{line}: {what}" for line, what in uses]
        folder = folder_of(name)
        if folder not in LAYERS:
            problems.append(f"{path}: folder '{folder}' has no place in LAYERS of scripts/maintain/check_layers.py")
            continue
        for line, include in includes:
            where = f"{path}:{line}"
            header = include.removeprefix("sextant/")
            if header == include:
                problems.append(f'{where}: "{include}": write project includes as "sextant/<folder>/<file>.h"')
                continue
            if header not in files:
                problems.append(f'{where}: "{include}": there is no such header')
                continue
            target = folder_of(header)
            if target != folder and target not in LAYERS[folder]:
                allowed = ", ".join(LAYERS[folder]) or "nothing"
                problems.append(f"{where}: {folder} may not include {target} (it may include {allowed})")
            if target == "truth" and (
                not matches(name, TRUTH_READERS) or matches(name, TRUTH_READERS_EXCEPT)
            ):
                problems.append(f"{where}: {folder} may not see the ground truth")
        if matches(name, TRUTH_FREE):
            chain = path_to_truth(files, name)
            if chain:
                problems.append(f"{path}: reaches the ground truth: {' -> '.join(chain)}")
    return problems, len(files)


def self_test():
    """Plants one violation of each kind in a small tree and checks that it is found."""
    clean = {
        "lib/base/error.h": "",
        "lib/geometry/se3.h": '#include "sextant/base/error.h"\n',
        "lib/truth/truth.h": '#include "sextant/geometry/se3.h"\n',
        "lib/estimator/solvers/estimator.h": '#include "sextant/geometry/se3.h"\n',
        "lib/estimator/estimator_test.cc": '#include "sextant/truth/truth.h"\n',
        "lib/noise/depth.h": "#include <vector>\n",
        "lib/noise/CMakeLists.txt": "sextant_module(noise DEPENDS Sextant::measurement)",
        "lib/metrics/errors.h": '#include "sextant/truth/truth.h"\n',
        "datasets/dataset.h": '#include "sextant/truth/truth.h"\n',
        "eval/report/table.h": '#include "sextant/base/error.h"\n',
        "eval/gate/policy.h": "int read_policy(const std::string& file);\n",
        "eval/fuzz/targets.cc": "void policy() { read_policy(file); }\n",
        "datasets/registry.cc": 'Adapter{"sea-floor", "what is below"};\nstd::vector table = {{"sea-floor", "below"}};\n',
        "eval/report/tables/depth_table.cc": '// As "sea-floor" has it.\nconst char* title = "all of the sea";\n',
    }
    planted = [
        ("upward include", "lib/base/error.h", "sextant/geometry/se3.h", "base may not include geometry"),
        ("truth in the estimator", "lib/estimator/solvers/estimator.h", "sextant/truth/truth.h", "may not see"),
        ("truth in the report", "eval/report/table.h", "sextant/truth/truth.h", "may not see"),
        ("truth through a header", "lib/noise/depth.h", "sextant/metrics/errors.h", "reaches the ground"),
        ("truth in the estimator through a data set", "lib/estimator/solvers/estimator.h", "sextant/datasets/dataset.h",
         "estimator/solvers/estimator.h -> datasets/dataset.h -> truth/truth.h"),
        ("relative include", "lib/geometry/se3.h", "../base/error.h", "write project includes"),
        ("missing header", "lib/geometry/se3.h", "sextant/base/no.h", "no such header"),
        ("unknown folder", "lib/extra/extra.h", "sextant/base/error.h", "has no place"),
        ("another entry point for JSON", "eval/report/table.h", 'base/x"\nauto j = Json::parse(text);//', "parses JSON"),
        ("a reader that nothing fuzzes", "lib/geometry/se3.h", 'base/x"\nint decode_x(std::string_view bytes);//',
         "decode_x() reads untrusted files and has no target"),
        ("a name twice", "eval/gate/table.h", "sextant/base/error.h", "there is eval/gate/table.h too"),
        ("a test in a folder of others", "lib/noise/depth_test.cc", 'base/x"\nauto folder = testing::TempDir();//',
         "TempFolder (base/testing.h) is the test's own"),
        ("a test with a clock", "lib/noise/depth_test.cc", 'base/x"\nauto now = std::chrono::steady_clock::now();//',
         "depends on the speed"),
        ("threads that are not declared", "lib/noise/draw.cc", 'base/x"\n  parallel_for(n, jobs, draw);//', "starts threads"),
        ("a file made in place", "eval/report/table.h", 'base/x"\nauto file = std::ofstream(name);//', "creates a file"),
        ("a data set in a report", "eval/report/tables/depth_table.cc", 'base/error.h"\nauto s = "depth of sea-floor";//',
         "names 'sea-floor' in a text"),
        ("a cell compared with a text", "eval/report/table.h", 'base/error.h"\nbool b = row == Cell("no");//',
         "compares a cell"),
        ("a cell by its number", "eval/report/table.h", 'base/error.h"\nauto cell = row[5];//', "by its number"),
        ("a private word", "lib/base/error.h", 'base/x"\n// Files of strangers.//', "'strangers' is a private word"),
        ("a private word in a message", "lib/base/error.h", 'base/x"\nauto a = "as the file said";//', "'said' is a private"),
        ("a private word in a document", "docs/a.md", "a room of its own", "'room' is a private word"),
        ("a comment without a subject", "lib/base/error.h", 'base/x"\n/// Whether it is one.//', "begins with its subject"),
        ("a member without a subject", "lib/base/error.h", 'base/x"\nint a = 0;  ///< of the image//', "begins with its subject"),
        ("a lost document", "lib/base/error.h", 'base/x"\n// See docs/lost.md.//', "docs/lost.md does not exist"),
        ("a long line", "lib/base/error.h", 'base/x"\n// ' + "a " * 60 + "//", "126 characters, expected at most 110"),
        ("a shell", "lib/base/error.h", 'base/x"\nint s = std::system(text);//', "runs a program"),
    ]
    failures = 0
    for what, file, include, expected in [("clean tree", None, None, None)] + planted:
        with tempfile.TemporaryDirectory() as folder:
            tree = dict(clean)
            if file:
                tree[file] = tree.get(file, "") + f'#include "{include}"\n'
            for name, text in tree.items():
                path = pathlib.Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            problems, _ = check(pathlib.Path(folder))
        good = any(expected in problem for problem in problems) if expected else not problems
        print(f"{'ok  ' if good else 'FAIL'} {what}" + ("" if good else f": got {problems}"))
        failures += not good
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=ROOT)
    parser.add_argument("--self-test", action="store_true", help="plant violations and see them caught")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    problems, count = check(arguments.root)
    for problem in problems:
        print(problem)
    if count == 0:
        print(f"{arguments.root}: no sources found", file=sys.stderr)
        return 2
    print(f"{count} files, {len(problems)} violations")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
