#!/usr/bin/env python3
"""Opens reports of `sextant evaluate` in Chromium and walks through their paths and curves.

usage: evaluate_browser_test.py SEXTANT [--keep DIR]

Writes trajectories (three systems, 4,541 poses) and logs of objects, evaluates them and drives report.html: every
curve has as many points as its CSV, no element is wider than what contains it at 1400 and 400 px in either colour
scheme, the console stays empty, the page is below 3 MB. Prints what the page measures: first drawing, frames a second
while panning. --keep leaves reports and screenshots there. Exit codes: 0 passed, 1 failed, 77 no browser.
"""

import csv
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "report" / "html"))
from browser import Browser, browser_test, check_layout, expect, expect_equal, sextant  # noqa: E402

POSES = 4541
LONG_NAME = "a system with a name of eighty characters & <b> that no column is wide enough for 01"
READY = "return walks.length > 0 && walks[0].box.dataset.firstDrawMs !== undefined"


def write_path(file, scale, drift):
    """KITTI poses of a winding drive, in a world with y down."""
    yaw, x, z, lines = 0.0, 0.0, 0.0, []
    for k in range(POSES):
        c, s = math.cos(yaw), math.sin(yaw)
        lines.append(f"{c:.9e} 0 {s:.9e} {x:.9e} 0 1 0 {drift * k:.9e} {-s:.9e} 0 {c:.9e} {z:.9e}\n")
        x, z = x + scale * s, z + scale * c
        yaw += (0.008 * math.sin(k / 150) + 0.002 * math.cos(k / 37)) * (1 + 3 * drift)
    file.write_text("".join(lines))


def write_logs(folder):
    """Poses of a camera and two objects in the world, and their truth; object 2 has a gap."""
    folder.mkdir()
    for name, speed, side, gap in (("camera", 0.9, 0, ()), ("obj_1", 0.5, 3, ()), ("obj_2", 0.8, -3, range(20, 26))):
        for end, error in (("", 0.02), ("_gt", 0)):
            kind = "" if name == "camera" else "_pose"
            lines = [f"{k} 1 0 0 {side + error * math.sin(0.7 * k):.9f} 0 1 0 0 0 0 1 {12 + speed * (1 + error) * k:.9f}\n"
                     for k in range(60) if end or k not in gap]
            (folder / f"{name}{kind}{end}.txt").write_text("".join(lines))


def rows_of(file):
    with file.open(newline="") as lines:
        return list(csv.DictReader(lines))


def check_ego(browser, out, keep):
    page = out / "report.html"
    size = page.stat().st_size
    expect(size < 3_000_000, f"the page has {size} bytes, expected less than 3 MB")
    browser.open(page.as_uri(), 1400, 1000, READY)
    first_draw = float(browser.run("return walks[0].box.dataset.firstDrawMs"))

    # Every curve has as many points as its CSV has numbers.
    curves = {"reference": rows_of(out / "curves" / "reference.csv")}
    drawn = browser.run("return walks[0].curves.map(c => [c.title, c.drawn])")
    names = browser.run("return [...new Set(walks[0].paths.map(p => p.label))]")
    expect_equal(names, ["reference", "orb", "vdo", LONG_NAME], "series, in the order of the command line")
    files = sorted(path.stem for path in (out / "curves").glob("*.csv"))
    expect_equal(len(files), len(names), "one file for each curve")
    for name in names[1:3]:
        curves[name] = rows_of(out / "curves" / f"{name}.csv")
    columns = ["error", "x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg", "speed"]
    expect_equal(len(drawn), len(columns), "curves")
    for (title, lines), column in zip(drawn, columns):
        for line in lines:
            if line["label"] not in curves:
                continue
            expected = sum(row.get(column, "NaN") not in ("NaN", "") for row in curves[line["label"]])
            expect_equal(line["points"], expected, f"points of {title}, {line['label']}")
            expect(expected >= POSES - 1, f"{column} of {line['label']} has {expected} values")
    expect_equal(int(browser.run("return walks[0].box.dataset.points")), 4 * POSES, "points of the paths")

    # The cursor links path, curves and table.
    browser.run("walks[0].setCursor(1234)")
    browser.settle()
    shown = browser.run("return [...walks[0].table.rows].map(row => [...row.cells].map(cell => cell.textContent))")
    of_orb = next(row for row in shown if row[0] == "orb")
    row = curves["orb"][1234]
    expect_equal(of_orb[1], "1234", "frame of the cursor")
    expect(abs(float(of_orb[2]) - float(row["error"])) < 1e-3, f"error at the cursor: {of_orb[2]}, file {row['error']}")
    before = browser.run("return walks[0].curves.map(c => c.line.style.transform)")
    browser.drag(".curve canvas", [0.5])
    expect(browser.run("return walks[0].curves.map(c => c.line.style.transform)") != before, "a click on a curve moves the cursor")
    browser.run("const b = walks[0].mapCanvas.getBoundingClientRect(), w = walks[0], p = w.paths[1], i = 3000;"
                "w.mapCanvas.dispatchEvent(new PointerEvent('pointermove', {clientX: b.left + w.view.x(p.place[0][i], p.place[1][i]),"
                "clientY: b.top + w.view.y(p.place[0][i], p.place[1][i], p.place[2][i])}))")
    tip = browser.run("return walks[0].tip.hidden ? '' : walks[0].tip.textContent")
    expect("frame" in tip and "APE" in tip, f"hovering over the path shows frame and error: {tip!r}")

    # Series on and off, zoom, turn, colours.
    picture = "return walks[0].mapCanvas.toDataURL()"
    whole = browser.run(picture)
    for css, what in ((".series button:nth-child(2)", "switching a system off"), (".tools button:nth-child(1)", "zooming in"),
                      (".tools button:nth-child(4)", "3-D"), (".tools button:nth-child(5)", "colours by error")):
        last = browser.run(picture)
        browser.click(css)
        expect(browser.run(picture) != last, f"{what} changes the path")
    turned = browser.run("return walks[0].view.azimuth")
    browser.drag(".map", [0.5, 0.6, 0.7])
    expect(browser.run("return walks[0].view.azimuth") != turned, "dragging turns the path")
    if keep:
        browser.screenshot(keep / "ego_turned.png")
    for css in (".series button:nth-child(2)", ".tools button:nth-child(5)", ".tools button:nth-child(3)"):
        browser.click(css)
    expect_equal(browser.run(picture), whole, "the whole path again")
    rate = browser.at("/execute/async", {"args": [60], "script":
                                         "walks[0].measurePanning(arguments[0]).then(arguments[1])"})
    print(f"ego report: {size / 1e6:.2f} MB, first drawn after {first_draw:.0f} ms, panning at {rate:.0f} frames/s")
    check_layout(browser, page, "ego", keep, READY)


def check_objects(browser, out, keep):
    page = out / "report.html"
    browser.open(page.as_uri(), 1400, 1000, READY)
    paths = browser.run("return walks[0].paths.map(p => [p.label, p.is_reference, p.n, [...p.begins].filter(b => b).length])")
    expect_equal(paths, [[label, is_true, n, starts] for label, n_estimated, begins in
                         (("camera", 60, 1), ("object 1", 60, 1), ("object 2", 54, 2))
                         for is_true, n, starts in ((True, 60, 1), (False, n_estimated, begins))], "paths, their poses and gaps")
    states = [(row["object"], row["state"]) for row in rows_of(next((out / "figures").glob("states_*.csv")))]
    expect_equal(states, [("1", "estimated"), ("2", "estimated"), ("2", "gap"), ("2", "estimated")], "states of the steps")
    print(f"object report: {page.stat().st_size / 1e6:.2f} MB")
    check_layout(browser, page, "objects", keep, READY)


def make_reports(program, folder):
    """Returns the folders of the reports: errors of poses, errors of lengths, objects."""
    for name, scale, drift in (("gt", 1.0, 0), ("orb", 1.002, 2e-4), ("vdo", 0.995, -5e-4), ("own", 1.004, 8e-4)):
        write_path(folder / f"{name}.txt", scale, drift)
    systems = (folder / "gt.txt", f"orb={folder / 'orb.txt'}", f"vdo={folder / 'vdo.txt'}", f"{LONG_NAME}={folder / 'own.txt'}")
    sextant(program, "evaluate", "ego", "--format", "kitti", *systems, "--align", "se3", "--rpe", "10m,50m,100m",
            "--out", folder / "ego")
    sextant(program, "evaluate", "ego", "--format", "kitti", *systems, "--align", "se3", "--out", folder / "ape")
    write_logs(folder / "logs")
    sextant(program, "evaluate", "objects", "--format", "poses", folder / "logs", "--out", folder / "objects")
    return folder / "ape", folder / "ego", folder / "objects"


def check(browser, reports, keep):
    poses, lengths, objects = reports
    check_ego(browser, poses, keep)
    check_layout(browser, lengths / "report.html", "lengths", keep, READY)
    check_objects(browser, objects, keep)


if __name__ == "__main__":
    browser_test(__doc__, Browser, make_reports, check)
