"""Chromium without a window, through its DevTools protocol: no package is needed."""

from __future__ import annotations

import base64
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

#: The browser, if it is installed and wanted: ``GSO_BROWSER=1 pytest tests/test_page*.py``.
PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")
if not os.environ.get("GSO_BROWSER"):
    PROGRAM = None
_WORDS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"),
    *("--hide-scrollbars", "--no-first-run", "--disable-extensions", "--disable-dev-shm-usage"),
    *("--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0"),
)


class Browser:
    """One page in a browser that nobody sees.

    Attributes
    ----------
    events : list of dict
        What the browser reported: messages on the console, errors, requests.
    """

    def __init__(self, wide: int = 1200, high: int = 900):
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        words = [str(PROGRAM), *_WORDS, f"--user-data-dir={self._folder.name}", "about:blank"]
        self._process = subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._count, self.events = 0, []
        self._connect()
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.resize(wide, high)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()
        self._folder.cleanup()

    def _connect(self) -> None:
        said = Path(self._folder.name) / "DevToolsActivePort"
        end = time.monotonic() + 60
        while not said.exists() or len(said.read_text().split()) < 2:
            if time.monotonic() > end:
                raise TimeoutError("the browser did not start")
            time.sleep(0.05)
        port = int(said.read_text().split()[0])
        with socket.create_connection(("127.0.0.1", port)) as plain:
            plain.sendall(
                b"GET /json/list HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
            )
            body = b""
            while b"\r\n\r\n" not in body or not body.rstrip().endswith(b"]"):
                body += plain.recv(65536)
        pages = json.loads(body.split(b"\r\n\r\n", 1)[1])
        path = urlsplit(next(p for p in pages if p["type"] == "page")["webSocketDebuggerUrl"]).path
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        key = base64.b64encode(os.urandom(16)).decode()
        head = f"GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
        head += f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
        self._socket.sendall((head + "\r\n").encode())
        self._read = self._socket.makefile("rb").read
        answer = b""
        while not answer.endswith(b"\r\n\r\n"):
            answer += self._read(1)

    def call(self, method: str, **parameters: Any) -> Any:
        """Send a command and return its result."""
        self._count += 1
        self._send(json.dumps({"id": self._count, "method": method, "params": parameters}))
        while True:
            message = self._receive()
            if message.get("id") == self._count:
                if "error" in message:
                    raise RuntimeError(message["error"])
                return message["result"]
            self.events.append(message)

    def _send(self, text: str) -> None:
        data, mask = text.encode(), os.urandom(4)
        size = len(data)
        head = bytes([0x81])
        if size < 126:
            head += bytes([0x80 | size])
        else:
            head += bytes([0x80 | 126 if size < 65536 else 0x80 | 127])
            head += size.to_bytes(2 if size < 65536 else 8, "big")
        masked = bytes(b ^ mask[k % 4] for k, b in enumerate(data))
        self._socket.sendall(head + mask + masked)

    def _receive(self) -> Any:
        body, last = b"", False
        while not last:
            first, size = self._read(2)
            last, size = bool(first & 0x80), size & 0x7F
            if size > 125:
                size = int.from_bytes(self._read(2 if size == 126 else 8), "big")
            body += self._read(size)
        return json.loads(body)

    def check(self) -> None:
        """Check that there was no request but for the file, and no error or warning."""
        self.run("1")
        for event in self.events:
            method, more = event["method"], event["params"]
            if method == "Network.requestWillBeSent":
                assert more["request"]["url"].startswith(("file:", "data:")), more
            assert method != "Runtime.exceptionThrown", more
            if method == "Log.entryAdded":
                assert more["entry"]["level"] != "error", more
            if method == "Runtime.consoleAPICalled":
                assert more["type"] not in ("error", "warning", "assert"), more

    def resize(self, wide: int, high: int) -> None:
        """Set the size of the page, in pixels."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=wide,
            height=high,
            deviceScaleFactor=1,
            mobile=False,
        )

    def dark(self, on: bool) -> None:
        """Prefer dark or light colours."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if on else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def open(self, path: Path) -> None:
        """Open a file and wait until it is loaded and its first picture is drawn."""
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.wait("document.readyState === 'complete'")
        # The page unpacks its script.
        self.wait("window.gsoPage")
        self.wait("!window.gsoPage.viewer || window.gsoPage.viewer.visible.size > 0")

    def run(self, script: str) -> Any:
        """Evaluate an expression on the page; promises are waited for."""
        found = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise RuntimeError(found["exceptionDetails"])
        return found["result"].get("value")

    def wait(self, condition: str, seconds: float = 60.0) -> None:
        """Wait until an expression on the page is true."""
        end = time.monotonic() + seconds
        while not self.run(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise TimeoutError(condition)
            time.sleep(0.05)

    def click(self, x: float, y: float) -> None:
        """Click at a place of the window, in pixels."""
        for kind in ("mousePressed", "mouseReleased"):
            place = {"x": x, "y": y, "button": "left", "clickCount": 1}
            self.call("Input.dispatchMouseEvent", type=kind, **place)

    def move(self, x: float, y: float) -> None:
        """Move the pointer to a place of the window, in pixels."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def press(self, key: str) -> None:
        """Press a key, by its name in JavaScript."""
        text = {"text": key} if len(key) == 1 else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def picture(self, whole: bool = False) -> bytes:
        """Return what is seen, or the whole page, as a PNG file."""
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        return base64.b64decode(data["data"])

    def pdf(self) -> bytes:
        """Return the page as it is printed."""
        return base64.b64decode(self.call("Page.printToPDF", preferCSSPageSize=True)["data"])
