#!/usr/bin/env python3
"""usage: scripts/maintain/check_recipes.py SEXTANT [FILE.md ...]

Checks the recipes that users copy from the documentation (docs/ci.md): every block is well-formed, a GitHub or GitLab job
has all required keys, and SEXTANT knows every flag of `sextant` in them. Without FILEs, two more things are checked. In the
workflows of this repository (.github/workflows), actions are pinned to a commit, and the scripts that steps call exist and know
their flags. The recipe of conda (scripts/recipe) parses, its version is that of CMakeLists.txt, and its build script is
well-formed.

Exit codes: 0 no problem, 1 problems (one line each), 77 skipped: no PyYAML (python3-yaml).
"""

import json
import pathlib
import re
import subprocess
import sys

try:
    import yaml
except ImportError:
    print("no PyYAML (python3-yaml): recipes are not checked")
    sys.exit(77)

from check_docs import ROOT, blocks, flag_problems, report  # noqa: E402  (after what may skip this test)


def bash_problem(script):
    done = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
    return done.stderr.strip() if done.returncode else ""


def github_problem(workflow):
    for name, job in workflow["jobs"].items():
        if "runs-on" not in job:
            return f"job {name}: no runs-on"
        for step in job.get("steps") or [{}]:
            if ("run" in step) == ("uses" in step):
                return f"job {name}: a step has one of 'run' and 'uses'"
            if unknown := set(step) - {"name", "id", "if", "run", "uses", "with", "env"}:
                return f"job {name}: unknown keys {sorted(unknown)}"
            if problem := bash_problem(step.get("run", "")):
                return f"job {name}: {problem}"
    return ""


def gitlab_problem(jobs):
    known = {"image", "variables", "before_script", "script", "artifacts", "allow_failure", "stage", "rules"}
    for name, job in jobs.items():
        if unknown := set(job) - known:
            return f"job {name}: unknown keys {sorted(unknown)}"
        script = job.get("script")
        if not isinstance(script, list) or not all(isinstance(line, str) for line in script):
            return f"job {name}: 'script' is not a list of commands"
        if problem := bash_problem("\n".join(script)):
            return f"job {name}: {problem}"
    return ""


def yaml_mapping(text):
    """Returns the mapping that the text holds and "", or None and the problem."""
    try:
        tree = yaml.safe_load(text)
    except yaml.YAMLError as error:
        return None, str(error)
    return (tree, "") if isinstance(tree, dict) else (None, "not a mapping")


def yaml_problem(text):
    tree, problem = yaml_mapping(text)
    if problem:
        return problem
    return github_problem(tree) if "jobs" in tree else gitlab_problem(tree)


def json_problem(text):
    try:
        json.loads(text)
        return ""
    except ValueError as error:
        return str(error)


PROBLEM = {"yaml": yaml_problem, "bash": bash_problem, "json": json_problem}


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
        for flag in re.findall(r"(?<!\S)--[a-z][\w-]*", rest):
            if not re.search(re.escape(flag) + r"\b", known):
                yield f"scripts/{name} has no {flag}"


def workflow_problems(file):
    """Problems of a workflow of this repository, each with the name of its file."""
    text = file.read_text()
    found = [yaml_problem(text)]
    for name, job in (yaml.safe_load(text)["jobs"] if not found[0] else {}).items():
        include = job.get("strategy", {}).get("matrix", {}).get("include", [{}])
        for step in job["steps"]:
            if "uses" in step and not re.fullmatch(r"[\w.-]+/[\w./-]+@[0-9a-f]{40}", step["uses"]):
                found.append(f"job {name}: {step['uses']}: expected an action pinned to a commit of 40 digits")
            commands = {re.sub(r"\$\{\{ matrix\.(\w+).*?\}\}", lambda key: str(row.get(key[1], "")), step.get("run", ""))
                        for row in include}
            for command in sorted(commands):
                found += [f"job {name}: {problem}" for problem in [bash_problem(command), *script_problems(command)] if problem]
    yield from (f"{file.name}: {problem}" for problem in found if problem)


def conda_problem(text):
    """Reads a recipe as conda does, with `{% set NAME = "VALUE" %}` and `{{ NAME }}`; compilers stay as words."""
    values = dict(re.findall(r'^{% set (\w+) = "([^"]*)" %}\n', text, re.MULTILINE))
    plain = re.sub(r"^{%.*%}\n", "", text, flags=re.MULTILINE)
    plain = re.sub(r'{{ compiler\("(\w+)"\) }}', r"compiler-\1", plain)
    plain = re.sub(r"{{ (\w+) }}", lambda name: values.get(name[1], name[0]), plain)
    recipe, problem = yaml_mapping(plain)
    if problem:
        return problem
    if missing := {"package", "source", "build", "requirements", "test", "about"} - set(recipe):
        return f"no section {sorted(missing)}"
    for name in ("build", "host", "run"):
        if not all(isinstance(line, str) for line in recipe["requirements"].get(name, [None])):
            return f"requirements/{name} is not a list of packages"
    version = re.search(r"^project\(Sextant VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
    if str(recipe["package"].get("version")) != version:
        return f"version {recipe['package'].get('version')}: CMakeLists.txt has {version}"
    return bash_problem((ROOT / "scripts" / "recipe" / "build.sh").read_text())


def problems(sextant, file):
    text = file.read_text()
    languages = set()
    for line, language, content in blocks(text):
        languages.add(language)
        found = [PROBLEM[language](content)] if language in PROBLEM else []
        if language in ("", "bash", "yaml"):
            found += flag_problems(sextant, content)
        yield from (f"{file.name}:{line}: {problem}" for problem in found if problem)
    if missing := {"yaml", "bash", "json"} - languages:
        yield f"{file.name}: no recipe in {sorted(missing)}"


def self_test():
    assert github_problem({"jobs": {"a": {"steps": []}}})
    assert github_problem({"jobs": {"a": {"runs-on": "x", "steps": [{"run": "a", "uses": "b"}]}}})
    assert gitlab_problem({"a": {"script": "one"}}) and gitlab_problem({"a": {"scripts": []}})
    assert conda_problem("a: [") and conda_problem("package: {}") and "version" in conda_problem(
        (ROOT / "scripts/recipe/meta.yaml").read_text().replace('version = "', 'version = "9'))
    assert yaml_problem("a: [") and bash_problem("if true; then") and json_problem("{,}")
    assert list(script_problems("scripts/setup --pyton && scripts/bild")) == ["scripts/setup has no --pyton", "there is no scripts/bild"]


def main():
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) > 1 else 1
    self_test()
    files = [pathlib.Path(name) for name in sys.argv[2:]] or [ROOT / "docs/ci.md"]
    found = [problem for file in files for problem in problems(sys.argv[1], file)]
    if len(sys.argv) == 2:
        workflows = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
        found += [problem for file in workflows for problem in workflow_problems(file)]
        recipe = ROOT / "scripts" / "recipe" / "meta.yaml"
        found += [f"{recipe.name}: {problem}" for problem in [conda_problem(recipe.read_text())] if problem]
        files += [*workflows, recipe]
    return report(found, f"recipes of {', '.join(file.name for file in files)}: good")


if __name__ == "__main__":
    sys.exit(main())
