#!/usr/bin/env python3
"""usage: scripts/maintain/workflow_steps.py WORKFLOW.yml [ROW]

The commands of a workflow of GitHub with the values of its matrix put in. With ROW: the image of that row's container, then a line
per step that runs: its name and its command, each as base64. Without: all rows, to read.
"""

import base64
import pathlib
import re
import sys

import yaml


def rows(workflow):
    """Returns (image, [(name of the step, command)]) of every row of the matrix of every job."""
    found = []
    for job in workflow["jobs"].values():
        for row in job.get("strategy", {}).get("matrix", {}).get("include", [{}]):
            found.append((fill(job["container"], row),
                          [(step["name"], fill(step["run"], row)) for step in job["steps"] if "run" in step and runs(step, row)]))
    return found


def fill(text, row):
    """Returns the text with ${{ matrix.KEY }} and ${{ matrix.KEY && 'A' || 'B' }} replaced; other expressions are an error."""

    def value(match):
        expression = re.fullmatch(r"matrix\.(\w+)(?: && '([^']*)' \|\| '([^']*)')?", match[1])
        if expression is None:
            raise SystemExit(f"${{{{ {match[1]} }}}}: expected matrix.KEY, or matrix.KEY && 'A' || 'B'")
        if expression[2] is None:
            return str(row[expression[1]])
        return expression[2] if row[expression[1]] else expression[3]

    return re.sub(r"\$\{\{ *(.*?) *\}\}", value, text)


def runs(step, row):
    condition = re.fullmatch(r"matrix\.(\w+)", step.get("if", ""))
    return bool(row[condition[1]]) if condition else True


def encoded(text):
    return base64.b64encode(text.encode()).decode()


def main():
    if len(sys.argv) not in (2, 3) or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if "--help" in sys.argv else 2
    found = rows(yaml.safe_load(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
    if len(sys.argv) == 2:
        for number, (image, steps) in enumerate(found):
            print(f"row {number}: {image}")
            print("\n".join(f"  {name}: {command}" for name, command in steps))
        return 0
    if not sys.argv[2].isdigit() or int(sys.argv[2]) >= len(found):
        raise SystemExit(f"row {sys.argv[2]}: expected 0 to {len(found) - 1}")
    image, steps = found[int(sys.argv[2])]
    print(image)
    print("\n".join(f"{encoded(name)} {encoded(command)}" for name, command in steps))
    return 0


if __name__ == "__main__":
    sys.exit(main())
