"""Reads a page of knittest report as a browser would, and finds what must not be in it."""

import base64
import math
import re
from pathlib import Path
from urllib.parse import unquote
from xml.etree.ElementTree import Element, fromstring

import html5lib

#: what a browser would fetch or run
FORBIDDEN = ("script", "link", "iframe", "object", "embed", "base", "form", "audio", "video", "source", "svg", "math")
LOADING = ("src", "srcset", "poster", "background", "action", "formaction", "data", "ping", "xlink:href")


class HtmlPage:
    """A parsed page; any error of HTML syntax raises."""

    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self.source = path.read_text(encoding="utf-8")
        self.tree: Element = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(self.source)

    def all(self, *names: str) -> list[Element]:
        return [e for e in self.tree.iter() if e.tag in names]

    def text(self, element: Element | None = None) -> str:
        """Visible words, spaces made single."""
        root = self.tree.find("body") if element is None else element
        assert root is not None
        return " ".join(" ".join(root.itertext()).split())

    def section(self, anchor: str) -> Element:
        (found,) = [e for e in self.all("section") if e.get("id") == anchor]
        return found

    def tables(self, root: Element | None = None) -> dict[str, list[list[str]]]:
        """Rows of cells of every table by its caption."""
        found = {}
        for table in (self.tree if root is None else root).iter("table"):
            caption = table.find("caption")
            assert caption is not None
            found[self.words(caption)] = [
                [self.words(c) for c in row if c.tag in ("td", "th")] for row in table.iter("tr")
            ]
        return found

    def words(self, element: Element) -> str:
        """Text of an element, a ``<wbr>`` being nothing and small print a line of its own."""
        small = [e for e in element if e.tag == "small"]
        main = "".join(element.itertext()).removesuffix("".join(t for e in small for t in e.itertext()))
        return " ".join([*main.split(), *(w for e in small for w in "".join(e.itertext()).split())])

    def numbers(self, root: Element) -> list[float]:
        """Numbers in full behind the texts."""
        return [float(str(e.get("value"))) for e in root.iter("data")]

    def pictures(self) -> list[bytes]:
        """Bytes of every image."""
        return [base64.b64decode(str(e.get("src")).partition("base64,")[2], validate=True) for e in self.all("img")]

    def check(self) -> None:
        """Nothing is fetched or run, all images are inside and are images, all anchors, links and labels hold."""
        assert self.source.lower().startswith("<!doctype html>")
        assert not self.all(*FORBIDDEN)
        ids = [str(e.get("id")) for e in self.tree.iter() if e.get("id")]
        assert len(ids) == len(set(ids))
        for element in self.tree.iter():
            for name, value in element.attrib.items():
                assert not name.lower().startswith("on"), (element.tag, name)
                assert name not in LOADING or (element.tag, name) == ("img", "src"), (element.tag, name, value)
                assert name != "style"
        for anchor in self.all("a"):
            href = str(anchor.get("href"))
            if href.startswith("#"):
                assert href[1:] in ids, href
            elif not href.startswith("data:text/yaml"):
                assert ":" not in href and (self.folder / unquote(href)).exists(), href
        for style in self.all("style"):
            assert not re.search(r"url\(|@import|expression", style.text or "")
        for image, raw in zip(self.all("img"), self.pictures(), strict=True):
            assert str(image.get("src")).startswith(("data:image/webp;base64,", "data:image/svg+xml;base64,"))
            assert image.get("alt")
            if "svg" in str(image.get("src"))[:20]:
                svg = fromstring(raw)
                assert not [e for e in svg.iter() if str(e.tag).endswith(("script", "foreignObject", "image"))]
            else:
                assert raw.startswith(b"RIFF") and raw[8:12] == b"WEBP"
        policy = [m.get("content") for m in self.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
        assert policy == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


def near(value: float, numbers: list[float]) -> bool:
    """Tell whether ``value`` is among ``numbers``."""
    return any(math.isclose(value, n, rel_tol=1e-12) for n in numbers)
