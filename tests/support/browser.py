"""A headless Chromium, driven over its DevTools protocol."""

import base64
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
)


def browser_path() -> str | None:
    """Where a browser is, None if there is none."""
    found = (shutil.which(name) for name in NAMES)
    return next((path for path in found if path), None)


class Tab:
    """One page of the browser."""

    def __init__(self, socket: Any):
        self._socket, self._count = socket, 0
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params) -> dict:
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(answer["params"])[:500])

    def value(self, script: str) -> Any:
        """What a script of the page comes to."""
        return self.call("Runtime.evaluate", expression=script)["result"].get("value")

    def text(self) -> str:
        return self.value("document.body.innerText")

    def wait_for(self, text: str, seconds: float = 60.0) -> None:
        end = time.monotonic() + seconds
        while text not in self.text():
            assert time.monotonic() < end, f"no {text!r} in: {self.text()}"
            time.sleep(0.2)

    def click(self, text: str) -> None:
        """Clicks the innermost element with this text."""
        script = """(text => {
            const all = [...document.querySelectorAll('label,button,span,p,div')];
            const hit = all.filter(e => e.innerText && e.innerText.trim() === text);
            if (!hit.length) return false;
            hit[hit.length - 1].click();
            return true;
        })(%s)"""
        assert self.value(script % json.dumps(text)), f"nothing says {text!r}"

    def picture(self, path: Path) -> None:
        shot = self.call("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(shot))


@contextmanager
def opened(url: str, size: tuple[int, int] = (1400, 850)) -> Iterator[Tab]:
    """Opens a page; the browser ends with the block."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        window = f"--window-size={size[0]},{size[1]}"
        command = [str(browser_path()), *FLAGS, window, f"--user-data-dir={home}", url]
        process = subprocess.Popen(
            command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        try:
            with connect(_address(process, url), max_size=None) as socket:
                yield Tab(socket)
        finally:
            process.terminate()
            process.wait(20)


def _address(process: subprocess.Popen, url: str) -> str:
    """The websocket of the tab that shows the page."""
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(r"ws://(\S+?)/", line):
            break
    else:
        raise AssertionError("the browser did not start")
    from urllib.request import urlopen

    for _ in range(100):
        tabs = json.load(urlopen(f"http://{found[1]}/json"))
        for tab in tabs:
            if tab["type"] == "page" and tab["url"].startswith(url[:12]):
                return tab["webSocketDebuggerUrl"]
        time.sleep(0.1)
    raise AssertionError(f"no page: {tabs}")
