#!/usr/bin/env python3
"""Opens pages of reports in a headless Chromium and checks them: messages of the console, accessibility by axe-core.

    scripts/check_page.py PAGE... [--axe AXE.JS] [--browser PROGRAM]

PAGE is a report.html or sheet.html. AXE.JS is axe.min.js of the package axe-core (`npm pack axe-core`). Each page is checked
light and dark, 1280 and 500 pixels wide. Findings of axe-core count where their impact is serious or critical. Exit
code 1 if there is a message or such a finding.
"""

import argparse
import html
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# Runs when the pictures are drawn, and leaves its findings in the page.
PROBE = """
addEventListener("load", function () {
  setTimeout(function () {
    document.querySelectorAll("details").forEach(function (one) { one.open = true; });
    axe.run(document, { resultTypes: ["violations"] }).then(function (found) {
      var node = document.createElement("pre");
      node.id = "axe-findings";
      node.textContent = JSON.stringify(found.violations.map(function (one) {
        return { id: one.id, impact: one.impact, help: one.help, at: one.nodes.map(function (node) { return node.html.slice(0, 120); }) };
      }));
      document.body.appendChild(node);
    });
  }, 1500);
});
"""


def check(browser, page, axe, width, dark):
    """Messages of the console, and findings of axe-core, of one page."""
    text = Path(page).read_text(encoding="utf-8")
    if axe:
        scripts = f"<script>{axe}</script><script>{PROBE}</script></body>"
        # A page without scripts of its own forbids them.
        text = text.replace("style-src 'unsafe-inline'\"", "style-src 'unsafe-inline'; script-src 'unsafe-inline'\"")
        text = text.replace("</body>", scripts)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "page.html"
        copy.write_text(text, encoding="utf-8")
        command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0"]
        command += [f"--window-size={width},900", "--virtual-time-budget=20000", f"--user-data-dir={folder}/profile"]
        if dark:
            command.append("--blink-settings=preferredColorScheme=0")
        found = subprocess.run([*command, "--dump-dom", copy.as_uri()], capture_output=True, text=True, check=False)
    messages = [line for line in found.stderr.splitlines() if "CONSOLE" in line]
    findings = re.search(r'<pre id="axe-findings">(.*?)</pre>', found.stdout, re.S)
    if axe and not findings:
        messages.append("axe-core has not answered")
    return messages, json.loads(html.unescape(findings.group(1))) if findings else []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", nargs="+", metavar="PAGE")
    parser.add_argument("--axe", type=Path)
    parser.add_argument("--browser", default="chromium")
    given = parser.parse_args()
    axe = given.axe.read_text(encoding="utf-8") if given.axe else None
    bad = 0
    for page in given.pages:
        for width in (1280, 500):
            for dark in (False, True):
                messages, findings = check(given.browser, page, axe, width, dark)
                serious = [one for one in findings if one["impact"] in ("serious", "critical")]
                bad += len(messages) + len(serious)
                print(f"{page}, {width} pixels, {'dark' if dark else 'light'}: {len(messages)} messages, "
                      f"{len(serious)} serious of {len(findings)} findings")
                for message in messages:
                    print(f"  {message}")
                for one in findings:
                    print(f"  {one['impact']}: {one['id']}: {one['help']} ({len(one['at'])} times): {one['at'][0]}")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
