"""A headless Chromium that is driven as a person would: open, ask, click, look."""

from __future__ import annotations

import asyncio
import base64
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from tornado.websocket import WebSocketClientConnection, websocket_connect

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


async def _connected(address: str) -> WebSocketClientConnection:
    return await websocket_connect(address, max_message_size=1 << 28)


class Browser:
    """One tab, by the protocol of the developer tools."""

    def __init__(self, profile: Path, *, width: int = 1000, dark: bool = False) -> None:
        if CHROMIUM is None:
            pytest.skip("needs Chromium")
        self._loop = asyncio.new_event_loop()
        self._process = subprocess.Popen(
            [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
             f"--user-data-dir={profile}", "--remote-debugging-port=0", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        said = profile / "DevToolsActivePort"
        end = time.monotonic() + 60.0
        while not (said.is_file() and said.read_text().count("\n")) and time.monotonic() < end:
            time.sleep(0.1)
        port = said.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=30) as answer:
            tab = next(one for one in json.load(answer) if one["type"] == "page")
        self._numbers = itertools.count(1)
        self._socket = self._loop.run_until_complete(_connected(tab["webSocketDebuggerUrl"]))
        self._loaded = False
        self.tell("Page.enable")
        self.look(width=width, dark=dark)

    def look(self, *, width: int = 1000, dark: bool = False) -> None:
        """How wide the window is, and which colours a person has asked for."""
        scheme = "dark" if dark else "light"
        feature = [{"name": "prefers-color-scheme", "value": scheme}]
        self.tell("Emulation.setEmulatedMedia", features=feature)
        self.tell(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=1200, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip

    def tell(self, method: str, **values: Any) -> dict[str, Any]:
        """One command of the protocol."""
        return self._loop.run_until_complete(self._tell(method, values))

    async def _tell(self, method: str, values: dict[str, Any]) -> dict[str, Any]:
        number = next(self._numbers)
        await self._socket.write_message(
            json.dumps({"id": number, "method": method, "params": values})
        )
        while (answer := await self._heard()).get("id") != number:
            self._loaded |= answer.get("method") == "Page.loadEventFired"
        assert "error" not in answer, answer
        return answer["result"]

    async def _heard(self) -> dict[str, Any]:
        message = await asyncio.wait_for(self._socket.read_message(), 120.0)
        assert message is not None, "the browser has gone"
        return json.loads(message)

    def open(self, address: str) -> None:
        """Go to a page, anew also where only the end of the address differs."""
        for page in ("about:blank", address):
            self._loaded = False
            self.tell("Page.navigate", url=page)
            while not self._loaded:
                heard = self._loop.run_until_complete(self._heard())
                self._loaded = heard.get("method") == "Page.loadEventFired"

    def ask(self, script: str) -> Any:
        """What an expression, or an awaited one, is in the page."""
        answer = self.tell(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, script: str, *, seconds: float = 60.0) -> Any:
        """Wait for an expression to be true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if found := self.ask(script):
                return found
            time.sleep(0.02)
        raise AssertionError(f"never true: {script}\n{self.ask('document.body.innerText')}")

    def picture(self, path: Path) -> None:
        """The whole page as a PNG."""
        height = self.ask("document.documentElement.scrollHeight")
        width = self.ask("innerWidth")
        shot = self.tell(
            "Page.captureScreenshot", captureBeyondViewport=True,
            clip={"x": 0, "y": 0, "width": width, "height": height, "scale": 1},
        )  # fmt: skip
        path.write_bytes(base64.b64decode(shot["data"]))

    def pdf(self) -> bytes:
        """The page as it is printed."""
        return base64.b64decode(self.tell("Page.printToPDF", displayHeaderFooter=False)["data"])

    def close(self) -> None:
        """End it."""

        async def ended() -> None:  # in its own loop: another browser's may be the current one
            self._socket.close()

        self._loop.run_until_complete(ended())
        self._process.terminate()
        self._process.wait(30)
        self._loop.close()
