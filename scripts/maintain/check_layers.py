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
import typing

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOPS = ("lib", "datasets", "eval")

# Groups of folders, for the table below.
_GROUPS = {
    "MEASUREMENT": "base geometry measurement",
    "ESTIMATOR": "estimator/points estimator/solvers estimator/start estimator/flow_depth estimator/estimators estimator",
    "DATASETS": "datasets/codec datasets/channels datasets/synthetic datasets",
    "PAPER": "eval/report/figures eval/report/tables eval/report/paper eval/report/claims eval/report/html",
}
# Folder -> the folders it may include, bottom to top. A folder may always include itself.
LAYERS = {
    "base": "",
    "geometry": "base",
    "measurement": "base geometry",
    "truth": "MEASUREMENT",
    "noise": "MEASUREMENT",
    "estimator/points": "MEASUREMENT",
    "estimator/solvers": "MEASUREMENT",
    "estimator/start": "MEASUREMENT estimator/solvers",
    "estimator/flow_depth": "MEASUREMENT estimator/solvers",
    "estimator/estimators": "MEASUREMENT estimator/solvers estimator/flow_depth",
    "estimator/reference": "MEASUREMENT estimator/solvers estimator/flow_depth estimator/estimators",
    "estimator": "MEASUREMENT estimator/points estimator/solvers estimator/start estimator/flow_depth estimator/estimators "
                 "estimator/reference",
    "metrics": "MEASUREMENT truth",
    "stats": "base",
    "datasets/codec": "MEASUREMENT",
    "datasets/channels": "MEASUREMENT datasets/codec",
    "datasets/synthetic": "MEASUREMENT truth datasets/codec",
    "datasets": "MEASUREMENT truth datasets/codec datasets/channels datasets/synthetic",
    "eval/records": "base stats metrics",
    "eval/diagnosis": "base geometry stats",
    "eval/check": "MEASUREMENT DATASETS truth metrics stats eval/diagnosis eval/report",
    "eval/experiment": "MEASUREMENT ESTIMATOR DATASETS truth noise metrics eval/records eval/diagnosis",
    "eval/profile": "MEASUREMENT DATASETS truth noise estimator estimator/points estimator/start stats eval/records eval/report "
                    "eval/report/figures",
    "eval/pictures": "MEASUREMENT DATASETS estimator eval/records eval/experiment",
    "eval/report": "base stats metrics noise eval/records",
    "eval/report/figures": "base stats eval/records eval/report",
    "eval/report/html": "base eval/records eval/report",
    "eval/report/tables": "base stats eval/records eval/report",
    "eval/report/paper": "base stats eval/records eval/report eval/report/html eval/report/tables",
    "eval/report/claims": "base stats eval/records eval/report eval/report/figures eval/report/tables",
    "eval/benchmark": "base stats metrics datasets noise estimator eval/records eval/experiment eval/report eval/report/figures "
                      "eval/report/html",
    "eval/export": "base metrics eval/records",
    "eval/view": "MEASUREMENT estimator datasets datasets/codec metrics stats eval/records eval/experiment eval/logs "
                 "eval/pictures eval/report eval/report/figures eval/report/html",
    "eval/gate": "base stats metrics eval/records eval/report eval/report/html",
    "eval/logs": "MEASUREMENT DATASETS truth metrics eval/diagnosis",
    "eval/evaluation": "MEASUREMENT DATASETS truth metrics stats eval/records eval/diagnosis eval/logs eval/report "
                       "eval/report/figures",
    "eval/external": "MEASUREMENT ESTIMATOR DATASETS truth noise eval/records eval/experiment eval/diagnosis eval/logs",
    "eval/reproduce": "base datasets/codec eval/records eval/experiment eval/pictures eval/logs eval/evaluation eval/report "
                      "PAPER",
    "eval/workflow": "base geometry eval/records eval/diagnosis eval/check eval/experiment eval/external eval/view "
                     "eval/evaluation eval/report eval/report/paper eval/reproduce PAPER",
    "eval/cli": "base geometry noise estimator datasets datasets/synthetic eval/records eval/check eval/benchmark "
                "eval/experiment eval/profile eval/pictures eval/view eval/export eval/logs eval/evaluation eval/external "
                "eval/gate eval/report eval/reproduce eval/workflow PAPER",
    "eval/python": "MEASUREMENT datasets/codec estimator/solvers estimator/estimators estimator noise metrics eval/logs "
                   "eval/records eval/experiment eval/export eval/evaluation eval/external eval/report eval/workflow",
    "eval/fuzz": "base noise estimator estimator/points datasets datasets/codec datasets/channels eval/records eval/benchmark "
                 "eval/experiment eval/logs eval/evaluation eval/external eval/gate eval/report",
}
LAYERS = {folder: [name for word in allowed.split() for name in _GROUPS.get(word, word).split()]
          for folder, allowed in LAYERS.items()}

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
        ["base/new_file.cc", "datasets/layout.cc", "datasets/vdo_folder.cc", "datasets/vkitti_layout.cc", "datasets/kitti_tracking.cc", "eval/external/external_case.cc", "eval/records/output.cc", "eval/fuzz/input.cc"]),
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
    "MATCH is a folder that others use: TempFolder (base/testing.h) is the test's own":
        re.compile(r"\btemp_directory_path\b|\bTempDir\(\)|\bmkdtemp\b|\"/(?:tmp|var/tmp|home|root)\b"),
    "MATCH depends on the speed of the machine": re.compile(r"\b(?:steady|system|high_resolution)_clock\b"),
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


class Source(typing.NamedTuple):
    path: str  # from the root
    text: str

    def at(self, position):
        return f"{self.path}:{self.text.count(chr(10), 0, position) + 1}"

    @property
    def name(self):
        return self.path.removeprefix("lib/")

    @property
    def is_test(self):
        return self.path.endswith(("_test.cc", "testing.h"))

    @property
    def includes(self):  # [(position, header without sextant/, include text), ...]
        return [(m.start(1), m[1].removeprefix("sextant/"), m[1]) for m in _INCLUDE.finditer(self.text)]


def matches(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def folder_of(name):
    return name.rpartition("/")[0]


def read_tree(root, tops, suffixes=(".h", ".cc")):
    return [Source(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))
            for top in tops for path in sorted((root / top).rglob("*")) if path.suffix in suffixes]


def pattern_problems(sources, rules):
    """Yields a problem for each match of {problem: pattern}; MATCH in a problem stands for what was found."""
    for source in sources:
        for problem, pattern in rules.items():
            yield from (f"{source.at(m.start())}: {problem.replace('MATCH', m[0])}" for m in pattern.finditer(source.text))


def name_in_report_problems(reports, root):
    listed = ((root / path, pattern) for path, pattern in NAME_LISTS.items() if (root / path).exists())
    names = {name for path, pattern in listed for name in pattern.findall(path.read_text(encoding="utf-8"))}
    for source in reports:
        for literal in re.finditer(r'^\s*#include[^\n]*|"(?:[^"\\\n]|\\.)*"', source.text, re.MULTILINE):
            if literal[0].startswith('"'):
                yield from (f"{source.at(literal.start())}: names '{word}' in a text: take it from the records or from paper()"
                            for word in re.findall(r"[\w-]+", literal[0]) if word in names)


def reader_problems(files):
    targets = files[TARGETS].text if TARGETS in files else ""
    for source in files.values():
        for match in _READER.finditer(source.text) if source.path.endswith(".h") else ():
            if match[1] not in READERS_WITHIN and not re.search(rf"\b{match[1]}\b", targets):
                yield f"{source.at(match.start())}: {match[1]}() reads untrusted files and has no target in {TARGETS}"


def thread_problems(sources, root):
    for folder in sorted({folder_of(s.path) for s in sources if s.path.endswith(".cc") and STARTS_THREADS.search(s.text)}):
        listing = root / folder / "CMakeLists.txt"
        if listing.exists() and re.search(r"sextant_module\(\w+(?! THREADS)[\s)]", listing.read_text(encoding="utf-8")):
            yield f"{folder}/CMakeLists.txt: a source starts threads: expected 'sextant_module(NAME THREADS ...'"


def texts(source):
    """(line, text) of the comments and messages of a file; strings without a blank are names, keys or formats. Of a
    document: its lines without code."""
    if source.path.endswith(".md"):
        text = re.sub(r"^```.*?^```|`[^`\n]*`", lambda m: "\n" * m[0].count("\n"), source.text, flags=re.DOTALL | re.MULTILINE)
        yield from ((f"{source.path}:{number}", line) for number, line in enumerate(text.splitlines(), 1))
        return
    for match in (_PYTHON_TEXT if source.path.endswith(".py") else _COMMENT_OR_STRING).finditer(source.text):
        found = match["comment"] or match["string"] or ""
        if match["comment"] or " " in found:
            yield source.at(match.start()), found


def word_problems(texts_of_tree):
    for source in texts_of_tree:
        ordinary = [word for pattern, word in ORDINARY_WORDS.items() if fnmatch.fnmatchcase(source.path, pattern)]
        for place, text in texts(source):
            for match in _WORDS.finditer(text):
                if not any(re.fullmatch(word, match[0], re.IGNORECASE) for word in ordinary):
                    term = next(t for w, t in PRIVATE_WORDS.items() if re.fullmatch(w, match[0], re.IGNORECASE))
                    yield f"{place}: '{match[0]}' is a private word: write {term}"


def subject_problems(sources):
    """Comments of headers that begin with a word of NO_SUBJECT; a comment continues over lines of one kind."""
    for source in (s for s in sources if s.path.endswith(".h")):
        before = ""
        for number, line in enumerate(source.text.splitlines(), 1):
            match = re.match(r"(\s*///?(?!<)|.*///<)\s*(?:----\s*)?(.*)", line)
            kind = match[1] if match else ""
            if match and kind != before and NO_SUBJECT.match(match[2]):
                yield f"{source.path}:{number}: a comment begins with its subject, got '{match[2][:40]}'"
            before = "" if "///<" in kind or (match and not match[2]) else kind


def citation_problems(sources, root):
    """Citations of documents, docs/NAME.md or docs/NAME.md, "SECTION", that lead nowhere. A section may be named by its beginning."""
    for source in sources:
        text = re.sub(r"\s*\n\s*//+\s*", " ", source.text)
        for name, section in re.findall(r'docs/([a-z-]+\.md)(?:, "([^"\\]+)")?', text):
            document = root / "docs" / name
            if not document.exists():
                yield f"{source.path}: docs/{name} does not exist"
            elif section and f"# {section}" not in document.read_text(encoding="utf-8"):
                yield f"{source.path}: docs/{name} has no section '{section}'"


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


def length_problems(sources):
    for source in sources:
        for number, line in enumerate(source.text.splitlines(), 1):
            if len(line) > COLUMN_LIMIT:
                yield f"{source.path}:{number}: {len(line)} characters, expected at most {COLUMN_LIMIT}"


def name_problems(files):
    first = {}
    for name, source in files.items():
        file = name.rpartition("/")[2]
        if first.setdefault(file, source.path) != source.path and file not in ONE_A_FOLDER:
            yield f"{source.path}: there is {first[file]} too: give one a name that says what it is"


def include_problems(files, name, header, include):
    """Yields what is wrong with one include of the file `name`."""
    folder, target = folder_of(name), folder_of(header)
    if header == include:
        yield f'"{include}": write project includes as "sextant/<folder>/<file>.h"'
    elif header not in files:
        yield f'"{include}": there is no such header'
    elif target not in (folder, *LAYERS[folder]):
        yield f"{folder} may not include {target} (it may include {', '.join(LAYERS[folder]) or 'nothing'})"
    if header in files and target == "truth" and (not matches(name, TRUTH_READERS) or matches(name, TRUTH_READERS_EXCEPT)):
        yield f"{folder} may not see the ground truth"


def path_to_truth(files, start):
    """Returns the chain of headers from `start` to the first header of truth/, or None."""
    seen, queue = {start}, [[start]]
    while queue:
        chain = queue.pop(0)
        for _, header, _ in files[chain[-1]].includes:
            if header.startswith("truth/"):
                return chain + [header]
            if header in files and header not in seen:
                seen.add(header)
                queue.append(chain + [header])
    return None


def layer_problems(files):
    for name, source in files.items():
        if folder_of(name) not in LAYERS:
            yield f"{source.path}: folder '{folder_of(name)}' has no place in LAYERS of scripts/maintain/check_layers.py"
            continue
        for position, header, include in source.includes:
            yield from (f"{source.at(position)}: {problem}" for problem in include_problems(files, name, header, include))
        if matches(name, TRUTH_FREE) and (chain := path_to_truth(files, name)):
            yield f"{source.path}: reaches the ground truth: {' -> '.join(chain)}"


def check(root):
    sources = read_tree(root, TOPS)
    texts_of_all = [s for s in sources + read_tree(root, (*TOPS, "docs"), (".py", ".md")) if "/example" not in s.path]
    files = {s.name: s for s in sources if not s.is_test and "/example" not in s.path}  # an example is a project for users to copy
    reports = [Source(s.path, re.sub(r"//[^\n]*", "", s.text)) for s in files.values() if matches(s.name, REPORTS)]
    problems = [
        *pattern_problems((s for s in sources if s.is_test), NOT_IN_TESTS), *pattern_problems(reports, NOT_IN_REPORTS),
        *(problem for what, (pattern, users) in ENTRY_POINTS.items()
          for problem in pattern_problems((s for s in files.values() if s.name not in users), {what: pattern})),
        *name_in_report_problems(reports, root), *reader_problems(files), *thread_problems(sources, root),
        *word_problems(texts_of_all), *subject_problems(texts_of_all), *citation_problems(sources, root), *picture_problems(root),
        *length_problems(sources + read_tree(root, ["bench"])), *name_problems(files), *layer_problems(files)]
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
        tree = {**clean, file: clean.get(file, "") + f'#include "{include}"\n'} if file else clean
        with tempfile.TemporaryDirectory() as folder:
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
