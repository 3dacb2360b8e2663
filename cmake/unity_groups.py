#!/usr/bin/env python3
"""Which sources can be compiled as one: prints a line a group, names parted by blanks.

usage: unity_groups.py [--most LINES] SOURCE...

Much of the time to compile a file goes into what it includes and into templates that its neighbours use too. Files
go together, up to LINES of them (a compiler's memory, and cores that wait for the last one), when no name that one declares for itself (anonymous namespaces, static functions, macros) is declared or called by
another. The groups depend on the texts of the sources and their order alone.
"""

import argparse
import pathlib
import re

NOT_NAMES = {"if", "for", "while", "switch", "return", "sizeof", "catch", "operator", "const", "constexpr", "static_assert", "decltype",
             "alignas", "namespace", "using", "template", "typename", "struct", "class", "enum", "else", "do", "TEST", "TEST_F", "TEST_P",
             "INSTANTIATE_TEST_SUITE_P", "MATCHER", "MATCHER_P", "MATCHER_P2", "MATCHER_P3"}
STRIP = re.compile(r'R"(\w*)\((?:.|\n)*?\)\1"|//[^\n]*|/\*(?:.|\n)*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'')
CALL = re.compile(r"(?<![.\w>:])(\w+)\s*(?:<[^;(){}]*>)?\s*\(")


ALIAS = re.compile(r"\b(?:namespace|using)\s+(\w+)\s*=([^;]*);|\busing\s+[\w:]+::\w+;|\busing\s+namespace[^;]*;")


BASES = re.compile(r"\b((?:struct|class)\s+\w+(?:\s+final)?)\s*:[^{;]*(?=\{)")


def anonymous_parts(text):
    """The texts inside `namespace { .. }`."""
    for begin in re.finditer(r"\bnamespace\s*\{", text):
        depth, at = 1, begin.end()
        while depth > 0 and at < len(text):
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            at += 1
        yield text[begin.end():at - 1]


def top_level(text):
    """With everything in braces or parentheses cut out."""
    out, depth = [], 0
    for c in text:
        if c in "{(":
            if depth == 0:
                out.append(c)
            depth += 1
        elif c in "})":
            depth -= 1
            if depth == 0:
                out.append(c)
        elif depth == 0:
            out.append(c)
    return "".join(out)


def declared(text):
    names = set()
    for part in anonymous_parts(text):
        flat = BASES.sub(r"\1", ALIAS.sub("", top_level(part)))
        names.update(re.findall(r"\b(?:struct|class|enum(?:\s+class)?|union)\s+(?:\w+\s+)*?(\w+)\s*(?:final\s*)?[:{;]", flat))
        names.update(re.findall(r"\b(\w+)\s*\(\)", flat))           # functions, their arguments cut out
        names.update(re.findall(r"\b(\w+)\s*(?:\[[^\]]*\]\s*)*(?:=|\{\})", flat))  # constants
        names.update(re.findall(r"\b(\w+)\s*;", flat))
        names.update(re.findall(r"\bMATCHER\w*\(", flat))
    for macro in re.findall(r"\bMATCHER(?:_P\d?)?\(\s*(\w+)", text):
        names.add(macro)
    names.update(re.findall(r"^static [\w:<>,&* ]*?\b(\w+)\s*\(", text, re.MULTILINE))
    names.update(re.findall(r"^\s*#\s*define\s+(\w+)", text, re.MULTILINE))
    names.update(f"{a}.{b}" for a, b in re.findall(r"\bTEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)", text))
    return {name for name in names - NOT_NAMES if not name[:1].isdigit()}


class Source:
    def __init__(self, path):
        raw = pathlib.Path(path).read_text(encoding="utf-8")
        text = STRIP.sub('""', raw)
        self.path = path
        self.declared = declared(text)
        self.aliases = {m[1]: m[2].split() for m in ALIAS.finditer(text) if m[1]}
        self.called = set(CALL.findall(text)) - NOT_NAMES
        self.lines = raw.count("\n")
        self.alone = bool(re.search(r"^\s*#\s*pragma GCC|\bsetjmp\b|^int main\(|^\s*#\s*undef|^using namespace", raw, re.MULTILINE))

    def fits(self, other):
        return not (self.alone or other.alone or self.declared & other.declared or self.declared & other.called
                    or other.declared & self.called or self.differs(other) or self.declared & other.aliases.keys()
                    or other.declared & self.aliases.keys())

    def differs(self, other):
        """The same alias for different things."""
        return any(self.aliases[name] != other.aliases[name] for name in self.aliases.keys() & other.aliases.keys())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--most", type=int, default=2500)
    parser.add_argument("sources", nargs="+")
    arguments = parser.parse_args()
    groups = []
    for source in map(Source, arguments.sources):
        for group in groups:
            if sum(other.lines for other in group) + source.lines <= arguments.most and all(source.fits(other) for other in group):
                group.append(source)
                break
        else:
            groups.append([source])
    for group in groups:
        print(" ".join(source.path for source in group))


if __name__ == "__main__":
    main()
