#!/usr/bin/env python3
"""Draws the modules of docs/architecture.md: docs/modules.svg, from the table that check_layers.py checks.

usage: scripts/maintain/draw_modules.py [--check]

Results flow downwards. Three ways run through the modules: that of a measurement, that of the truth, and that of
records; the first two meet in eval/experiment. Every module has its place, and every step of a way is an include that
the table allows: anything else is an error. --check says whether docs/modules.svg is what would be drawn.
Exit codes: 0 drawn or up to date, 1 not up to date or an error.
"""

import argparse
import pathlib
import sys

from check_layers import LAYERS, TRUTH_FREE, matches

FILE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "modules.svg"

# Rows from top to bottom, columns from left to right.
PLACES = [
    ["datasets/codec", "datasets/channels", None, "datasets/synthetic", None],
    [None, None, "datasets", None, None],
    [None, "measurement", None, "truth", "eval/diagnosis"],
    ["estimator/points", "estimator/solvers", "noise", "metrics", "eval/check"],
    ["estimator/start", "estimator/flow_depth", None, None, "eval/profile"],
    ["estimator", "estimator/estimators", "estimator/reference", None, "eval/logs"],
    ["eval/external", "eval/benchmark", "eval/experiment", "eval/evaluation", None],
    ["eval/pictures", "eval/view", "eval/records", "eval/export", None],
    [None, "eval/report", None, "eval/gate", None],
    ["eval/report/figures", "eval/report/tables", "eval/report/claims", "eval/report/html", "eval/report/paper"],
    ["eval/workflow", "eval/reproduce", "eval/python", "eval/cli", "eval/fuzz"],
    ["base", None, "geometry", None, "stats"],
]

# Colours by Okabe and Ito.
WAYS = {
    "a measurement": ("#0072b2", -12, [
        ("datasets/codec", "datasets"), ("datasets/channels", "datasets"), ("datasets/synthetic", "datasets"),
        ("datasets", "measurement"), ("measurement", "estimator/points"), ("measurement", "noise"),
        ("noise", "eval/experiment"), ("estimator/start", "estimator"), ("estimator/estimators", "estimator"),
        ("estimator/solvers", "estimator/flow_depth"), ("estimator/flow_depth", "estimator/estimators"),
        ("estimator/points", "estimator"),
        ("estimator", "eval/experiment"), ("eval/external", "eval/experiment")]),
    "the truth": ("#d55e00", 12, [
        ("datasets", "truth"), ("truth", "metrics"), ("metrics", "eval/experiment"), ("metrics", "eval/evaluation"),
        ("truth", "eval/check"), ("eval/logs", "eval/evaluation")]),
    "records": ("#009e73", 0, [
        ("eval/experiment", "eval/records"), ("eval/evaluation", "eval/records"), ("eval/records", "eval/report"),
        ("eval/records", "eval/gate"), ("eval/records", "eval/export"), ("eval/report", "eval/report/tables"), ("eval/report", "eval/report/figures"),
        ("eval/report/tables", "eval/report/claims"), ("eval/report/tables", "eval/reproduce"),
        ("eval/report/figures", "eval/reproduce"), ("eval/report/claims", "eval/reproduce")]),
}
TINTS = {"lib": "#f3f3f3", "datasets": "#e4eefb", "eval": "#fdf3df"}

BOX = (140, 34)  # px
STEP = (176, 70)
MARGIN = (14, 58)


def fail(message):
    raise SystemExit(f"scripts/maintain/draw_modules.py: {message}")


def top(module):
    head = module.partition("/")[0]
    return head if head in TINTS else "lib"


def places():
    """Room -> centre, and the size of the picture (px)."""
    centres = {module: (MARGIN[0] + round((column + 0.5) * STEP[0]), MARGIN[1] + round((row + 0.5) * STEP[1]))
               for row, modules in enumerate(PLACES) for column, module in enumerate(modules) if module}
    for module in LAYERS.keys() ^ centres.keys():
        fail(f"{module}: " + ("has no place in PLACES" if module in LAYERS else "is no module of check_layers.py"))
    return centres, len(PLACES[0]) * STEP[0] + 2 * MARGIN[0], len(PLACES) * STEP[1] + MARGIN[1]


def curve(a, b, shift):
    """From the edge of box a to that of box b; `shift` keeps the ways apart."""
    (ax, ay), (bx, by) = a, b
    if ay == by:
        side = 1 if ax < bx else -1
        return f"M{ax + side * BOX[0] / 2:g},{ay} L{bx - side * BOX[0] / 2:g},{by}"
    ax, bx, ay, by = ax + shift, bx + shift, ay + BOX[1] / 2, by - BOX[1] / 2
    bend = STEP[1] - BOX[1] if by - ay > STEP[1] else (by - ay) / 2
    return f"M{ax},{ay:g} C{ax},{ay + bend:g} {bx},{by - bend:g} {bx},{by:g}"


def draw():
    centres, width, height = places()
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
           f'height="{height}" font-family="sans-serif" font-size="13">',
           f'<rect width="{width}" height="{height}" fill="white"/>', "<defs>"]
    for k, (colour, _, _) in enumerate(WAYS.values()):
        out.append(f'<marker id="way{k}" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="4.5" markerHeight="4.5" '
                   f'orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="{colour}"/></marker>')
    out.append("</defs>")
    x = MARGIN[0]
    for k, (way, (colour, _, _)) in enumerate(WAYS.items()):
        out.append(f'<path d="M{x},20 h34" stroke="{colour}" stroke-width="2.5" marker-end="url(#way{k})"/>'
                   f'<text x="{x + 42}" y="25">the way of {way}</text>')
        x += 205
    for name, tint in TINTS.items():
        out.append(f'<rect x="{x}" y="11" width="18" height="18" fill="{tint}" stroke="#888"/>'
                   f'<text x="{x + 24}" y="25">{name}</text>')
        x += 88
    out.append(f'<text x="{MARGIN[0]}" y="48" fill="#444">Blue frame: cannot see the truth, not even through other '
               'headers. All modules may include base.</text>')
    for k, (way, (colour, shift, steps)) in enumerate(WAYS.items()):
        for a, b in steps:
            if a not in LAYERS[b] and b not in LAYERS[a]:
                fail(f"way of {way}: neither {a} nor {b} may include the other")
            out.append(f'<path d="{curve(centres[a], centres[b], shift)}" fill="none" stroke="{colour}" '
                       f'stroke-width="2.5" stroke-opacity="0.8" marker-end="url(#way{k})"/>')
    for module, (x, y) in centres.items():
        free = matches(module + "/x", TRUTH_FREE)
        frame = 'stroke="#0072b2" stroke-width="2"' if free else 'stroke="#888"'
        out.append(f'<rect x="{x - BOX[0] / 2:g}" y="{y - BOX[1] / 2:g}" width="{BOX[0]}" height="{BOX[1]}" rx="5" '
                   f'fill="{TINTS[top(module)]}" {frame}/>'
                   f'<text x="{x}" y="{y + 4.5:g}" text-anchor="middle">{module}</text>')
    return "\n".join(out + ["</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing")
    if parser.parse_args().check:
        if FILE.is_file() and FILE.read_text(encoding="utf-8") == draw():
            return 0
        print(f"{FILE}: the modules have changed since it was drawn; run scripts/maintain/draw_modules.py")
        return 1
    partial = FILE.with_suffix(".svg.partial")
    partial.write_text(draw(), encoding="utf-8")
    partial.replace(FILE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
