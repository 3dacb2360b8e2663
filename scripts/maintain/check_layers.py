#!/usr/bin/env python3
"""Checks that includes follow the layers of docs/architecture.md.

usage: scripts/maintain/check_layers.py [--self-test]

1. A file includes project headers as "sextant/<folder>/<file>.h", and the header exists.
2. A folder includes only the modules that its CMakeLists.txt links (DEPENDS and PRIVATE of sextant_module); CMake refuses
   cycles of them.
3. Only TRUTH_READERS link the module truth, and TRUTH_FREE modules link only each other: an estimator that can see the ground
   truth cannot be evaluated with it.
4. Only the files in ENTRY_POINTS parse JSON (its limits are in base/json.h), run a program, or create files and folders.
5. A reader that a header of lib, datasets or eval declares (decode_*, parse_*, read_* of text, bytes or a path) is
   called in eval/fuzz/targets.cc, or by a reader that is: see READERS_WITHIN.
6. No two files have the same name, except for ONE_A_FOLDER: the name of a file must describe it.
7. String literals of reports (REPORTS) contain no name of a data set, estimator or measured system: these names come from
   zhang2020_data.json and the records. Reports read typed rows: no cell is compared with a text or found by its number.
8. A test uses no folder that others use and no clock: it works in a TempFolder of base/testing.h.
9. Comments and messages use the field's terms instead of the words in PRIVATE_WORDS.
10. A comment of a header begins with its subject, not with a word of NO_SUBJECT.
11. A document or a section of one that a comment or message names exists: docs/NAME.md, "SECTION".
12. docs/modules.svg shows all modules, with a blue frame around each module of TRUTH_FREE.
13. No line of C++ is longer than the ColumnLimit of .clang-format, not even a comment or a text.

Tests (*_test.cc, *testing.h) are exempt from 1 to 7.
Exit codes: 0 clean, 1 violations, 2 usage.
"""

import fnmatch
import pathlib
import re
import sys
import tempfile
import typing

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOPS = ("lib", "datasets", "eval")

# Patterns over folders, with lib/ dropped; "*" also crosses "/".
TRUTH_READERS = ["metrics", "datasets", "datasets/synthetic", "eval/check", "eval/experiment", "eval/logs", "eval/evaluation",
                 "eval/external"]
TRUTH_FREE = ["base", "geometry", "measurement", "estimator", "estimator/*", "noise", "datasets/codec", "datasets/channels"]

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
        ["base/new_file.cc", "base/new_file.h", "datasets/layout.cc", "eval/external/external_case.cc", "eval/experiment/pack.cc"]),
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
COLUMN_LIMIT = re.search(r"ColumnLimit: (\d+)", (ROOT / ".clang-format").read_text())[1]
TOO_LONG = {f"a line of more than {COLUMN_LIMIT} characters": re.compile(rf"^.{{{COLUMN_LIMIT}}}.+$", re.MULTILINE)}

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


def matches(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def folder_of(name):
    return name.rpartition("/")[0]


def read_layers(root):
    """Folder of each module -> the folders of the modules that its CMakeLists.txt links, without those of its tests."""
    linked = {}
    for listing in (file for top in TOPS for file in sorted((root / top).rglob("CMakeLists.txt"))):
        text = re.sub(r"#[^\n]*|\bTEST_DEPENDS\b[^)]*", "", listing.read_text(encoding="utf-8"))
        folder = listing.parent.relative_to(root).as_posix().removeprefix("lib/")
        if re.search(r"\bsextant_module\(|\bSextant::", text) and "/example" not in folder:
            linked[folder] = re.findall(r"\bSextant::(\w+)", text)
    folders = {folder.rpartition("/")[2]: folder for folder in linked}
    return {folder: sorted({folders[module] for module in modules} - {folder}) for folder, modules in linked.items()}


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


def picture_problems(layers, root):
    picture = root / "docs" / "modules.svg"
    if not picture.exists():
        return
    shown = {name: frame for frame, name in re.findall(
        r'stroke="([^"]+)"[^>]*/><text [^>]*text-anchor="middle">([^<]+)</text>', picture.read_text(encoding="utf-8"))}
    for module in sorted(layers.keys() ^ shown.keys()):
        yield "docs/modules.svg: " + (f"{module} is missing" if module in layers else f"there is no module {module}")
    for module in sorted(layers.keys() & shown.keys()):
        if (shown[module] == "#0072b2") != matches(module, TRUTH_FREE):
            yield f"docs/modules.svg: {module}: a blue frame means that it cannot see the truth"


def name_problems(files):
    first = {}
    for name, source in files.items():
        file = name.rpartition("/")[2]
        if first.setdefault(file, source.path) != source.path and file not in ONE_A_FOLDER:
            yield f"{source.path}: there is {first[file]} too: give one a name that says what it is"


def truth_problems(layers):
    for folder, linked in layers.items():
        if "truth" in linked and not matches(folder, TRUTH_READERS):
            yield f"{folder} may not see the ground truth: its CMakeLists.txt links it"
        for other in linked if matches(folder, TRUTH_FREE) else ():
            if not matches(other, TRUTH_FREE):
                yield f"{folder} may not see the ground truth: its CMakeLists.txt links {other}, which may"


def include_problems(files, layers):
    for name, source in files.items():
        folder = folder_of(name)
        if folder not in layers:
            yield f"{source.path}: the CMakeLists.txt of '{folder}' makes no module"
        for match in _INCLUDE.finditer(source.text) if folder in layers else ():
            include, header, place = match[1], match[1].removeprefix("sextant/"), source.at(match.start(1))
            target, allowed = folder_of(header), layers[folder]
            if header == include:
                yield f'{place}: "{include}": write project includes as "sextant/<folder>/<file>.h"'
            elif header not in files:
                yield f'{place}: "{include}": there is no such header'
            elif target not in (folder, *allowed):
                yield f"{place}: {folder} may not include {target}: its CMakeLists.txt links {', '.join(allowed) or 'nothing'}"


def check(root):
    sources, layers = read_tree(root, TOPS), read_layers(root)
    texts_of_all = [s for s in sources + read_tree(root, (*TOPS, "docs"), (".py", ".md")) if "/example" not in s.path]
    files = {s.name: s for s in sources if not s.is_test and "/example" not in s.path}  # an example is a project for users to copy
    reports = [Source(s.path, re.sub(r"//[^\n]*", "", s.text)) for s in files.values() if matches(s.name, REPORTS)]
    problems = [
        *pattern_problems((s for s in sources if s.is_test), NOT_IN_TESTS), *pattern_problems(reports, NOT_IN_REPORTS),
        *(problem for what, (pattern, users) in ENTRY_POINTS.items()
          for problem in pattern_problems((s for s in files.values() if s.name not in users), {what: pattern})),
        *name_in_report_problems(reports, root), *reader_problems(files),
        *word_problems(texts_of_all), *subject_problems(texts_of_all), *citation_problems(sources, root),
        *picture_problems(layers, root), *pattern_problems(sources + read_tree(root, ["bench"]), TOO_LONG), *name_problems(files),
        *include_problems(files, layers), *truth_problems(layers)]
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
        "lib/base/CMakeLists.txt": "sextant_module(base)",
        "lib/geometry/CMakeLists.txt": "sextant_module(geometry DEPENDS Sextant::base)",
        "lib/truth/CMakeLists.txt": "sextant_module(truth DEPENDS Sextant::geometry)",
        "lib/estimator/CMakeLists.txt": "sextant_module(estimator)",
        "lib/estimator/solvers/CMakeLists.txt": "sextant_module(solvers DEPENDS Sextant::geometry TEST_DEPENDS Sextant::datasets)",
        "lib/noise/CMakeLists.txt": "sextant_module(noise DEPENDS Sextant::base)",
        "lib/metrics/CMakeLists.txt": "sextant_module(metrics DEPENDS Sextant::truth)",
        "datasets/CMakeLists.txt": "sextant_module(datasets DEPENDS Sextant::truth)",
        "eval/gate/CMakeLists.txt": "sextant_module(gate)",
        "eval/fuzz/CMakeLists.txt": "target_link_libraries(targets PUBLIC Sextant::gate)",
        "eval/report/CMakeLists.txt": "sextant_module(report DEPENDS Sextant::base)",
        "eval/report/tables/CMakeLists.txt": "sextant_module(tables DEPENDS Sextant::base)",
        "lib/metrics/errors.h": '#include "sextant/truth/truth.h"\n',
        "datasets/dataset.h": '#include "sextant/truth/truth.h"\n',
        "eval/report/table.h": '#include "sextant/base/error.h"\n',
        "eval/gate/policy.h": "int read_policy(const std::string& file);\n",
        "eval/fuzz/targets.cc": "void policy() { read_policy(file); }\n",
        "datasets/registry.cc": 'Adapter{"sea-floor", "what is below"};\nstd::vector table = {{"sea-floor", "below"}};\n',
        "eval/report/tables/depth_table.cc": '// As "sea-floor" has it.\nconst char* title = "all of the sea";\n',
    }
    planted = [
        ("upward include", "lib/base/error.h", '#include "sextant/geometry/se3.h"', "base may not include geometry"),
        ("truth in the estimator", "lib/estimator/solvers/estimator.h", '#include "sextant/truth/truth.h"',
         "estimator/solvers may not include truth"),
        ("a module that only tests link", "lib/estimator/solvers/estimator.h", '#include "sextant/datasets/dataset.h"',
         "estimator/solvers may not include datasets"),
        ("truth linked by a report", "eval/report/CMakeLists.txt", "link(Sextant::truth)", "eval/report may not see the ground"),
        ("truth behind a module", "lib/noise/CMakeLists.txt", "link(Sextant::metrics)", "links metrics, which may"),
        ("relative include", "lib/geometry/se3.h", '#include "../base/error.h"', "write project includes"),
        ("missing header", "lib/geometry/se3.h", '#include "sextant/base/no.h"', "no such header"),
        ("unknown folder", "lib/extra/extra.h", "", "makes no module"),
        ("another entry point for JSON", "eval/report/table.h", "auto j = Json::parse(text);", "parses JSON"),
        ("a reader that nothing fuzzes", "lib/geometry/se3.h", "int decode_x(std::string_view bytes);",
         "decode_x() reads untrusted files and has no target"),
        ("a name twice", "eval/gate/table.h", "", "there is eval/gate/table.h too"),
        ("a test in a folder of others", "lib/noise/depth_test.cc", "auto folder = testing::TempDir();",
         "TempFolder (base/testing.h) is the test's own"),
        ("a test with a clock", "lib/noise/depth_test.cc", "auto now = std::chrono::steady_clock::now();", "depends on the speed"),
        ("a file made in place", "eval/report/table.h", "auto file = std::ofstream(name);", "creates a file"),
        ("a data set in a report", "eval/report/tables/depth_table.cc", 'auto s = "depth of sea-floor";', "names 'sea-floor'"),
        ("a cell compared with a text", "eval/report/table.h", 'bool b = row == Cell("no");', "compares a cell"),
        ("a cell by its number", "eval/report/table.h", "auto cell = row[5];", "by its number"),
        ("a private word", "lib/base/error.h", "// Files of strangers.", "'strangers' is a private word"),
        ("a private word in a message", "lib/base/error.h", 'auto a = "as the file said";', "'said' is a private"),
        ("a private word in a document", "docs/a.md", "a room of its own", "'room' is a private word"),
        ("a comment without a subject", "lib/base/error.h", "/// Whether it is one.", "begins with its subject"),
        ("a member without a subject", "lib/base/error.h", "int a = 0;  ///< of the image", "begins with its subject"),
        ("a lost document", "lib/base/error.h", "// See docs/lost.md.", "docs/lost.md does not exist"),
        ("a long line", "lib/base/error.h", "// " + "a " * 60, "a line of more than 110 characters"),
        ("a shell", "lib/base/error.h", "int s = std::system(text);", "runs a program"),
    ]
    failures = 0
    for what, file, text, expected in [("clean tree", "lib/base/error.h", "", None)] + planted:
        tree = {**clean, file: clean.get(file, "") + text + "\n"}
        with tempfile.TemporaryDirectory() as folder:
            for name, content in tree.items():
                path = pathlib.Path(folder) / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(content, encoding="utf-8")
            problems, _ = check(pathlib.Path(folder))
        good = any(expected in problem for problem in problems) if expected else not problems
        print(f"{'ok  ' if good else 'FAIL'} {what}" + ("" if good else f": got {problems}"))
        failures += not good
    return 1 if failures else 0


def main():
    if set(sys.argv[1:]) - {"--self-test"}:
        print(__doc__)
        return 0 if "--help" in sys.argv else 2
    if "--self-test" in sys.argv:
        return self_test()
    problems, count = check(ROOT)
    print(*problems, f"{count} files, {len(problems)} violations", sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
