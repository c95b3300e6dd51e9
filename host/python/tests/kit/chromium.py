"""Headless Chromium, driven over its DevTools protocol: what a person does to a page and sees of it."""

import asyncio
import base64
import json
import os
import shutil
import signal
import tempfile
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from urllib.request import urlopen

from patience import PATIENCE_S
from websockets.asyncio.client import connect

PROGRAM = shutil.which("chromium")
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-port=0",
]
LOOK_S = 0.02


class Browser:
    """One page. `troubles` are errors and refused loads that the page has met, `requests` the addresses it asked for."""

    def __init__(self, socket):
        self._socket, self._id = socket, 0
        self.troubles: list[str] = []
        self.requests: list[str] = []

    async def call(self, method: str, **parameters) -> dict:
        """A DevTools command; its result."""
        self._id += 1
        await self._socket.send(json.dumps({"id": self._id, "method": method, "params": parameters}))
        while True:
            message = json.loads(await asyncio.wait_for(self._socket.recv(), PATIENCE_S))
            if message.get("id") == self._id:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, event: dict) -> None:
        method, reported = event["method"], event.get("params", {})
        if method == "Runtime.exceptionThrown" or "error" in (
            reported.get("entry", {}).get("level"),
            reported.get("type"),
        ):
            self.troubles.append(json.dumps(reported))
        if event["method"] == "Network.requestWillBeSent":
            self.requests.append(event["params"]["request"]["url"])
        if event["method"] == "Network.webSocketCreated":
            self.requests.append(event["params"]["url"])

    async def look(self, url: str, width: int = 1280, height: int = 900) -> None:
        """Open an address in a window of this size."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            await self.call(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        await self.call("Emulation.setDeviceMetricsOverride", **size)
        await self.call("Page.navigate", url=url)
        await self.until("location.href !== 'about:blank' && document.readyState === 'complete'")

    async def eval(self, expression: str):
        """The value of a JavaScript expression, which may be a promise."""
        reported = await self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in reported, reported
        return reported["result"].get("value")

    async def until(self, expression: str):
        """The first value of the expression that is true."""
        async with asyncio.timeout(PATIENCE_S):
            while not (value := await self.eval(expression)):
                await asyncio.sleep(LOOK_S)
        return value

    async def text(self, selector: str) -> str:
        return await self.eval(f"document.querySelector({json.dumps(selector)})?.innerText ?? ''")

    async def click(self, selector: str) -> None:
        await self.eval(f"document.querySelector({json.dumps(selector)}).click()")

    async def press(self, key: str, code: str | None = None) -> None:
        """One key, with the text it types if it is a character."""
        typed = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            await self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code or key, **typed)

    async def picture(self, path: Path) -> None:
        """A PNG of the window."""
        shot = await self.call("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(shot["data"]))


@asynccontextmanager
async def browser():
    """A Chromium of its own, with an empty profile; gone afterwards."""
    profile = Path(tempfile.mkdtemp(prefix="chromium-"))
    command = [PROGRAM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
    try:
        process = await asyncio.create_subprocess_exec(
            *command, stdout=-3, stderr=-3, start_new_session=True, env=os.environ | {"TMPDIR": str(profile)}
        )
        try:
            address = await _page_address(process, profile / "DevToolsActivePort")
            async with connect(address, max_size=None) as socket:
                yield Browser(socket)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            await process.wait()
    finally:
        await _remove(profile)


async def _remove(folder: Path) -> None:
    """Remove a profile. A browser's processes end one after the other, and until then they write into it."""
    async with asyncio.timeout(PATIENCE_S):
        while folder.exists():
            shutil.rmtree(folder, ignore_errors=True)
            await asyncio.sleep(LOOK_S)


async def _page_address(process, port_file: Path) -> str:
    async with asyncio.timeout(PATIENCE_S):
        while not (port_file.exists() and port_file.read_text().strip()):
            assert process.returncode is None, "chromium did not start"
            await asyncio.sleep(LOOK_S)
        url = f"http://127.0.0.1:{port_file.read_text().split()[0]}/json/list"
        while True:
            pages = [p for p in json.loads(await asyncio.to_thread(_read, url)) if p["type"] == "page"]
            if pages:
                return pages[0]["webSocketDebuggerUrl"]
            await asyncio.sleep(LOOK_S)


def _read(url: str) -> bytes:
    with urlopen(url) as answer:
        return answer.read()
