#!/usr/bin/env python3
"""A benchmark that is killed again and again gives the card of one that runs through.

usage: kill_test.py SEXTANT
"""

import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

SUITE = {
    "name": "small-1", "title": "A small suite for tests", "metric": "Et_m",
    "breakdown": {"error_ratio": 2, "min_coverage": 0.9},
    "tracks": [{
        "name": "depth", "title": "Depth noise", "level": "delta_d [px]", "nominal": 0.2, "quick": [0.2],
        "objects": {"s18": [1]},
        "plans": {"depth": {
            "sources": ["synthetic:s18@0-3"], "seeds": 20,
            "noise": {"parameter": "depth.delta_d_px", "levels": [0.2, 0.8], "base": {"flow": {"epe_px": 0.5}}}}}}],
}


def command(sextant, suite, out):
    return [sextant, "benchmark", "joint_flow", "--suite", suite, "--out", out, "--jobs", "1", "--quiet"]


def run_and_kill(sextant, suite, out):
    """Kills the program whenever its journal has grown; returns how often. The process that is left runs to its end."""
    n_killed = 0
    journal = out / "joint_flow" / "depth" / "journal.jsonl"
    while True:
        begun = journal.stat().st_size if journal.exists() else 0
        process = subprocess.Popen(command(sextant, suite, out), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        while process.poll() is None and n_killed < 5:
            if journal.exists() and journal.stat().st_size > begun:
                process.send_signal(signal.SIGKILL)
                n_killed += 1
                break
        _, error = process.communicate()
        if process.returncode == 0:
            return n_killed
        if process.returncode != -signal.SIGKILL:
            raise RuntimeError(f"exit code {process.returncode}: {error.decode()}")


def card_of(out):
    card = json.loads((out / "joint_flow" / "card.json").read_text())
    del card["costs"]
    return card


def main():
    sextant = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        os.environ["SEXTANT_CACHE"] = str(folder / "cache")
        suite = folder / "small-1.json"
        suite.write_text(json.dumps(SUITE))
        subprocess.run(command(sextant, suite, folder / "whole"), check=True, stdout=subprocess.DEVNULL)
        n_killed = run_and_kill(sextant, suite, folder / "killed")
        if n_killed == 0:
            raise RuntimeError("the program was never killed")
        if card_of(folder / "killed") != card_of(folder / "whole"):
            raise RuntimeError("the card of the killed benchmark differs")
        print(f"killed {n_killed} times, the same card")


if __name__ == "__main__":
    main()
