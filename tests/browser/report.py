#!/usr/bin/env python3
"""Opens a report of `beamsim report` in headless Chromium and holds what it shows against the history.

    python3 tests/browser/report.py REPORT.html HISTORY.csv [--pictures FOLDER]

Checks that the page loads without a console error or a request to anywhere, draws, plays, scrubs to a time, and shows at
a chosen node exactly the text of history.csv. With --pictures it leaves screenshots at 390, 1280 and 2560 pixels in light
and dark. Needs Chromium and chromedriver (Debian: chromium, chromium-driver) and nothing but Python's standard library;
where they are absent it says `skipped: ...` and exits with 0.
"""

import argparse
import base64
import csv
import json
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

BROWSERS = ["chromium", "chromium-browser", "google-chrome"]
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--disable-dev-shm-usage",
]
# Width, height and pixels a CSS pixel: a phone, a laptop, a large screen.
SIZES = [(390, 844, 2), (1280, 800, 1), (2560, 1440, 1)]


class Browser:
    """One session of chromedriver, over its plain HTTP interface."""

    def __init__(self, browser, driver, folder):
        port = free_port()
        self.address = f"http://127.0.0.1:{port}"
        # Own process, ended by its own handle.
        self.driver = subprocess.Popen(
            [driver, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self.path = ""
        self.wait_for_driver()
        options = {"binary": browser, "args": [*FLAGS, f"--user-data-dir={folder}"]}
        wanted = {
            "browserName": "chrome",
            "goog:chromeOptions": options,
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
            "timeouts": {"script": 300_000, "pageLoad": 300_000},
        }
        session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.path = f"/session/{session['sessionId']}"

    def wait_for_driver(self):
        for _ in range(200):
            try:
                if self.call("GET", "/status")["ready"]:
                    return
            except (urllib.error.URLError, ConnectionError):
                time.sleep(0.1)
        raise RuntimeError("chromedriver does not answer")

    def call(self, method, path, body=None):
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(
            self.address + self.path + path, data=content, method=method, headers={"Content-Type": "application/json"}
        )
        # A proxy of the environment must not come between us and our own driver.
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=600) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise RuntimeError(json.load(error)["value"]["message"]) from None

    def open(self, address):
        self.call("POST", "/url", {"url": address})

    def run(self, script, *arguments):
        return self.call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def devtools(self, command, **parameters):
        return self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def log(self, kind):
        return self.call("POST", "/se/log", {"type": kind})

    def keys(self, selector, text):
        element = self.call("POST", "/element", {"using": "css selector", "value": selector})
        self.call("POST", f"/element/{next(iter(element.values()))}/value", {"text": text})

    def click(self, selector):
        element = self.call("POST", "/element", {"using": "css selector", "value": selector})
        self.call("POST", f"/element/{next(iter(element.values()))}/click", {})

    def screen(self, width, height, ratio, dark):
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.devtools("Emulation.setEmulatedMedia", features=[scheme])
        self.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=width < 600
        )
        self.settle()

    def settle(self):
        """Two animation frames: what was asked for has been drawn."""
        script = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 30)));"
        self.call("POST", "/execute/async", {"script": script, "args": []})

    def picture(self, path, whole):
        shot = self.devtools("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self):
        try:
            if self.path:
                self.call("DELETE", "")
        except (RuntimeError, OSError):
            pass
        self.driver.terminate()
        self.driver.wait(timeout=20)


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def found(names):
    return next((path for path in map(shutil.which, names) if path), None)


def read_history(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def until(condition, seconds, what):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"waited {seconds} s in vain: {what}")


def check(holds, what):
    if not holds:
        raise AssertionError(what)
    print(f"ok: {what}")


# ------------------------------------------------------------------------------------------------ the checks

COLOURS_OF_CANVAS = """
const canvas = document.querySelector("#scene canvas");
const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
copy.drawImage(canvas, 0, 0);
const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
const seen = new Set();
for (let k = 0; k < pixels.length; k += 4) if (pixels[k + 3]) seen.add((pixels[k] << 16) | (pixels[k + 1] << 8) | pixels[k + 2]);
return seen.size;
"""

SUM_OF_CANVAS = """
window.report.draw();
const canvas = document.querySelector("#scene canvas");
const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true });
copy.drawImage(canvas, 0, 0);
const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
let sum = 0;
for (let k = 0; k < pixels.length; k++) sum = (sum * 31 + pixels[k]) % 1000000007;
return sum;
"""

VALUES_SHOWN = """
return [...document.querySelectorAll("#node-values [data-column]")].map((cell) => [cell.dataset.column, cell.textContent, cell.title]);
"""


def has_scene(browser):
    return browser.run("return !document.querySelector('#scene').hidden")


def check_drawing(browser):
    if not has_scene(browser):
        check(browser.run("return !document.querySelector('#no-scene').hidden"), "a report without shapes says so")
        return
    check(browser.run(COLOURS_OF_CANVAS) > 20, "the canvas is not blank")
    browser.run("window.report.goToFrame(0)")
    first = browser.run(SUM_OF_CANVAS)
    browser.run("window.report.view('x')")
    check(browser.run(SUM_OF_CANVAS) != first, "another view draws another picture")
    browser.keys("#scene canvas", "c")
    browser.settle()
    before = browser.run(SUM_OF_CANVAS)
    browser.keys("#scene canvas", "\ue014\ue014")
    browser.settle()
    check(browser.run(SUM_OF_CANVAS) != before, "arrow keys orbit")
    browser.run("window.report.view('fit')")


def check_playing(browser):
    if browser.run("return window.report.frames") < 2:
        return
    browser.run("window.report.goToFrame(0); document.querySelector('#speed').value = '2.5'")
    browser.click("#play")
    until(lambda: browser.run("return window.report.frame") > 0, 20, "play advances the frame")
    print("ok: play advances the frame")
    browser.click("#play")
    stopped = browser.run("return window.report.frame")
    time.sleep(0.3)
    check(browser.run("return window.report.frame") == stopped, "pause stops it")
    browser.run("window.report.goToFrame(0); document.activeElement.blur()")
    browser.keys("body", ".")
    check(browser.run("return window.report.frame") == 1, "the full stop steps on")
    browser.keys("body", ",")
    check(browser.run("return window.report.frame") == 0, "the comma steps back")
    browser.run("document.querySelector('#speed').value = '10'")


def check_scrubbing(browser, names, rows):
    """Asks for a few values of the axis; the row that is shown must be the nearest among the frames."""
    axis = browser.run("return window.report.axis")
    numbers = [float(row[names.index(axis)]) if axis in names else k for k, row in enumerate(rows)]
    if axis == "stages":
        # Load factors from 0 to 1, stage after stage.
        numbers = [float(row[names.index("stage")]) - 1 + float(row[names.index("load")]) for row in rows]
    for share in (0.0, 0.31, 0.5, 0.77, 1.0):
        wanted = numbers[0] + share * (numbers[-1] - numbers[0])
        browser.run("window.report.seek(arguments[0])", wanted)
        shown = browser.run("return {...document.querySelector('#time').dataset}")
        row = int(shown["row"])
        check(shown["time"] == rows[row][names.index("time")], f"{axis} {wanted:g}: the time shown is that of row {row}")
        gap = max(abs(b - a) for a, b in zip(numbers, numbers[1:])) if len(numbers) > 1 else 0
        frames = browser.run("return window.report.frames")
        thinned = max(1, -(-len(numbers) // max(frames, 1)))
        check(abs(numbers[row] - wanted) <= gap * thinned, f"{axis} {wanted:g}: row {row} is near it")
    scrub = "const s = document.querySelector('#scrub'); s.value = arguments[0]; s.dispatchEvent(new Event('input')); return window.report.frame"
    middle = browser.run("return window.report.frames") // 2
    check(browser.run(scrub, middle) == middle, "the slider scrubs")


def check_values(browser, names, rows):
    """Every node in the list, at the first, a middle and the last frame: five digits of the CSV, and its text on hover."""
    nodes = browser.run("return [...document.querySelectorAll('#node-select option')].map((option) => option.value)")
    frames = browser.run("return window.report.frames")
    compared = 0
    for node in nodes[:40]:
        select = "const s = document.querySelector('#node-select'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))"
        browser.run(select, node)
        for frame in sorted({0, frames // 3, frames - 1}):
            browser.run("window.report.goToFrame(arguments[0])", frame)
            row = browser.run("return window.report.row")
            for column, text, whole in browser.run(VALUES_SHOWN):
                stored = rows[row][names.index(column)]
                if whole != stored or abs(float(text) - float(stored)) > 0.5001e-4 * abs(float(stored)):
                    raise AssertionError(f"{column} in row {row}: shown {text} ({whole}), stored {stored}")
                compared += 1
    check(compared > 0, f"{compared} values shown are those of the CSV")
    beside = [node for node in nodes if node in ("", "energy", "momentum")]
    check(not beside, f"the list of nodes holds nodes {beside or ''}".strip())


def check_plots(browser):
    """Displacements of what moves come first; texts of ticks are their values."""
    plots = browser.run("return window.report.plots")
    ticks = [tick for plot in plots for tick in plot["ticks"]]
    wrong = [tick for tick in ticks if float(tick["text"]) != tick["value"]]
    check(plots and len(ticks) > 3 and not wrong, f"{len(ticks)} ticks stand where their texts say {wrong or ''}".strip())
    axes = browser.run("return [...document.querySelectorAll('#axis option')].map((option) => option.textContent)")
    for k in range(len(axes)):
        choose = "const s = document.querySelector('#axis'); s.value = arguments[0]; s.dispatchEvent(new Event('change')); return window.report.plots"
        ticks = [tick for plot in browser.run(choose, k) for tick in plot["ticks"]]
        check(all(float(tick["text"]) == tick["value"] for tick in ticks), f"so they do over {axes[k]}")
    browser.run(choose, 0)
    print("ok: plots " + "; ".join(plot["title"] for plot in plots) + f" over {axes[0]}")


def check_told(browser, expected):
    """Titles of plots and of their horizontal axis, as the caller expects them."""
    plots = browser.run("return window.report.plots")
    told = [plots[0]["axis"]] + [plot["title"] for plot in plots]
    check(told == expected, f"titles {told} are {expected}")


DISTANCE = """
const [a, b] = [arguments[0], arguments[1]].map((name) => window.report.placeOf(name));
return Math.hypot(a[0] - b[0], a[1] - b[1]);
"""

UNDER = "return document.elementFromPoint(arguments[0], arguments[1])?.id === 'scene-canvas'"


def check_choosing(browser):
    """A click on a node chooses it; where two lie on top of each other either may answer."""
    if not has_scene(browser):
        return
    browser.run("window.report.view('corner'); window.report.draw(); scrollTo(0, 0)")
    nodes = "[...document.querySelectorAll('#node-select optgroup:not([label^=Whole]) option')].map((option) => option.value)"
    for name in browser.run(f"return {nodes}")[:8]:
        place = browser.run("return window.report.placeOf(arguments[0])", name)
        left, top = browser.run("const b = document.querySelector('#scene canvas').getBoundingClientRect(); return [b.x, b.y]")
        if len(place) < 2 or not browser.run(UNDER, left + place[0], top + place[1]):
            continue
        for kind in ("mousePressed", "mouseReleased"):
            at = {"x": left + place[0], "y": top + place[1], "button": "left", "clickCount": 1}
            browser.devtools("Input.dispatchMouseEvent", type=kind, **at)
        chosen = browser.run("return window.report.selected")
        check(chosen == name or browser.run(DISTANCE, name, chosen) < 2, f"a click on {name} chooses it")


def check_quiet(browser):
    """No errors on the console, and nothing asked of any network."""
    errors = [entry["message"] for entry in browser.log("browser") if entry["level"] in ("SEVERE", "WARNING")]
    check(not errors, f"the console is quiet {errors or ''}".strip())
    asked = set()
    for entry in browser.log("performance"):
        message = json.loads(entry["message"])["message"]
        request = message["params"] if message["method"] == "Network.requestWillBeSent" else {}
        # The browser's own pages, such as its new tab, are none of ours.
        if request.get("documentURL", "").startswith("file:"):
            asked.add(request["request"]["url"][:60])
    outside = [url for url in asked if not url.startswith(("file:", "data:", "about:"))]
    check(not outside, f"nothing is asked of a network {outside or ''}".strip())


def check_width(browser, width):
    wide = browser.run("return document.documentElement.scrollWidth")
    check(wide <= width, f"nothing to scroll sideways at {width} pixels")


def take_pictures(browser, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for width, height, ratio in SIZES:
        for dark in (False, True):
            browser.screen(width, height, ratio, dark)
            name = f"{width}-{'dark' if dark else 'light'}"
            browser.picture(folder / f"{name}.png", False)
            browser.picture(folder / f"{name}-whole.png", True)
        check_width(browser, width)
    if has_scene(browser):
        browser.screen(1280, 800, 1, False)
        browser.run(EVERYTHING_ON)
        for dark in (False, True):
            browser.screen(1280, 800, 1, dark)
            browser.picture(folder / f"everything-{'dark' if dark else 'light'}.png", False)


EVERYTHING_ON = """
const colour = document.querySelector("#colour");
colour.selectedIndex = colour.options.length - 1;
colour.dispatchEvent(new Event("change"));
const frames = document.querySelector("#show-frames");
if (!frames.checked) frames.click();
"""


def check_warnings(browser, record):
    expected = [warning["message"] for warning in json.loads(record.read_text())["warnings"]]
    told = browser.run("return [...document.querySelectorAll('#warnings li')].map((line) => line.checkVisibility() ? line.textContent : '')")
    check(len(told) == len(expected), f"{len(told)} warnings are shown of {len(expected)}")
    check(all(text.endswith(message) for text, message in zip(told, expected)), "warnings are told as the run told them")


def check_report(browser, report, history, pictures, titles):
    names, rows = read_history(history)
    browser.screen(1280, 800, 1, False)
    browser.open(report.resolve().as_uri())
    until(lambda: browser.run("return !!window.report"), 120, "the report starts")
    browser.settle()
    check_warnings(browser, history.with_name("run.json"))
    if rows:
        check_drawing(browser)
        check_playing(browser)
        check_scrubbing(browser, names, rows)
        check_values(browser, names, rows)
        check_choosing(browser)
        check_plots(browser)
        if titles:
            check_told(browser, titles)
    if pictures:
        browser.open(report.resolve().as_uri())
        until(lambda: browser.run("return !!window.report"), 120, "the report starts again")
        browser.run("window.report.goToFrame(Math.floor((window.report.frames - 1) * 0.62))")
        take_pictures(browser, pictures)
    else:
        for width, height, ratio in SIZES:
            browser.screen(width, height, ratio, False)
            check_width(browser, width)
    check_quiet(browser)


def main():
    parser = argparse.ArgumentParser(description="Tests a report in headless Chromium.")
    parser.add_argument("report", type=pathlib.Path)
    parser.add_argument("history", type=pathlib.Path)
    parser.add_argument("--pictures", type=pathlib.Path, help="a folder for screenshots")
    parser.add_argument("--titles", nargs="+", help="expected titles: of the horizontal axis, then of each plot")
    arguments = parser.parse_args()
    chromium, driver = found(BROWSERS), found(["chromedriver"])
    if not chromium or not driver:
        print("skipped: chromium or chromedriver is not installed")
        return 0
    with tempfile.TemporaryDirectory(prefix="report-browser-", ignore_cleanup_errors=True) as folder:
        browser = Browser(chromium, driver, folder)
        try:
            check_report(browser, arguments.report, arguments.history, arguments.pictures, arguments.titles)
        except AssertionError as failure:
            print(f"failed: {failure}", file=sys.stderr)
            return 1
        finally:
            browser.close()
    print("passed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
