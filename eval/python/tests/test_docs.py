"""docs/python.md: every block of Python and every command is run, from top to bottom in one folder, and prints what stands below it.

With --write the printed blocks are written into the document instead.
"""

import contextlib
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import sextant

DOCUMENT = pathlib.Path(os.environ["SEXTANT_ROOT"]) / "docs" / "python.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BUILDS = "scripts/setup"  # how to build what is running here


def run_python(code, names):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, str(DOCUMENT), "exec"), names)
    return out.getvalue()


def run_shell(code):
    path = f"{pathlib.Path(sextant.program()).absolute().parent}:{os.environ['PATH']}"
    done = subprocess.run(["bash", "-euc", code], env={**os.environ, "PATH": path}, capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f"{code}\n{done.stderr}")
    return re.sub(r"^(Results: .*|\d+ records, \d+ columns)\n", "", done.stdout, flags=re.MULTILINE).rstrip("\n") + "\n"


def blocks(text):
    """(language, content, place of the content) of every block."""
    return [(match[1], match[2], match.span(2)) for match in BLOCK.finditer(text)]


def executed(text):
    """(place, what is shown there, what was printed) of every block of text."""
    names, printed, found = {"__name__": "document"}, None, []
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for language, content, place in blocks(text):
                if language == "text":
                    found.append((place, content, printed))
                elif language == "python":
                    printed = run_python(content, names)
                elif BUILDS not in content:
                    printed = run_shell(content)
        finally:
            os.chdir(before)
    return found


class Document(unittest.TestCase):
    def test_prints_what_it_shows(self):
        os.environ["SEXTANT_PROGRAM"] = str(pathlib.Path(sextant.program()).absolute())
        found = executed(DOCUMENT.read_text(encoding="utf-8"))
        self.assertGreater(len(found), 6)
        for _, shown, printed in found:
            self.assertEqual(shown, printed)

    def test_its_build_commands_are_there(self):
        first = next(content for language, content, _ in blocks(DOCUMENT.read_text()) if BUILDS in content)
        for command in re.findall(r"^(scripts/\w+)(.*)$", first, re.MULTILINE):
            script = DOCUMENT.parent.parent / command[0]
            shown = subprocess.run([script, "--help"], capture_output=True, text=True, check=True).stdout
            for flag in command[1].split():
                self.assertIn(flag, shown)
        self.assertIn(str(pathlib.Path(sextant.__file__).parent.parent)[-len("release/python"):], first)


if __name__ == "__main__":
    if "--write" in sys.argv:
        text = DOCUMENT.read_text(encoding="utf-8")
        for (begin, end), _, printed in reversed(executed(text)):
            text = text[:begin] + printed + text[end:]
        DOCUMENT.write_text(text, encoding="utf-8")
    else:
        unittest.main()
