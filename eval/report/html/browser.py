"""A page in Chromium, for tests: speaks WebDriver (W3C) to Debian's chromedriver."""

import argparse
import base64
import contextlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"


def has_browser():
    return bool(shutil.which("chromium") and shutil.which("chromedriver"))


class Browser:
    def __init__(self, driver, watch=True):
        """watch: console and requests are kept for complaints(), which costs the browser time."""
        self.url = driver
        options = {"binary": shutil.which("chromium"), "args": [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-dev-shm-usage",
            "--force-device-scale-factor=1", "--hide-scrollbars"]}
        capabilities = {"browserName": "chrome", "goog:chromeOptions": options,
                        "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"} if watch else {}}
        self.session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})["sessionId"]

    def call(self, method, path, body=None):
        request = urllib.request.Request(self.url + path, method=method, headers={"Content-Type": "application/json"},
                                         data=None if body is None else json.dumps(body).encode())
        try:
            with urllib.request.urlopen(request, timeout=1200) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(f"{method} {path}: {error.read().decode(errors='replace')[:500]}") from None

    def at(self, path, body=None, method="POST"):
        return self.call(method, f"/session/{self.session}{path}", body)

    def open(self, url, width=1280, height=1000, ready="return document.readyState === 'complete'"):
        self.at("/window/rect", {"width": width, "height": height})
        self.at("/url", {"url": "about:blank"})  # otherwise only the fragment of the address would change, without loading the page
        self.at("/url", {"url": url})
        self.wait(ready)

    def dark(self, on):
        """Sets the colour scheme that the page takes for the reader's preference."""
        feature = {"name": "prefers-color-scheme", "value": "dark" if on else "light"}
        self.at("/goog/cdp/execute", {"cmd": "Emulation.setEmulatedMedia", "params": {"features": [feature]}})

    def run(self, script, *arguments):
        return self.at("/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, script, seconds=1200):
        end = time.monotonic() + seconds
        while not self.run(script):
            if time.monotonic() > end:
                raise AssertionError(f"not after {seconds} s: {script}")
            time.sleep(0.05)

    def keys(self, text):
        """Types the text into the element that has the focus."""
        actions = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.at("/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})
        self.settle()

    def drag(self, css, shares):
        """Drags over an element: presses the button at the first of `shares` (of its width), moves to the others, releases."""
        box = self.run("const e = document.querySelector(arguments[0]); e.scrollIntoView({block: 'center'});"
                       "const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]", css)
        steps = []
        for index, share in enumerate(shares):
            steps.append({"type": "pointerMove", "duration": 30, "x": int(box[0] + share * box[2]),
                          "y": int(box[1] + box[3] / 2)})
            if index == 0:
                steps.append({"type": "pointerDown", "button": 0})
        steps.append({"type": "pointerUp", "button": 0})
        self.at("/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": steps}]})
        self.settle()

    def click(self, css):
        self.run("document.querySelector(arguments[0]).scrollIntoView({block: 'center'})", css)
        found = self.at("/element", {"using": "css selector", "value": css})[ELEMENT]
        self.at(f"/element/{found}/click", {})
        self.settle()

    def settle(self):
        self.at("/execute/async", {"script": "const done = arguments[0];"
                                             "requestAnimationFrame(() => requestAnimationFrame(() => done(0)))",
                                   "args": []})

    def complaints(self):
        """Returns the messages of the console, and the addresses that the page requested."""
        console = [entry["message"] for entry in self.at("/se/log", {"type": "browser"})]
        asked = []
        for entry in self.at("/se/log", {"type": "performance"}):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                asked.append(message["params"]["request"]["url"])
        return console, asked

    def screenshot(self, path):
        path.write_bytes(base64.b64decode(self.at("/screenshot", method="GET")))


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


def expect_equal(got, expected, what):
    expect(got == expected, f"{what}: expected {expected!r}, got {got!r}")


def expect_quiet(browser, folder):
    console, asked = browser.complaints()
    expect_equal(console, [], "console")
    own = folder.resolve().as_uri()
    strange = [url[:80] for url in asked if not url.startswith((own, "data:image/", "blob:", "about:", "data:,"))]
    expect_equal(strange, [], "requests beyond the page's own files")


def overflowing(browser):
    """Returns the elements whose content is wider than the element and that do not scroll, and the page if it is wider than
    the window. In a window of 1400 px or more, tables (.scroll) may not scroll either."""
    return browser.run("""
const wide = [...document.querySelectorAll('body *')].filter(e => {
  const style = getComputedStyle(e);
  const scrolls = ['auto', 'scroll'].includes(style.overflowX) && !(innerWidth >= 1400 && e.matches('.scroll'));
  if (e.closest('[hidden]') || style.display === 'inline' || scrolls) return false;
  return e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1;
}).map(e => `${e.tagName}.${e.className}#${e.id}: ${e.scrollWidth} > ${e.clientWidth}`);
const page = document.documentElement;
return page.scrollWidth > page.clientWidth ? [...wide, `page: ${page.scrollWidth} > ${page.clientWidth}`] : wide;""")


def check_layout(browser, page, name, keep, ready="return document.readyState === 'complete'"):
    """Checks at 1400 and 400 px, light and dark, that no content of a page is wider than the element that contains it."""
    for width in (1400, 400):
        for dark in (False, True):
            browser.dark(dark)
            browser.open(page.as_uri(), width, 1000, ready)
            browser.settle()
            expect_equal(overflowing(browser), [], f"{name} at {width} px: elements wider than what contains them")
            if keep:
                browser.screenshot(keep / f"{name}_{width}_{'dark' if dark else 'light'}.png")
    browser.dark(False)


def sextant(program, *arguments, fails=False):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    expect((done.returncode != 0) == fails, f"sextant {' '.join(map(str, arguments))}: exit {done.returncode}\n{done.stderr}")
    return done.stdout + done.stderr


def start_driver():
    driver = subprocess.Popen([shutil.which("chromedriver"), "--port=0"], stdout=subprocess.PIPE, text=True)
    for line in driver.stdout:
        if "started successfully on port " in line:
            port = int(line.split("on port ")[1].strip(" .\n"))
            return driver, f"http://127.0.0.1:{port}"
    raise RuntimeError("chromedriver printed no port")


@contextlib.contextmanager
def browsing(page_type, folder, keep):
    """Context of a browser of type `page_type` for the pages in `folder`. Checks at the end that the console has no messages
    and that the page requested only its own files, and removes the folder unless `keep` is given."""
    driver, url = start_driver()
    try:
        browser = page_type(url)
        yield browser
        expect_quiet(browser, folder)
        browser.at("", method="DELETE")
    finally:
        driver.terminate()
        driver.wait()
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def browser_test(description, page_type, make, check):
    """Runs a test in a browser as a program: arguments SEXTANT [--keep DIR]; exit codes 0 passed, 1 failed, 77 no browser.
    make(program, folder) writes the pages; its result is the argument `made` of check(browser, made, keep)."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sextant")
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    if not has_browser():
        print("skipped: no browser; `scripts/setup --browser` installs Debian's")
        sys.exit(77)
    folder = arguments.keep or pathlib.Path(tempfile.mkdtemp(prefix="sextant_browser_"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        made = make(arguments.sextant, folder)
        with browsing(page_type, folder, arguments.keep) as browser:
            check(browser, made, arguments.keep)
    except AssertionError as failure:
        sys.exit(f"FAILED: {failure}")
    print("passed")
