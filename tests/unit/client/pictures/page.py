# SPDX-License-Identifier: Apache-2.0
"""What a page carries, and what checks.js sees of it in Chromium, where that is installed."""
import base64
import http.server
import json
import pathlib
import queue
import re
import shutil
import subprocess
import threading

import numpy as np
import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
CHECKS = (pathlib.Path(__file__).parent / "checks.js").read_text()
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


def blob(page, name, dtype):
    return np.frombuffer(base64.b64decode(re.search(f'id="{name}">([^<]*)</script>', page).group(1)), dtype)


def scene_of(page):
    return json.loads(re.search(r'id="scene">(.*)</script>', page).group(1))


class Host(http.server.BaseHTTPRequestHandler):
    """Serves `server.page`, and takes what checks.js saw into `server.seen`."""

    def do_GET(self):
        self.send_response(200 if self.path == "/" else 404)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.end_headers()
        self.wfile.write(self.server.page if self.path == "/" else b"")

    def do_POST(self):
        self.server.seen.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


def browse(page, tmp_path, size="1200,800", dark=False):
    """What checks.js saw; with `dark`, where the reader prefers a dark ground."""
    early = "<script>window.pageErrors = []; addEventListener('error', e => pageErrors.push(e.message)); " \
            "console.error = (...words) => pageErrors.push(words.join(' '));</script>"
    text = page.read_text().replace("<head>", "<head>" + early).replace("</body>", f"<script>{CHECKS}</script></body>")
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Host) as server:
        server.page, server.seen = text.encode(), queue.Queue()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = subprocess.Popen(
            [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-sync",
             "--enable-unsafe-swiftshader", "--use-angle=swiftshader", f"--user-data-dir={tmp_path / 'profile'}",
             f"--blink-settings=preferredColorScheme={0 if dark else 1}", f"--window-size={size}", "--remote-debugging-port=0", f"http://127.0.0.1:{server.server_port}/"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return server.seen.get(timeout=240)
        finally:
            browser.terminate()
            browser.wait(30)
            server.shutdown()
