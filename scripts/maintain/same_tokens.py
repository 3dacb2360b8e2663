#!/usr/bin/env python3
"""usage: scripts/maintain/same_tokens.py [--strings] REVISION [NEW_REVISION]

Checks that a change of comments and texts changed no code: compares the tokens of every C++ and Python file of REVISION with
those of NEW_REVISION (default: the work tree). Comments, white space and the contents of string literals are ignored, and
adjacent literals count as one.

  --strings  also prints the string literals that differ, since some of them are keys, names or formats

Exit codes: 0 equal, 1 different (one line for each file that differs), 2 usage.
"""

import collections
import io
import pathlib
import re
import subprocess
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEXER = re.compile(
    r"""(?P<comment>//(?:\\\n|[^\n])*|/\*.*?\*/)|(?P<raw>\bR"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)")"""
    r"""|(?P<string>"(?:\\.|[^"\\\n])*")|(?P<number>\d(?:'?[\w.])*)|(?P<char>'(?:\\.|[^'\\\n])+')"""
    r"""|(?P<include>\#\s*include[^\n]*)|(?P<token>\w+|\S)""", re.DOTALL)
LEFT_OUT = (tokenize.COMMENT, tokenize.NL, tokenize.ENCODING)


def cpp_tokens(text):
    for match in LEXER.finditer(text):
        if match.lastgroup != "comment":
            yield match.lastgroup in ("raw", "string"), match[0]


def python_tokens(text):
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in LEFT_OUT:
            # The text of an indentation or a line's end is white space; its kind is the token.
            space = token.type in (tokenize.INDENT, tokenize.DEDENT, tokenize.NEWLINE)
            yield token.type == tokenize.STRING, str(token.type) if space else token.string


def tokens_and_strings(name, text):
    tokens, strings = [], []
    for is_string, token in (python_tokens if name.endswith(".py") else cpp_tokens)(text):
        if is_string:
            strings.append(token)
        if not is_string or not tokens or tokens[-1] != '"':
            tokens.append('"' if is_string else token)
    return tokens, strings


def git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False).stdout


def content(revision, name):
    """Returns the text of a file; empty if the revision does not have the file."""
    if revision:
        return git("show", f"{revision}:{name}")
    return (ROOT / name).read_text(encoding="utf-8") if (ROOT / name).exists() else ""


def main():
    revisions = [word for word in sys.argv[1:] if word != "--strings"]
    if not 1 <= len(revisions) <= 2 or any(word.startswith("-") for word in revisions):
        print(__doc__)
        return 2
    names = [name for name in git("diff", "--no-renames", "--name-only", *revisions).split("\n")
             if name.endswith((".h", ".cc", ".py"))]
    different = 0
    for name in names:
        before, after = (tokens_and_strings(name, content(revision, name)) for revision in (revisions + [None])[:2])
        if before[0] != after[0]:
            print(f"{name}: other tokens")
            different += 1
        if "--strings" in sys.argv:
            removed, added = collections.Counter(before[1]), collections.Counter(after[1])
            for sign, strings in (("-", removed - added), ("+", added - removed)):
                print("".join(f"{name}: {sign} {text}\n" for text in strings), end="")
    print(f"{len(names)} changed files, {different} with other tokens")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
