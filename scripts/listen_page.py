#!/usr/bin/env python3
"""Opens the page of `tapjoint listen --serve` in Chromium while a recording is played, and looks for messages of the browser.

usage: scripts/listen_page.py PROGRAM OUT [--chromium FILE] [--speed X]

Plays recordings/cantilever/low.wav into a copy of its folder, waits for three taps, rejects the second one by the page's own
buttons, and writes OUT/wide.png, OUT/narrow.png (dark) and OUT/ended.png. Prints what the browser says on its console, and
requests that failed. Ends with code 1 if there is any, or if the run does not say what the page did.
Needs playwright (Python) and Chromium.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

SAMPLES = Path(__file__).resolve().parent.parent / "recordings" / "cantilever"
PAGES = {"wide": (1400, 1000, "light"), "narrow": (700, 1000, "dark")}


def watched_page(browser, address, width, height, scheme, messages):
    """Opens the page, and collects what the browser says about it."""
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
    page = context.new_page()
    page.on("console", lambda one: messages.append(f"{one.type}: {one.text}"))
    page.on("pageerror", lambda one: messages.append(f"error: {one}"))
    page.on("requestfailed", lambda one: messages.append(f"failed: {one.url} {one.failure}"))
    page.goto(address)
    return page


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--chromium", default=shutil.which("chromium"), help="the browser; default: that of the path")
    parser.add_argument("--speed", default="2", help="speed of the replay")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    messages = []
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as tools:
        test = Path(folder) / "cantilever"
        shutil.copytree(SAMPLES, test)
        command = [arguments.program.resolve(), "listen", test / "test.toml", "--replay", test / "low.wav"]
        command += ["--speed", arguments.speed, "--serve", "0", "--out", Path(folder) / "report"]
        listening = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
        address = re.search(r"http://\S+", listening.stdout.readline()).group(0)
        browser = tools.chromium.launch(executable_path=arguments.chromium, args=["--no-sandbox", "--disable-gpu"])
        wide, narrow = (watched_page(browser, address, *kind, messages) for kind in PAGES.values())
        wide.wait_for_selector("#taps li:nth-child(3)", timeout=60_000)
        wide.wait_for_selector("#report:not([hidden])", timeout=60_000)
        wide.click("#taps li:nth-child(2) button")
        wide.click("button[data-action=reject]")
        wide.wait_for_selector("#taps li:nth-child(2).rejected", timeout=10_000)
        # The report on the taps that are left comes a little later.
        time.sleep(1.5)
        wide.screenshot(path=arguments.out / "wide.png")
        narrow.screenshot(path=arguments.out / "narrow.png", full_page=True)
        printed = listening.stdout.read()
        code = listening.wait()
        time.sleep(0.5)
        wide.screenshot(path=arguments.out / "ended.png", full_page=True)
        ended = wide.text_content("#advice")
        browser.close()
        described = (test / "test.toml").read_text()
    agrees = code == 0 and "taps that count: 4 of 5" in printed and "reject_taps = [" in described and "has ended" in ended
    print(f"messages of the browser: {len(messages)}")
    print("\n".join(messages))
    print(f"the run agrees with the page: {agrees}")
    return 0 if agrees and not messages else 1


if __name__ == "__main__":
    sys.exit(main())
