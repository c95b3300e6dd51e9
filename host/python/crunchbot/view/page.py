"""Puts the page together: one file without any address in it, and the headers under which nothing else can run."""

import base64
import hashlib
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "page"
SCRIPTS = (  # in the order they need each other
    *("kit.js", "wire.js", "history.js", "traces.js", "panels.js"),
    *(
        "map.js",
        "plan.js",
        "belief.js",
        "actors.js",
        "timeline.js",
        "words.js",
        "pose.js",
        "player.js",
        "zoom.js",
        "sure.js",
        "controls.js",
        "tour.js",
        "robot.js",
        "parts.js",
        "main.js",
    ),
)


class Page:
    """The bytes of the page, and the security policy that allows just its own script and style."""

    def __init__(self):
        style = (FOLDER / "style.css").read_text()
        script = "'use strict';\n" + "".join((FOLDER / name).read_text() for name in SCRIPTS)
        shell = (FOLDER / "index.html").read_text()
        self.body = shell.replace("{{style}}", style).replace("{{script}}", script).encode()
        self._style, self._script = _digest(style), _digest(script)

    def headers(self, host: str) -> dict[str, str]:
        """Headers of the page, as served under a Host that has been checked."""
        policy = f"default-src 'none'; script-src '{self._script}'; style-src '{self._style}'; img-src data:; "
        policy += f"connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        return HEADERS | {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": policy}


HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
