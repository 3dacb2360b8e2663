#!/usr/bin/env python3
"""usage: eval/cli/completion_test.py SEXTANT

Completions of bash, zsh and fish and the man pages, as `sextant completion` and `sextant man` print them: bash and fish are asked
what they offer, zsh reads its script, man formats every page without a warning. A shell that is not installed is skipped with a
message. Exit codes: 0 good, 1 not.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

# Typed text -> words that must be offered, and one that must not.
TYPED = {
    "sextant r": ({"run", "report", "reproduce", "rescore"}, "data"),
    "sextant evaluate e": ({"ego"}, "depth"),
    "sextant evaluate ego --align s": ({"se3", "sim3", "scale"}, "yaw"),
    "sextant run synthetic:s18 --estimator mo": ({"motion_only"}, "joint_flow"),
    "sextant run synthetic:s18 --set pipeline.max_o": ({"pipeline.max_object_distance_m="}, "plan.keep="),
    "sextant run synthetic:s18 --est": ({"--estimator"}, "--out"),
    "sextant sweep st": ({"status"}, "run"),
}
BASH = """source {script}
COMP_LINE='{typed}' COMP_POINT={n}
COMP_WORDBREAKS=$' \\t\\n"><;|&('
_sextant
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def printed(*command, text=None):
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode or done.stderr:
        raise SystemExit(f"{' '.join(command)[:200]}: exit code {done.returncode}: {done.stderr[:500]}")
    return done.stdout


def offered(shell, script, typed):
    if shell == "bash":
        lines = printed("bash", "-c", BASH.format(script=script, typed=typed, n=len(typed)))
    else:
        lines = printed("fish", "--no-config", "-c", f"source {script}; complete -C '{typed}'")
    return {line.split("\t")[0] for line in lines.splitlines()}


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__)
        return 0 if sys.argv[1:] in (["-h"], ["--help"]) else 1
    sextant = sys.argv[1]
    problems = []
    with tempfile.TemporaryDirectory() as folder:
        for shell in ("bash", "zsh", "fish"):
            script = pathlib.Path(folder) / shell
            script.write_text(printed(sextant, "completion", shell))
            if not shutil.which(shell):
                print(f"{shell}: not installed, left out")
                continue
            printed(shell, "-n", str(script))
            if shell == "zsh":
                continue
            for typed, (good, other) in TYPED.items():
                words = offered(shell, script, typed)
                if not good <= words or other in words:
                    problems.append(f"{shell}: `{typed}` offers {sorted(words)}, expected {sorted(good)} and not {other}")
        pages = pathlib.Path(folder) / "pages"
        printed(sextant, "man", "--out", str(pages))
        names = sorted(pages.glob("*.1"))
        if len(names) < 20 or "estimator" not in (pages / "sextant-run.1").read_text():
            problems.append(f"expected a page for each command, got {len(names)}")
        if shutil.which("groff"):
            for page in names:
                done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-z", str(page)], capture_output=True, text=True)
                if done.returncode or done.stderr:
                    problems.append(f"{page.name}: {done.stderr[:300]}")
    print("\n".join(problems) or f"completions and {len(names)} man pages: good")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
