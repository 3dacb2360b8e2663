#!/usr/bin/env python3
"""usage: scripts/maintain/check_recipes.py

Checks the recipes that users copy from docs/ci.md: every block is well-formed, and a GitHub or GitLab job has all required keys
(the test docs/commands checks the flags). In the workflows of this repository (.github/workflows), actions are pinned to a
commit, and the scripts that steps call exist and know their flags. The recipe of conda (scripts/recipe) parses, its version is
that of CMakeLists.txt, and its build script is well-formed.

Exit codes: 0 no problem, 1 problems (one line each), 77 skipped: no PyYAML (python3-yaml).
"""

import json
import re
import subprocess
import sys

try:
    import yaml
except ImportError:
    print("no PyYAML (python3-yaml): recipes are not checked")
    sys.exit(77)

from check_docs import ROOT, blocks, missing_flags, report  # noqa: E402  (after what may skip this test)


def problems_of(check, text):
    """Returns the problem that a check raises, in a list; an empty one if it raises none."""
    try:
        check(text)
        return []
    except (ValueError, yaml.YAMLError) as error:
        return [str(error)]


def check_bash(script):
    done = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
    if done.returncode:
        raise ValueError(done.stderr.strip())


def check_github_job(name, job):
    if "runs-on" not in job:
        raise ValueError(f"job {name}: no runs-on")
    for step in job.get("steps") or [{}]:
        if ("run" in step) == ("uses" in step):
            raise ValueError(f"job {name}: a step has one of 'run' and 'uses'")
        if unknown := set(step) - {"name", "id", "if", "run", "uses", "with", "env"}:
            raise ValueError(f"job {name}: unknown keys {sorted(unknown)}")
        check_bash(step.get("run", ""))


def check_gitlab_job(name, job):
    if unknown := set(job) - {"image", "variables", "before_script", "script", "artifacts", "allow_failure", "stage", "rules"}:
        raise ValueError(f"job {name}: unknown keys {sorted(unknown)}")
    script = job.get("script")
    if not isinstance(script, list) or not all(isinstance(line, str) for line in script):
        raise ValueError(f"job {name}: 'script' is not a list of commands")
    check_bash("\n".join(script))


def mapping(text):
    tree = yaml.safe_load(text)
    if not isinstance(tree, dict):
        raise ValueError("not a mapping")
    return tree


def check_jobs(text):
    tree = mapping(text)
    for name, job in tree.get("jobs", tree).items():
        (check_github_job if "jobs" in tree else check_gitlab_job)(name, job)


def script_problems(command):
    """Scripts of this repository that a command calls and that do not exist, and flags that their help does not have."""
    for name, rest in re.findall(r"(?<![\w/])scripts/((?:maintain/|recipe/)?[\w.]+)((?: +[^\s|;&]+)*)", command):
        script = ROOT / "scripts" / name
        if not script.is_file():
            yield f"there is no scripts/{name}"
            continue
        known = script.read_text()
        if name == "test":  # passes what it does not know to ctest
            known += subprocess.run(["ctest", "--help"], capture_output=True, text=True).stdout
        yield from (f"scripts/{name} has no {flag}" for flag in missing_flags(rest, known))


def fill(text, row):
    """Replaces ${{ matrix.KEY }} and ${{ matrix.KEY && 'A' || 'B' }} by the values of a row; other expressions are an error."""

    def value(match):
        expression = re.fullmatch(r"matrix\.(\w+)(?: && '([^']*)' \|\| '([^']*)')?", match[1])
        if expression is None:
            raise SystemExit(f"${{{{ {match[1]} }}}}: expected matrix.KEY, or matrix.KEY && 'A' || 'B'")
        if expression[2] is None:
            return str(row[expression[1]])
        return expression[2] if row[expression[1]] else expression[3]

    return re.sub(r"\$\{\{ *(.*?) *\}\}", value, text)


def workflow_rows(text):
    """Yields (container, [(name, command), ...]) for each row of the matrix of each job of a workflow."""
    for job in yaml.safe_load(text)["jobs"].values():
        for row in job.get("strategy", {}).get("matrix", {}).get("include", [{}]):
            steps = [step for step in job["steps"] if "run" in step and (
                not (condition := re.fullmatch(r"matrix\.(\w+)", step.get("if", ""))) or row[condition[1]])]
            yield fill(job["container"], row), [(step["name"], fill(step["run"], row)) for step in steps]


def workflow_problems(text):
    yield from problems_of(check_jobs, text)
    for action in re.findall(r"\buses: *(\S+)", text):
        if not re.fullmatch(r"[\w.-]+/[\w./-]+@[0-9a-f]{40}", action):
            yield f"{action}: expected an action pinned to a commit of 40 digits"
    for name, command in sorted({step for _, steps in workflow_rows(text) for step in steps}):
        yield from (f"{name}: {problem}" for problem in [*problems_of(check_bash, command), *script_problems(command)])


def check_conda(text):
    """Reads a recipe as conda does, with `{% set NAME = "VALUE" %}` and `{{ NAME }}`; compilers stay as words."""
    values = dict(re.findall(r'^{% set (\w+) = "([^"]*)" %}\n', text, re.MULTILINE))
    plain = re.sub(r"^{%.*%}\n", "", text, flags=re.MULTILINE)
    plain = re.sub(r'{{ compiler\("(\w+)"\) }}', r"compiler-\1", plain)
    recipe = mapping(re.sub(r"{{ (\w+) }}", lambda name: values.get(name[1], name[0]), plain))
    if missing := {"package", "source", "build", "requirements", "test", "about"} - set(recipe):
        raise ValueError(f"no section {sorted(missing)}")
    for name in ("build", "host", "run"):
        if not all(isinstance(line, str) for line in recipe["requirements"].get(name, [None])):
            raise ValueError(f"requirements/{name} is not a list of packages")
    version = re.search(r"^project\(Sextant VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
    if str(recipe["package"].get("version")) != version:
        raise ValueError(f"version {recipe['package'].get('version')}: CMakeLists.txt has {version}")
    check_bash((ROOT / "scripts" / "recipe" / "build.sh").read_text())


def recipe_problems(text):
    checks = {"yaml": check_jobs, "bash": check_bash, "json": json.loads}
    languages = {language for _, language, _ in blocks(text)}
    for line, language, content in blocks(text):
        if language in checks:
            yield from (f"line {line}: {problem}" for problem in problems_of(checks[language], content))
    if missing := checks.keys() - languages:
        yield f"no recipe in {sorted(missing)}"


def self_test():
    def is_found(check, *texts):
        return all(problems_of(check, text) for text in texts)

    assert is_found(check_jobs, "a: [", "jobs: {a: {steps: []}}", "jobs: {a: {runs-on: x, steps: [{run: a, uses: b}]}}",
                    "a: {script: one}", "a: {scripts: []}")
    meta = (ROOT / "scripts/recipe/meta.yaml").read_text()
    assert is_found(check_conda, "a: [", "package: {}") and "version" in problems_of(check_conda, meta.replace('"0', '"9'))[0]
    assert is_found(check_bash, "if true; then") and is_found(json.loads, "{,}")
    assert list(script_problems("scripts/setup --pyton && scripts/bild")) == ["scripts/setup has no --pyton", "there is no scripts/bild"]


def main():
    if len(sys.argv) > 1:
        print(__doc__)
        return 0 if "--help" in sys.argv else 2
    self_test()
    checks = {"docs/ci.md": recipe_problems, "scripts/recipe/meta.yaml": lambda text: problems_of(check_conda, text)}
    for workflow in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        checks[workflow.relative_to(ROOT).as_posix()] = workflow_problems
    found = [f"{name}: {problem}" for name, check in checks.items() for problem in check((ROOT / name).read_text())]
    return report(found, f"recipes of {', '.join(checks)}: good")


if __name__ == "__main__":
    sys.exit(main())
