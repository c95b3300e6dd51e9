"""Links within built pages: each leads to a file that is there, and to a place in it that is there."""

import json
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links and the places of one page."""

    def __init__(self, path: Path):
        super().__init__()
        self.links: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text())

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        named = dict(attributes)
        self.places.update(filter(None, (named.get("id"), named.get("name") if tag == "a" else None)))
        self.links += [value for key in ("href", "src") if (value := named.get(key))]


def broken(html: Path) -> list[str]:
    """A line for each link that leads nowhere; addresses of other sites are not looked at."""
    pages = {path.resolve(): Page(path) for path in html.rglob("*.html")}
    found = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            if not target.exists():
                found.append(f"{path.relative_to(html.resolve())}: {link}: there is no such file")
            elif place and target in pages and place not in pages[target].places:
                found.append(f"{path.relative_to(html.resolve())}: {link}: there is no such place")
    return sorted(set(found))


def unreached(report: Path) -> list[str]:
    """A line for each address outside that Sphinx's linkcheck, whose output.json this is, did not reach; one line where it
    reached none, for then the pages are not what is wrong."""
    tried = [json.loads(line) for line in report.read_text().splitlines()]
    outside = [one for one in tried if one["uri"].startswith("http")]
    lost = [one for one in outside if one["status"] in ("broken", "timeout")]
    if outside and len(lost) == len(outside):
        return [
            f"handbook: none of {len(outside)} addresses outside is reached; look at the network, or leave out EXTERNAL=1"
        ]
    return sorted({f"{one['filename']}:{one['lineno']}: {one['uri']}: {one['info']}" for one in lost})
