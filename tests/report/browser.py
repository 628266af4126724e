"""A headless chromium to test pages with, controlled over the DevTools protocol."""

import fcntl
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)


# What plotly draws inside a chart is its own; what stands around it is ours.
AXE = """axe.run({ exclude: [[".main-svg"]] }, { resultTypes: ["violations"] }).then(({ violations }) =>
  violations.flatMap(({ id, nodes }) => nodes.map(({ target }) => `${id}: ${target}`)))"""


class Browser:
    """One tab. `console`: the page's messages. `requests`: the addresses that it requested."""

    def __init__(self, path: str, profile: Path, width: int = 1280, height: int = 900) -> None:
        (read_there, self._write), (self._read, write_there) = os.pipe(), os.pipe()
        own = (f"--user-data-dir={profile}", f"--window-size={width},{height}")

        def connect() -> None:  # the protocol speaks on descriptors 3 and 4
            ends = [fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (read_there, write_there)]
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        self._process = subprocess.Popen(
            [path, *FLAGS, *own, "about:blank"],
            preexec_fn=connect,
            close_fds=False,
            stderr=subprocess.DEVNULL,
        )
        os.close(read_there)
        os.close(write_there)
        self._buffer, self._last, self._session = b"", 0, None
        self.console: list[str] = []
        self.requests: list[str] = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command and return its result. Events that arrive meanwhile are kept."""
        self._last += 1
        message: dict[str, Any] = {"id": self._last, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self._last:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]
            self._keep(answer)

    def open(self, url: str) -> None:
        """Go to a page and wait until it is loaded and all its parts have started."""
        # The same page may be open already, and complete. The mark tells the old document from the new one.
        self.run("globalThis.leaving = true")
        self.send("Page.navigate", url=url)
        loaded = "document.readyState + location.href.startsWith('about:') + !!globalThis.leaving"
        while self.run(loaded) != "completefalsefalse":
            time.sleep(0.05)
        assert self.until("globalThis.Hobble?.ready ?? true", 60), self.console

    def run(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited if it is a promise. Raises if it throws."""
        answer = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, expression: str, seconds: float = 20.0) -> Any:
        """Wait for an expression to become true; returns its last value."""
        end = time.monotonic() + seconds
        while not (value := self.run(expression)) and time.monotonic() < end:
            time.sleep(0.05)
        return value

    def press(self, key: str, code: str | None = None) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            text = {"text": key} if len(key) == 1 and kind == "keyDown" else {}
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=code or key, **text)

    def size(self, width: int, height: int) -> None:
        """Give the window another size."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.send("Emulation.setDeviceMetricsOverride", **metrics)

    def choose(self, what: str, index: int) -> None:
        """Pick an option of the <select> with the id `what`."""
        self.run(
            f"(() => {{ const s = document.getElementById('{what}'); s.selectedIndex = {index};"
            " s.dispatchEvent(new Event('change', { bubbles: true })); })()"
        )

    @property
    def fetched(self) -> list[str]:
        """The addresses that the page requested from elsewhere."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:", "about:"))]

    def violations(self, modules: Path) -> list[str]:
        """What axe finds wrong with the page as it is now. modules: the folder of the npm packages."""
        if self.run("!globalThis.axe"):
            self.run((modules / "axe-core" / "axe.min.js").read_text(encoding="utf-8") + "; 0")
        return self.run(AXE)

    def close(self) -> None:
        """End the browser."""
        os.close(self._write)
        os.close(self._read)
        self._process.terminate()
        self._process.wait(timeout=20)

    def _receive(self, seconds: float = 120.0) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], seconds)
            chunk = os.read(self._read, 1 << 20) if ready else b""
            if not chunk:
                raise TimeoutError("the browser does not answer")
            self._buffer += chunk
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def _keep(self, event: dict[str, Any]) -> None:
        method, values = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled":
            self.console.append(" ".join(str(a.get("value", a.get("description"))) for a in values["args"]))
        elif method == "Runtime.exceptionThrown":
            self.console.append(str(values["exceptionDetails"]))
        elif method == "Log.entryAdded":
            self.console.append(values["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(values["request"]["url"])


def opened(page: str, folder: Path) -> Iterator[Browser]:
    """A browser that has opened the page, for a fixture. Without a browser the tests are skipped."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        pytest.skip(f"no browser here ({', '.join(BROWSERS)}): the page was not opened in one")
    (folder / "report.html").write_text(page, encoding="utf-8")
    browser = Browser(path, folder / "profile")
    browser.open((folder / "report.html").as_uri())
    yield browser
    browser.close()
