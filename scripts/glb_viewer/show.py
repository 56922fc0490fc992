"""Shows a .glb file in three.js (npm, MIT) by headless Chromium: bodies at a time of their animation, or a head's
facial actions and joints as a sheet.

    python scripts/glb_viewer/show.py build/glb bodies.glb --seconds 0.5 --picture bodies.png
    python scripts/glb_viewer/show.py build/glb person.glb --bvh person.bvh --seconds 0.5
    python scripts/glb_viewer/show.py build/glb head.glb --head --picture actions.png

The first argument is the folder with node_modules/three. Prints what three.js found; with --bvh also how far apart the
joints of both files are. Fails where nothing is drawn, joints are more than 2 mm apart, or an action or joint of a head
moves nothing that is seen.
"""

from __future__ import annotations

import argparse
import base64
import functools
import html
import http.server
import json
import re
import subprocess
import sys
import tempfile
import threading
import urllib.parse
from pathlib import Path

PAGES = Path(__file__).parent
MAX_APART_M = 0.002
JOINTS, ACTIONS = ["Neck", "Head", "Jaw", "LeftEye", "RightEye"], 52 + 15
CHROMIUM = ("chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--hide-scrollbars", "--virtual-time-budget=20000")  # fmt: skip
# A head looks the same with these: the tongue does not show while the mouth is closed.
MAY_BE_STILL = {"at rest", "viseme_sil", "tongueOut"}


class Files(http.server.SimpleHTTPRequestHandler):
    """Serves the page, the given files and the modules, by their paths in `files`."""

    def __init__(self, *arguments, files: dict[str, Path], **more) -> None:
        self._files = files
        super().__init__(*arguments, **more)

    def translate_path(self, path: str) -> str:
        path = path.partition("?")[0]
        for start, file in self._files.items():
            if path.startswith(start):
                return str(file / path[len(start) :]) if start.endswith("/") else str(file)
        return "/nowhere"

    def log_message(self, *arguments) -> None:
        pass


def chromium(url: str, *options: str) -> str:
    with tempfile.TemporaryDirectory() as profile:
        command = [*CHROMIUM, f"--user-data-dir={profile}", *options, url]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


def facts_of(page: str) -> dict:
    found = re.search(r'<pre id="facts">(.+?)</pre>', page, re.DOTALL)
    return json.loads(html.unescape(found[1])) if found else {"error": "the page did not end"}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", type=Path)
    parser.add_argument("glb", type=Path)
    parser.add_argument("--bvh", type=Path, help="of the same person")
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--head", action="store_true", help="a head with facial actions and joints")
    parser.add_argument("--actions", help="of a head: jawOpen,eyeBlinkLeft+eyeBlinkRight; default: all")
    parser.add_argument("--picture", type=Path, help="PNG")
    options = parser.parse_args()
    page = PAGES / ("head.html" if options.head else "viewer.html")
    files = {"/viewer.html": page, "/given.glb": options.glb, "/modules/": options.modules / "node_modules"}
    if options.bvh:
        files["/given.bvh"] = options.bvh
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, files=files))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    query = f"seconds={options.seconds}" + ("&bvh=1" if options.bvh else "")
    if options.actions:
        query += "&actions=" + urllib.parse.quote(options.actions)
    url = f"http://127.0.0.1:{server.server_port}/viewer.html?{query}"
    facts = facts_of(chromium(url, "--window-size=960,540", "--dump-dom"))
    sheet = base64.b64decode(facts.pop("png", ""))
    print(f"{options.glb}: {json.dumps(facts)}")
    if options.picture and options.head:
        options.picture.write_bytes(sheet)
    elif options.picture:
        chromium(url, "--window-size=960,540", f"--screenshot={options.picture.resolve()}")
    server.shutdown()
    is_right = "error" not in facts and facts["people"] > 0 and facts["draw_calls"] > 0
    if options.head:
        is_right = is_right and facts["has_texture"] and not set(facts["still"]) - MAY_BE_STILL
        is_right = is_right and facts["bones"] == JOINTS and facts["actions"] == ACTIONS
    if options.bvh:
        is_right = is_right and facts["compared"] >= 19 and facts["farthest_m"] <= MAX_APART_M
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
