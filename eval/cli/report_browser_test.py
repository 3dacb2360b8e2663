#!/usr/bin/env python3
"""Opens the reports of a run, a sweep, a benchmark card and a reproduction in Chromium.

usage: report_browser_test.py SEXTANT [--keep DIR]

At 1400 and 400 px, in either colour scheme, no element is wider than what contains it, and at 1400 px no table has to be
scrolled; the console stays empty. The reproduction has two of its experiments with few seeds. --keep leaves reports and
screenshots there. Exit codes: 0 passed, 1 failed, 77 no browser.
"""

import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "eval/report/html"))
from browser import Browser, browser_test, check_layout, expect, sextant  # noqa: E402

NOISE = {"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}}
PLAN = {"name": "depth", "sources": ["synthetic:s18@0-4"], "estimators": ["joint_flow", "joint_flow_depth"], "seeds": 3,
        "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.4], "base": {"flow": {"epe_px": 0.5}}}}


def make_reports(program, folder):
    """Returns the pages by name."""
    sextant(program, "run", "synthetic:s18", "--noise", json.dumps(NOISE), "--out", folder / "run")
    (folder / "plan.json").write_text(json.dumps(PLAN))
    sextant(program, "sweep", folder / "plan.json", "--out", folder / "sweep")
    sextant(program, "report", folder / "sweep", "--out", folder / "report")
    reproduction = folder / "reproduction"
    for part, plan in (("sets", "reproduce/sets"), ("depth", "depth_s18")):
        small = json.loads((ROOT / f"eval/plans/{plan}.json").read_text())
        small["seeds"] = 2
        (folder / f"{part}.json").write_text(json.dumps(small))
        sextant(program, "sweep", folder / f"{part}.json", "--out", reproduction / "parts" / part)
    (reproduction / "data.json").write_text("[]")
    sextant(program, "reproduce", "--report-only", "--out", reproduction)
    return {"run": folder / "run/report.html", "sweep": folder / "report/report.html",
            "reproduction": reproduction / "report/report.html"}


def check_columns(browser):
    """A sweep's tables show the columns that matter first, and all of them where the reader asks for them."""
    shown = "return [...document.querySelectorAll('#noise_levels thead:first-of-type th')].filter(e => e.offsetWidth > 0).length"
    few = browser.run(shown)
    browser.click("#all-noise_levels")
    expect(browser.run(shown) > few > 5, f"more than {few} columns of noise_levels after a click")


def check(browser, pages, keep):
    for name, page in pages.items():
        check_layout(browser, page, name, keep)
        print(f"{name} report: {page.stat().st_size / 1e6:.2f} MB")
    browser.open(pages["sweep"].as_uri(), 1400, 1000)
    check_columns(browser)


if __name__ == "__main__":
    browser_test(__doc__, Browser, make_reports, check)
