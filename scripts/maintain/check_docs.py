#!/usr/bin/env python3
"""usage: scripts/maintain/check_docs.py [--update] [--external] SEXTANT [FILE.md ...]

Checks README.md, CONTRIBUTING.md, CHANGELOG.md and docs/*.md:

- Commands. Every line that begins with `$ ` in a block ```console is run; the commands of a file run one after the other in
  the same folder, which is empty at first. The lines below a command must equal its output, except for lines about progress
  and times. A line `...` stands for any number of lines. For a command that fails the block must show its message. A block
  ```python whose first line is `# NAME.py` is written to that file in the folder.
- Flags. SEXTANT knows every flag of `sextant` in any block.
- Links. Every link to a file or a heading of the repository has a target.

  --update    writes the output into the blocks instead of comparing (blocks with `...` stay unchanged)
  --external  only lists the links that lead out of the repository; none is followed

Exit codes: 0 no problem, 1 problems (one line each), 2 usage.
"""

import difflib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from check_recipes import flag_problems

ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(!?)\[[^\]\n]*\]\(([^()\s]+)\)")
TIME_LIMIT_S = 3000  # ends a command that hangs
# Lines that the program prints only on slow machines: progress after five seconds, a summary after ten.
NOTICE = re.compile(r"Time: [\d.]+ s; of it .*|waiting for the correspondence cache, .*|.+ \d+/\d+(  [\d.]+/s  [\d.]+ s left| in [\d.]+ s)")


def run(command, folder, home, sextant):
    environment = dict(os.environ, PATH=f"{pathlib.Path(sextant).resolve().parent}:{os.environ['PATH']}", LC_ALL="C.UTF-8",
                       SEXTANT_CACHE="", COLUMNS="200", HOME=home, TMPDIR=home)
    environment.pop("SEXTANT_DATA", None)
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=TIME_LIMIT_S)
    return [line for line in done.stdout.splitlines() if not NOTICE.fullmatch(line)]


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
    return re.fullmatch(pattern, "".join(line.rstrip() + "\n" for line in printed)) is not None


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
                printed = run(command, folder, home, sextant)
                if not fits(shown, printed):
                    difference = "\n    ".join(difflib.unified_diff(shown, printed, "shown", "printed", lineterm="", n=0))
                    found.append(f"{file.name}:{line}: `{command}` prints something else:\n    {difference}")
                keep = any(s.strip() == "..." for s in shown)
                out += ["$ " + command] + (shown if keep else [p.rstrip() for p in printed])
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
    counts, names = {}, set()
    for heading in re.findall(r"^#+ (.*)$", BLOCK.sub("", file.read_text(encoding="utf-8")), re.MULTILINE):
        name = anchor(heading)
        n = counts.setdefault(name, 0)
        counts[name] += 1
        names.add(f"{name}-{n}" if n else name)
    return names


def links(file):
    """Yields (line, target) of the links outside of blocks."""
    text = BLOCK.sub(lambda m: "\n" * m[0].count("\n"), file.read_text(encoding="utf-8"))
    for match in LINK.finditer(text):
        yield text.count("\n", 0, match.start()) + 1, match[2]


def link_problems(file):
    for line, target in links(file):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, name = target.partition("#")
        other = (file.parent / path).resolve() if path else file
        if not other.exists():
            yield f"{file.name}:{line}: no such file: {target}"
        elif name and other.suffix == ".md" and name not in anchors(other):
            yield f"{file.name}:{line}: no heading #{name} in {other.name}"


def problems(sextant, file, update):
    yield from console_problems(file, sextant, update)
    text = file.read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        if match[1] in ("", "console", "bash", "sh"):
            line = text.count("\n", 0, match.start()) + 1
            yield from (f"{file.name}:{line}: {problem}" for problem in flag_problems(sextant, match[2]))
    yield from link_problems(file)


def self_test():
    assert fits(["a", "...", "d"], ["a", "b", "c", "d"]) and not fits(["a"], ["a", "b"]) and fits(["...", "d"], ["d"])
    assert anchor("What `a.b` is, and [why](x.md)") == "what-ab-is-and-why"
    assert NOTICE.fullmatch("Time: 11.0 s; of it frames 9.8 s, figures 1.0 s") and NOTICE.fullmatch("cases 9/12 in 5.2 s")
    assert NOTICE.fullmatch("cases 3/12  0.6/s  15.0 s left") and not NOTICE.fullmatch("ego 50 of 50 in 3 s")
    assert commands("$ a\nb\n$ c\n") == [("a", ["b"]), ("c", [])]
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "x.md"
        file.write_text("# A\n[b](#b) [no](no.md) [a](#a)\n```console\n$ echo 1\n2\n```\n")
        assert [p.rpartition(": ")[2] for p in link_problems(file)] == ["no heading #b in x.md", "no.md"], list(link_problems(file))
        assert len(console_problems(file, "/bin/true", False)) == 1
        console_problems(file, "/bin/true", True)
        assert not console_problems(file, "/bin/true", False)


def main():
    flags = [word for word in sys.argv[1:] if word.startswith("--")]
    words = [word for word in sys.argv[1:] if not word.startswith("--")]
    if "--help" in flags or set(flags) - {"--update", "--external"} or not (words or "--external" in flags):
        print(__doc__)
        return 0 if "--help" in flags else 2
    self_test()
    documents = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
    files = [pathlib.Path(name).resolve() for name in words[1:]] or documents
    if "--external" in flags:
        print("\n".join(sorted({target for file in files for _, target in links(file) if re.match(r"https?:", target)})))
        return 0
    found = [problem for file in files for problem in problems(words[0], file, "--update" in flags)]
    print("\n".join(found) or f"{len(files)} documents: commands, flags and links are good")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
