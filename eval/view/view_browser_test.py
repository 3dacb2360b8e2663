#!/usr/bin/env python3
"""Drives pages of `sextant view` in Chromium and compares what they show with records.jsonl.

usage: view_browser_test.py SEXTANT [--keep DIR]

Makes runs of synthetic scenes, their pages, and goes through them as a reader would: buttons, keys, clicks on
timelines, layers, addresses; one run and two; 1280 and 400 px wide; as one file and as a folder. A page must ask for
nothing beyond its own files and write nothing to the console. --keep leaves runs, pages and screenshots there.
Exit codes: 0 passed, 1 failed, 77 skipped for want of a browser.
"""

import base64
import json
import pathlib
import re
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "report" / "html"))
from browser import Browser, browser_test, expect, expect_equal, overflowing, sextant  # noqa: E402

HOSTILE = "a<script>alert(1)<!-- @DATA@ 'q' \"q\" |$\\input{x}"


class ViewPage(Browser):
    def open(self, url, width=1280, height=1000):
        super().open(url, width, height, "return document.body.dataset.frame !== undefined")
        self.wait("return [...images.values()].some(i => i.ready || i.failed)")

    def where(self):
        return self.run("return [Number(document.body.dataset.frame), document.body.dataset.body]")

    def picture(self):
        """A text that changes with what the image shows."""
        return self.run("return document.getElementById('picture').toDataURL()")


def read_records(run):
    records = {}
    for line in (run / "records.jsonl").read_text().splitlines():
        record = json.loads(line)
        records[record["frame"], record["body"]] = record
    return records


def check_numbers(browser, records, frame, body, run=0):
    """Every number of the table against the record, digit by digit."""
    record = records[frame, body]
    shown = browser.run("return [...document.querySelectorAll('#numbers tr[data-key]')]"
                        ".map(row => [row.dataset.key, row.cells[1 + arguments[0]].title])", run)
    expected = {f"{group}.{key}": value for group in ("errors", "values", "bound") for key, value in
                record.get(group, {}).items()}
    got = {key: float(text) for key, text in shown if text != ""}
    expect_equal(got, expected, f"numbers of frame {frame}, {body}")


def check_one_run(browser, page, run, keep):
    records = read_records(run)
    frames = sorted({frame for frame, _ in records})
    objects = sorted({body for _, body in records} - {"ego"}, key=lambda body: int(body.split(":")[1]))
    browser.open(page.as_uri())
    expect_equal(browser.where(), [frames[0], "ego"], "opens at")
    check_numbers(browser, records, frames[0], "ego")
    if keep:
        browser.screenshot(keep / "one.png")

    # Buttons, slider and keys.
    browser.click("#forth")
    expect_equal(browser.where()[0], frames[1], "button forth")
    browser.run("document.activeElement.blur()")
    browser.keys("\ue014\ue014")  # right, right
    expect_equal(browser.where()[0], frames[3], "right arrow twice")
    browser.keys("\ue010")  # end
    expect_equal(browser.where()[0], frames[-1], "End")
    check_numbers(browser, records, frames[-1], "ego")
    browser.keys("\ue011")  # home
    expect_equal(browser.where()[0], frames[0], "Home")
    browser.keys("2")
    expect_equal(browser.where()[1], objects[0], "key 2")
    check_numbers(browser, records, frames[0], objects[0])
    browser.keys("1")
    expect_equal(browser.where()[1], "ego", "key 1")
    browser.keys("?")
    expect(browser.run("return document.getElementById('help').open"), "key ? opens the list of keys")
    browser.keys("?")
    expect(not browser.run("return document.getElementById('help').open"), "key ? closes it")
    browser.keys(" ")
    browser.wait(f"return Number(document.body.dataset.frame) > {frames[0] + 1}")
    browser.keys(" ")
    stopped = browser.where()[0]
    time.sleep(0.4)
    expect_equal(browser.where()[0], stopped, "space pauses")

    # Clicks on a timeline seek, dragging scrubs, the ribbon chooses a body.
    browser.drag("#timeline-Et_m", [0.999])
    expect_equal(browser.where()[0], frames[-1], "click at the end of a timeline")
    browser.drag("#timeline-ER_deg", [0.9, 0.5, 0.02])
    expect_equal(browser.where()[0], frames[0], "dragging to the start of a timeline")
    row = (1 + 0.5) * 15
    browser.run("const r = document.getElementById('ribbon'); r.setPointerCapture = () => {};"
                "const b = r.getBoundingClientRect();"
                "r.dispatchEvent(new PointerEvent('pointerdown', {bubbles: true, pointerId: 1, buttons: 1,"
                "clientX: b.right - 9, clientY: b.top + arguments[0]}))", row)
    browser.settle()
    expect_equal(browser.where(), [frames[-1], objects[0]], "click on the ribbon")

    # Layers change the image and nothing else.
    for layer in ("masks", "points", "flow", "labels", "refined", "boxes", "axes", "current"):
        before = browser.picture()
        browser.click(f"#layer-{layer}")
        browser.wait("return [...images.values()].every(i => i.ready || i.failed)")
        browser.settle()
        expect(browser.picture() != before, f"layer {layer} changes the image")
        browser.click(f"#layer-{layer}")
        browser.wait("return [...images.values()].every(i => i.ready || i.failed)")
        browser.settle()
        expect_equal(browser.picture(), before, f"layer {layer} there and back")

    # Worst frames.
    browser.run("goTo(FIRST, 'ego')")
    worst = max((f for f in frames if "Et_m" in records[f, "ego"].get("errors", {})),
                key=lambda f: records[f, "ego"]["errors"]["Et_m"])
    expect_equal(browser.run("return Number(document.querySelector('#worst button').dataset.frame)"), worst, "worst frame")
    browser.click("#worst button")
    expect_equal(browser.where()[0], worst, "click on the worst frame")

    # Addresses.
    middle = frames[len(frames) // 2]
    browser.wait(f"return location.hash.startsWith('#frame={worst}&body=ego')")
    browser.open(f"{page.as_uri()}#frame={middle}&body={objects[0]}")
    expect_equal(browser.where(), [middle, objects[0]], "address with frame and body")
    check_numbers(browser, records, middle, objects[0])
    expect(browser.run("return document.querySelectorAll('script').length") == 2, "no script beyond the page's own")


def check_two_runs(browser, page, runs, keep):
    records = [read_records(run) for run in runs]
    frames = sorted({frame for frame, _ in records[0]})
    browser.open(page.as_uri())
    for index in range(2):
        check_numbers(browser, records[index], frames[0], "ego", index)
    both = [f for f in frames if all("Et_m" in r[f, "ego"].get("errors", {}) for r in records)]
    difference = {f: records[1][f, "ego"]["errors"]["Et_m"] - records[0][f, "ego"]["errors"]["Et_m"] for f in both}
    browser.run("const s = document.getElementById('worst-by'); s.value = 'timeline-Et_m-difference';"
                "s.dispatchEvent(new Event('change'))")
    expect_equal(browser.run("return Number(document.querySelector('#worst button').dataset.frame)"),
                 max(both, key=lambda f: abs(difference[f])), "the frame where the runs differ most")
    expect(browser.run("return document.getElementById('timeline-Et_m-difference').hidden") is False,
           "a timeline of the difference")
    if keep:
        browser.screenshot(keep / "two.png")


def check_narrow(browser, page, keep):
    browser.open(page.as_uri(), 400, 900)
    wide = browser.run("return document.documentElement.scrollWidth - document.documentElement.clientWidth")
    expect(wide <= 0, f"at 400 px the page is {wide} px too wide")
    first = browser.where()[0]
    browser.keys("\ue004" * 3)  # tab: by keyboard alone
    focused = browser.run("return document.activeElement.id")
    expect(focused != "", "tab reaches the controls")
    browser.run("document.getElementById('forth').focus()")
    browser.keys("\ue007")  # enter
    expect_equal(browser.where()[0], first + 1, "enter on a button")
    if keep:
        browser.screenshot(keep / "narrow.png")


def check_images_beside(browser, page, folder):
    """The images in frames/, as of a page above 50 MB (view_test checks that it is written so)."""
    head, data, tail = re.split(r'(?<=id="data">)(.*?)(?=</script>)', page.read_text(), maxsplit=1, flags=re.S)
    data = json.loads(data)
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    for frame, source in data["images"].items():
        name = f"frames/{int(frame):06}.jpg"
        (folder / name).write_bytes(base64.b64decode(source.split(",")[1]))
        data["images"][frame] = name
    (folder / "index.html").write_text(head + json.dumps(data).replace("<", "\\u003c") + tail)
    browser.open((folder / "index.html").as_uri())
    browser.wait("return document.querySelector('#image img')?.naturalWidth === D.width")
    browser.click("#forth")
    browser.wait("return document.querySelector('#image img').src.endsWith(D.images[shownImage(state)])")


def check_logs(browser, folder, keep):
    """Logs with their source, without it, and beside a run: no element wider than its container, the same keys."""
    for name, has_picture in (("logs_truth", True), ("logs_alone", False), ("logs_and_run", True)):
        for width in (1400, 400):
            for dark in (False, True):
                browser.dark(dark)
                Browser.open(browser, (folder / f"{name}.html").as_uri(), width, 1000,
                             "return document.body.dataset.frame !== undefined")
                browser.settle()
                expect_equal(overflowing(browser), [], f"{name} at {width} px: elements wider than their containers")
                if keep:
                    browser.screenshot(keep / f"{name}_{width}_{'dark' if dark else 'light'}.png")
        browser.dark(False)
        expect_equal(browser.run("return !document.getElementById('picture-box').hidden"), has_picture, f"{name}: image")
        expect(browser.run("return D.runs.every(run => Object.keys(run.tracks).length > 1)"), f"{name}: paths")
        expect_equal(browser.run("return D.runs.every(run => Object.keys(run.axes).length > 0)"), has_picture, f"{name}: axes")
        first = browser.where()[0]
        browser.run("document.activeElement.blur()")
        browser.keys("\ue014")  # right
        expect_equal(browser.where()[0], first + 1, f"{name}: right arrow")
        expect(not browser.run("return document.getElementById('timeline-Et_m').hidden && state.body !== 'ego'"),
               f"{name}: errors over time")
        cursor, plots = browser.run("return ['.cursor', '.plots'].map(css => { const b = document.querySelector('#timelines'"
                                    " + (css === '.plots' ? '' : ' ' + css)).getBoundingClientRect(); return b.bottom; })")
        expect(cursor <= plots + 1, f"{name}: the line of the cursor ends with the curves")


def scrub(browser, n_frames):
    """Frame after frame as fast as the page draws. Frames per second, the share whose image was there in time, and CPU
    time of the page's own thread in ms a frame: our script, styles and layout, and all of it (with the canvases'
    pixels). The CPU time hardly depends on what else the machine does; the rate does."""
    def metrics():
        read = browser.at("/goog/cdp/execute", {"cmd": "Performance.getMetrics", "params": {}})
        return {metric["name"]: metric["value"] * 1e3 / n_frames for metric in read["metrics"]}

    browser.at("/goog/cdp/execute", {"cmd": "Performance.enable", "params": {"timeDomain": "threadTicks"}})
    before = metrics()
    rate, in_time = browser.at("/execute/async", {"args": [n_frames], "script": """
const [n, done] = arguments, begin = performance.now();
let seen = 0, inTime = 0;
const step = () => {
  if (seen > 0) inTime += images.get(shownImage(state))?.ready === true;
  if (seen === n) { done([n / (performance.now() - begin) * 1000, inTime / n]); return; }
  ++seen;
  goTo(state.frame >= LAST ? FIRST : state.frame + 1);
  requestAnimationFrame(step);
};
requestAnimationFrame(step);"""})
    after = metrics()
    spent = {name: after[name] - before[name] for name in after}
    return {"rate": rate, "in_time": in_time, "script": spent["ScriptDuration"],
            "layout": spent["LayoutDuration"] + spent["RecalcStyleDuration"], "thread": spent["TaskDuration"]}


def make_views(program, folder):
    """Writes the pages into `folder`; returns it, and the folders of the two runs."""
    noise = ["--noise", '{"flow": {"epe_px": 0.5}, "depth": {"delta_d_px": 0.2}}']
    runs = [folder / "joint_flow", folder / HOSTILE]
    sextant(program, "run", "synthetic:s18", "--estimator", "joint_flow", *noise, "--out", runs[0], "--quiet")
    sextant(program, "run", "synthetic:s18", "--estimator", "joint_flow_depth", *noise, "--out", runs[1], "--quiet")
    sextant(program, "view", runs[0], "--out", folder / "one.html", "--quiet")
    sextant(program, "view", *runs, "--out", folder / "two", "--quiet")
    scores = folder / "scores"
    sextant(program, "evaluate", "objects", "--format", "motions", "--truth", "synthetic:s18", runs[0], "--out", scores, "--quiet")
    sextant(program, "view", scores, "--truth", "synthetic:s18", "--out", folder / "logs_truth.html", "--quiet")
    sextant(program, "view", scores, "--out", folder / "logs_alone.html", "--quiet")
    sextant(program, "view", runs[0], scores, "--out", folder / "logs_and_run.html", "--quiet")
    return folder, runs


def check(browser, made, keep):
    folder, runs = made
    check_one_run(browser, folder / "one.html", runs[0], keep)
    check_two_runs(browser, folder / "two" / "index.html", runs, keep)
    check_narrow(browser, folder / "one.html", keep)
    check_images_beside(browser, folder / "one.html", folder / "beside")
    check_logs(browser, folder, keep)
    spent = scrub(browser, 60)
    print(f"scrubbing: {spent['rate']:.0f} frames/s; CPU time a frame of the page's thread {spent['thread']:.1f} ms")


if __name__ == "__main__":
    browser_test(__doc__, ViewPage, make_views, check)
