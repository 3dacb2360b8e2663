#!/usr/bin/env python3
"""usage: scripts/maintain/check_docs.py [--update] SEXTANT [FILE.md ...]

Checks README.md, CONTRIBUTING.md, CHANGELOG.md and docs/*.md:

- Commands. Every line that begins with `$ ` in a block ```console is run; the commands of a file run one after the other in
  the same folder, which is empty at first. The lines below a command must equal its output, except for lines about progress
  and times. A line `...` stands for any number of lines. For a command that fails the block must show its message. A block
  ```python whose first line is `# NAME.py` is written to that file in the folder.
- Flags. SEXTANT knows every flag of `sextant` in any block.
- Links. Every link to a file or a heading of the repository has a target.

  --update    writes the output into the blocks instead of comparing (blocks with `...` stay unchanged)

Exit codes: 0 no problem, 1 problems (one line each), 2 usage.
"""

import collections
import difflib
import functools
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(!?)\[[^\]\n]*\]\(([^()\s]+)\)")
TIME_LIMIT_S = 3000  # ends a command that hangs
# Lines that the program prints only on slow machines: progress after five seconds, a summary after ten.
NOTICE = re.compile(r"Time: [\d.]+ s; of it .*|waiting for the correspondence cache, .*|.+ \d+/\d+(  [\d.]+/s  [\d.]+ s left| in [\d.]+ s)")


def blocks(text):
    """Yields (line number, language, content) of every fenced block."""
    for match in BLOCK.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, match[1], match[2]


def without_blocks(text):
    """Returns the text with an empty line for each line of a block."""
    return BLOCK.sub(lambda match: "\n" * match[0].count("\n"), text)


def run(command, folder, sextant, timeout=None, **environment):
    """Runs a command of the shell that finds `sextant` and the test programs. Returns its exit code and the lines that it prints.
    A variable that is None is removed from the environment."""
    programs = pathlib.Path(sextant).resolve().parent
    environment = dict(os.environ, PATH=f"{programs}:{programs.parent / 'test'}:{os.environ['PATH']}", LC_ALL="C.UTF-8",
                       SEXTANT_CACHE="", COLUMNS="200", **environment)
    done = subprocess.run(["bash", "-c", command], cwd=folder, env={k: v for k, v in environment.items() if v is not None},
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=timeout)
    return done.returncode, [line.rstrip() for line in done.stdout.splitlines()]


def commands(block):
    """Returns [(command, lines shown below it)] of a block."""
    found = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif found:
            found[-1][1].append(line)
    return found


def fits(shown, printed):
    """Returns true if `printed` equals `shown`, in which `...` stands for any lines."""
    pattern = "".join(r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line.rstrip()) + "\n" for line in shown)
    return re.fullmatch(pattern, "".join(line + "\n" for line in printed)) is not None


def console_problems(file, sextant, update):
    text = file.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as home:
        def block(match):
            name = re.match(r"# (\w+\.py)\n", match[2]) if match[1] == "python" else None
            if name:
                (pathlib.Path(folder) / name[1]).write_text(match[2], encoding="utf-8")
            if match[1] != "console":
                return match[0]
            line, out = text.count("\n", 0, match.start()) + 1, []
            for command, shown in commands(match[2]):
                printed = run(command, folder, sextant, TIME_LIMIT_S, HOME=home, TMPDIR=home, SEXTANT_DATA=None)[1]
                printed = [line for line in printed if not NOTICE.fullmatch(line)]
                if not fits(shown, printed):
                    difference = "\n    ".join(difflib.unified_diff(shown, printed, "shown", "printed", lineterm="", n=0))
                    found.append(f"{file.name}:{line}: `{command}` prints something else:\n    {difference}")
                keep = any(s.strip() == "..." for s in shown)
                out += ["$ " + command] + (shown if keep else printed)
            return "```console\n" + "\n".join(out) + "\n```"
        found = []
        renewed = BLOCK.sub(block, text)
    if update and renewed != text:
        file.write_text(renewed, encoding="utf-8")
        return []
    return found


def anchor(heading):
    """Returns the anchor that GitHub gives a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", lambda m: m[1] or "", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


def anchors(file):
    counts = collections.Counter()
    for heading in re.findall(r"^#+ (.*)$", BLOCK.sub("", file.read_text(encoding="utf-8")), re.MULTILINE):
        counts[anchor(heading)] += 1
    return {f"{name}-{i}" if i else name for name, n in counts.items() for i in range(n)}


def link_problems(file):
    """Yields the links outside of blocks that lead to no file or heading of the repository."""
    text = without_blocks(file.read_text(encoding="utf-8"))
    for match in LINK.finditer(text):
        target, place = match[2], f"{file.name}:{text.count(chr(10), 0, match.start()) + 1}"
        if re.match(r"[a-z]+:", target):
            continue
        path, _, name = target.partition("#")
        other = (file.parent / path).resolve() if path else file
        if not other.exists():
            yield f"{place}: no such file: {target}"
        elif name and other.suffix == ".md" and name not in anchors(other):
            yield f"{place}: no heading #{name} in {other.name}"


@functools.cache
def help_of(sextant, *command):
    """Returns the help text of a command, None if there is no such command."""
    shown = subprocess.run([sextant, *command, "--help"], capture_output=True, text=True)
    return None if shown.returncode else shown.stdout


def missing_flags(text, known):
    """Returns the flags in the text of a command that a help text does not list."""
    return [flag for flag in re.findall(r"(?<!\S)--[a-z][\w-]*", text) if not re.search(re.escape(flag) + r"\b", known)]


def flag_problems(sextant, text):
    """Yields the flags in `text` that `sextant COMMAND --help` does not list."""
    for line in text.splitlines():
        call = re.search(r"\bsextant ((?:(?:baseline|evaluate|data|noise|cache) |benchmark (?=verify|page))?[a-z]+) (.*)", line)
        if not call or "..." in line:
            continue
        command, rest = call[1].split(), re.sub(r"'[^']*'|\"[^\"]*\"", "", call[2])
        help_text = help_of(sextant, *command)
        if help_text is None:
            yield f"no such command: sextant {call[1]}"
            continue
        yield from (f"sextant {call[1]} has no {flag}" for flag in missing_flags(re.split(r"[|;&#]", rest)[0], help_text))


def problems(sextant, file, update):
    yield from console_problems(file, sextant, update)
    for line, language, content in blocks(file.read_text(encoding="utf-8")):
        if language in ("", "console", "bash", "sh", "yaml"):
            yield from (f"{file.name}:{line}: {problem}" for problem in flag_problems(sextant, content))
    yield from link_problems(file)


def self_test():
    assert fits(["a", "...", "d"], ["a", "b", "c", "d"]) and not fits(["a"], ["a", "b"]) and fits(["...", "d"], ["d"])
    assert anchor("What `a.b` is, and [why](x.md)") == "what-ab-is-and-why"
    assert NOTICE.fullmatch("Time: 11.0 s; of it frames 9.8 s, figures 1.0 s") and NOTICE.fullmatch("cases 9/12 in 5.2 s")
    assert NOTICE.fullmatch("cases 3/12  0.6/s  15.0 s left") and not NOTICE.fullmatch("ego 50 of 50 in 3 s")
    assert list(blocks("x\n```bash\nls\n```\n")) == [(2, "bash", "ls\n")]
    assert commands("$ a\nb\n$ c\n") == [("a", ["b"]), ("c", [])]
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "x.md"
        file.write_text("# A\n[b](#b) [no](no.md) [a](#a)\n```console\n$ echo 1\n2\n```\n")
        assert [p.rpartition(": ")[2] for p in link_problems(file)] == ["no heading #b in x.md", "no.md"], list(link_problems(file))
        assert len(console_problems(file, "/bin/true", False)) == 1
        console_problems(file, "/bin/true", True)
        assert not console_problems(file, "/bin/true", False)


def command_line(help_text, known):
    """Returns the flags and the other words of the command line; prints the help and ends the program if they are wrong."""
    flags = {word for word in sys.argv[1:] if word.startswith("--")}
    words = [word for word in sys.argv[1:] if word not in flags]
    if flags - known or not words:
        print(help_text)
        sys.exit(0 if "--help" in flags else 2)
    return flags, words


def report(found, good):
    """Prints the problems, or that there are none. Returns the exit code."""
    print("\n".join(found) or good)
    return 1 if found else 0


def main():
    flags, words = command_line(__doc__, {"--update"})
    self_test()
    documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
    files = [pathlib.Path(name).resolve() for name in words[1:]] or documents
    found = [problem for file in files for problem in problems(words[0], file, "--update" in flags)]
    return report(found, f"{len(files)} documents: commands, flags and links are good")


if __name__ == "__main__":
    sys.exit(main())
