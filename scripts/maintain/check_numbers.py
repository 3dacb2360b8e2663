#!/usr/bin/env python3
"""usage: scripts/maintain/check_numbers.py [--run|--update] SEXTANT [NAME.md ...]

Checks that every decimal number, every percentage and every integer of three or more digits in the sentences and tables of a
document is part of its evidence. Evidence is

- a block of the document, whose commands the test docs/commands runs;
- a file of `results` that the document names below the same heading: results/profiles/pwc_net_kitti03.json;
- `sextant options`, for defaults;
- results/documents/NAME.txt, by heading of the document:

      = errors() { ...; }           a function of the shell for the commands, before the first heading
      ## Heading
      @ lib/measurement/x.h         numbers that this file contains (constants, published values)
      $ command                     what it prints, below; compared by --run
      % command                     times, which differ from run to run, below; never compared

A number agrees with its evidence if the evidence, rounded to as many digits, is the same number; a percentage also agrees with
a share. `code`, links, headings, numbers of versions, years, names of sequences (0018) and the levels 95 % and 5 % are not checked.

  --run       also runs the commands of results/documents and compares their output; commands that need real data are skipped
              unless SEXTANT_DATA is set
  --update    runs these commands and writes their output into the files instead of comparing

Exit codes: 0 no problem, 1 problems (one line each), 2 usage.
"""

import collections
import os
import re
import subprocess
import sys
import tempfile

from check_docs import ROOT, blocks, command_line, fits, report, run

EVIDENCE = ROOT / "results" / "documents"
CONVENTIONAL = {"95 %", "5 %", "100 %", "50 %", "0 %"}
NUMBER = re.compile(r"(?<![\w.,/@#-])[-+]?(?P<digits>\d[\d,]*(?:\.\d+)?(?:e-?\d+)?)(?P<percent> ?\\?%)?(?![\w.]*\d)")
PRINTED = re.compile(r"(?<![A-Za-z0-9_.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
NEEDS_DATA = re.compile(r"SEXTANT_DATA|vdo:kitti|kitti:|vkitti1:|sceneflow:|tartanair:|with_data")
# Names followed by a version or a number of their own.
VERSION = re.compile(r"\b(Ubuntu|Debian|Python|numpy|scipy|pandas|OpenCV|Slurm|arXiv|BY-NC-SA|Virtual KITTI|vkitti|version|Boost|"
                     r"simdjson|Embree|cmake|CMake|glibc|schema|RFC) v?\d+(\.\d+)*( (and|or|to) \d+(\.\d+)*)?|\d+\.\d+\.\d+")


def quoted(line):
    """Numbers of a line that need evidence, outside of code, links and versions: (text, value, half of the last digit)."""
    content = VERSION.sub(" ", re.sub(r"``[^`]*``|`[^`]*`|\]\([^)]*\)", " ` ", line))
    for match in NUMBER.finditer(content):
        digits, percent = match["digits"].rstrip(",").replace(",", ""), match["percent"] is not None
        is_large = len(digits) > 2 and "e" not in digits and digits[0] != "0" and not 1900 <= float(digits) < 2100
        if (percent or "." in digits or is_large) and f"{digits} %" not in (CONVENTIONAL if percent else ()):
            mantissa, _, exponent = digits.partition("e")
            decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
            yield digits + (" %" if percent else ""), float(digits), 0.5000001 * 10.0 ** -decimals


def numbers_in(text):
    text = re.sub(r"(?<=\d)[',](?=\d{3}(?!\d))", "", text)  # 10'000 or 10,000
    return sorted({abs(float(number)) for number in PRINTED.findall(text)})


def is_in(value, half, percent, numbers):
    return any(abs(scale * number - value) <= half for scale in ((1, 100) if percent else (1,)) for number in numbers)


class Evidence:
    """Sections of results/documents/NAME.txt: heading -> [(kind, command, printed lines)]."""

    def __init__(self, document):
        self.path = EVIDENCE / (document.stem + ".txt")
        self.head, self.sections = [], collections.OrderedDict()
        entries = None
        for line in self.path.read_text(encoding="utf-8").splitlines() if self.path.exists() else ():
            if line.startswith("## "):
                entries = self.sections.setdefault(line[3:], [])
            elif entries is None:
                self.head.append(line)
            elif line[:2] in ("$ ", "% ", "@ "):
                entries.append((line[0], line[2:], []))
            elif entries:
                entries[-1][2].append(line)

    def numbers(self, heading):
        text = ""
        for kind, command, printed in self.sections.get(heading, ()):
            if kind == "@" and (ROOT / command).is_file():
                text += (ROOT / command).read_text(encoding="utf-8")
            text += "\n".join(printed) + "\n"
        return numbers_in(text)

    def write(self):
        lines = list(self.head)
        for heading, entries in self.sections.items():
            lines.append("## " + heading)
            for kind, command, printed in entries:
                lines += [f"{kind} {command}", *printed]
        self.path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def result_files(text):
    """Text of the files of `results` that a section names."""
    for name in re.findall(r"results/[\w./-]+", text):
        path = ROOT / name.rstrip("/.")
        for file in [path] if path.is_file() else sorted(path.glob("*.json")):
            if file.suffix in (".json", ".csv", ".md") and "documents" not in file.parts:
                yield file.read_text(encoding="utf-8")


def sections_of(text):
    """Returns heading -> [(line, text of the line, whether it is a heading or belongs to a block)]."""
    sections, heading, in_block = collections.defaultdict(list), "", False
    for line, content in enumerate(text.split("\n"), 1):
        fence = content.startswith("```")
        in_block ^= fence
        if content.startswith("#") and not in_block:
            heading = content.lstrip("#").strip()
        sections[heading].append((line, content, in_block or fence or content.startswith("#")))
    return sections


def problems(document, defined):
    text = document.read_text(encoding="utf-8")
    evidence, sections = Evidence(document), sections_of(text)
    of_blocks = numbers_in("\n".join(content for _, _, content in blocks(text)))
    for heading in set(evidence.sections) - set(sections):
        yield f"{evidence.path.name}: {document.name} has no heading '{heading}'"
    for kind, name, _ in sum(evidence.sections.values(), []):
        if kind == "@" and not (ROOT / name).is_file():
            yield f"{evidence.path.name}: no such file: {name}: name the file that holds these numbers now"
    for heading, lines in sections.items():
        named = result_files("\n".join(content for _, content, _ in lines))
        known = of_blocks + numbers_in("\n".join(named)) + evidence.numbers(heading)
        for line, content, is_code in lines:
            for shown, value, half in () if is_code else quoted(content):
                percent = shown.endswith("%")
                if not is_in(value, half, percent, known) and not is_in(value, 1e-9 * value, percent, defined):
                    yield f"{document.name}:{line}: {shown} stands in no evidence ({heading})"


def run_problems(document, sextant, update):
    evidence = Evidence(document)
    functions = "".join(line[2:] + "\n" for line in evidence.head if line.startswith("= "))
    with tempfile.TemporaryDirectory() as folder:
        for heading, entries in evidence.sections.items():
            for i, (kind, command, printed) in enumerate(entries):
                if kind != "$" or (NEEDS_DATA.search(command) and "SEXTANT_DATA" not in os.environ):
                    continue
                code, now = run(functions + command, folder, sextant, HOME=folder, ROOT=str(ROOT))
                if code != 0 or not fits(printed, now):
                    yield f"{evidence.path.name}: {heading}: `{command}` prints something else:\n    " + "\n    ".join(now)
                    if update and code == 0:
                        entries[i] = (kind, command, now)
    if update and evidence.path.exists():
        evidence.write()


def self_test():
    assert [q[0] for q in quoted("| 0.064 m | 18 to 79 %, 5 %, 300, -2.4 to 4.6 % | 1,000.5 | x0.5 |")] == \
        ["0.064", "79 %", "300", "2.4", "4.6 %", "1000.5"]
    assert is_in(0.064, 0.0005, False, [0.0642]) and not is_in(0.064, 0.0005, False, [0.0648])
    assert is_in(18, 0.5, True, [0.183]) and not is_in(18, 0.5, False, [0.183])
    assert numbers_in("a1.5 -2.5 3e-2 10'000") == [0.03, 2.5, 10000]
    assert [q[0] for q in quoted("a `1.5` [b](2.5) 3.5 Ubuntu 22.04")] == ["3.5"]


def main():
    flags, words = command_line(__doc__, {"--run", "--update"})
    self_test()
    documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    documents = [d for d in documents if d.name in words[1:] or len(words) == 1]
    found = [problem for d in documents for problem in run_problems(d, words[0], "--update" in flags)] if flags else []
    if "--update" in flags:
        print("\n".join(found))
        found = []
    defined = numbers_in(subprocess.run([words[0], "options"], stdout=subprocess.PIPE, text=True, check=True).stdout)
    found += [problem for d in documents for problem in problems(d, defined)]
    return report(found, f"{len(documents)} documents: every decimal number, percentage and large integer has its evidence")


if __name__ == "__main__":
    sys.exit(main())
