"""A headless Chromium that opens one page, driven over its DevTools protocol."""

import base64
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--use-angle=swiftshader",  # WebGL without a GPU
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
)
_CLICK = """(text => {
    const all = [...document.querySelectorAll('label,button,span,p,div')];
    const hit = all.filter(e => e.innerText && e.innerText.trim() === text);
    if (hit.length) hit[hit.length - 1].click();
    return hit.length > 0;
})(%s)"""
_FOCUS = """(text => {
    const after = (a, b) => a.compareDocumentPosition(b) & 4;
    const said = [...document.querySelectorAll('label,span,p,div')]
        .filter(e => e.innerText && e.innerText.trim() === text).pop();
    const sliders = [...document.querySelectorAll('[role=slider]')];
    const hit = said && sliders.find(e => after(said, e));
    if (hit) hit.focus();
    return !!hit && document.activeElement === hit;
})(%s)"""


def browser_path() -> str | None:
    """Returns where a browser is, None if there is none."""
    found = (shutil.which(name) for name in NAMES)
    return next((path for path in found if path), None)


class Tab:
    """One page.

    Args:
        socket: to the page's end of the protocol.

    Attributes:
        errors: uncaught exceptions of the page.
    """

    def __init__(self, socket: Any):
        self._socket, self._count = socket, 0
        self.errors: list[str] = []
        for domain in ("Page", "Runtime"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Calls a method of the protocol and returns its result."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(answer["params"])[:500])
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]

    def value(self, script: str) -> Any:
        """Returns what a script of the page comes to."""
        return self.call("Runtime.evaluate", expression=script)["result"].get("value")

    def text(self) -> str:
        """Returns all text of the page that is to be read."""
        return self.value("document.body ? document.body.innerText : ''")

    def wait_for(self, text: str, seconds: float = 120.0) -> None:
        """Waits until a text is on the page."""
        end = time.monotonic() + seconds
        while text not in self.text():
            assert time.monotonic() < end, f"no {text!r} in: {self.text()}"
            time.sleep(0.2)

    def click(self, text: str) -> None:
        """Clicks the innermost element with exactly this text."""
        assert self.value(_CLICK % json.dumps(text)), f"nothing says {text!r}"

    def slide(self, label: str, key: str, times: int = 1) -> None:
        """Presses a key, such as `ArrowRight`, at the slider after a label."""
        assert self.value(_FOCUS % json.dumps(label)), f"no slider {label!r}"
        for _ in range(times):
            for kind in ("keyDown", "keyUp"):
                self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)

    def picture(self) -> bytes:
        """Returns a picture of the page as PNG."""
        shot = self.call("Page.captureScreenshot", format="png")["data"]
        return base64.b64decode(shot)


@contextmanager
def opened(url: str, size: tuple[int, int] = (1360, 800)) -> Iterator[Tab]:
    """Opens a page; the browser ends with the block.

    Args:
        url: of the page.
        size: of the picture in pixels.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        command = [str(browser_path()), *FLAGS, f"--user-data-dir={home}", url]
        process = subprocess.Popen(
            command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        try:
            with connect(_address(process, url), max_size=None) as socket:
                tab = Tab(socket)
                metrics = {"width": size[0], "height": size[1], "mobile": False}
                metric = "Emulation.setDeviceMetricsOverride"
                tab.call(metric, deviceScaleFactor=1, **metrics)
                yield tab
        finally:
            process.terminate()
            process.wait(20)


def _address(process: subprocess.Popen, url: str) -> str:
    """Returns the websocket of the tab that shows the page."""
    assert process.stderr is not None
    found = next(
        (f for line in process.stderr if (f := re.search(r"ws://(\S+?)/", line))), None
    )
    assert found is not None, "the browser did not start"
    for _ in range(100):
        for tab in json.load(urlopen(f"http://{found[1]}/json")):
            if tab["type"] == "page" and tab["url"].startswith(url):
                return tab["webSocketDebuggerUrl"]
        time.sleep(0.1)
    raise AssertionError(f"the browser does not show {url}")
