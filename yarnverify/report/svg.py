"""Pictures inside a page: an SVG file as an element whose names are its own and whose colours follow the page's theme."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, fromstring, tostring

_THEME = {  # colours of paper and ink in a picture, and the page's names for them
    "#ffffff": "var(--paper)",
    "#000000": "var(--ink)",
    "#1a1a1a": "var(--ink)",
    "#e6e6e6": "var(--grid)",
    "#ebebeb": "var(--grid)",
    "#ededed": "var(--band)",
    "#8c8c8c": "var(--mid)",
    "#b2b2b2": "var(--hatch)",
    "#d9d9d9": "var(--shade)",
}
_COLOUR = re.compile(r"#[0-9a-f]{6}\b")
_DECIMAL = re.compile(r"-?\d+\.\d+")
_TRANSLATION = re.compile(r"translate\([^)]*\)")
_POINT = {"pt": 4 / 3, "px": 1.0, "": 1.0}  # CSS pixels


def inline(text: str, name: str, alt: str) -> str:
    """An SVG file as an element of an HTML page.

    Parameters
    ----------
    text
        The file, as matplotlib writes it.
    name
        Put before every id, since a page has one name space for all its pictures.
    alt
        What the picture shows, for who cannot see it.
    """
    root = fromstring(text)
    for parent in list(root.iter()):
        for child in list(parent):
            if _local(child.tag) in ("metadata", "style"):
                parent.remove(child)
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', text))
    for node in root.iter():
        _adapt(node, name, used)
    wide, unit = re.fullmatch(r"([\d.]+)(\w*)", root.attrib.pop("width")).groups()  # type: ignore[union-attr]
    root.attrib.pop("height")
    root.attrib = {"class": "plot", "role": "img", "aria-label": alt, "viewBox": root.attrib["viewBox"]}
    pixels = f"{float(wide) * _POINT[unit]:.0f}px"
    root.set("style", f"max-width: {pixels}; min-width: min(36rem, {pixels})")  # smaller than that it cannot be read
    return tostring(root, encoding="unicode")


def _local(tag: str) -> str:
    return tag.rpartition("}")[2]


def _adapt(node: Element, name: str, used: set[str]) -> None:
    node.tag = _local(node.tag)
    node.text = (node.text or "").strip() or None
    node.tail = (node.tail or "").strip() or None
    attributes = {_local(key): value for key, value in node.attrib.items()}
    own = attributes.pop("id", None)
    if own in used:
        attributes["id"] = f"{name}-{own}"
    for key, value in attributes.items():
        value = re.sub(r"^#(?=.)", f"#{name}-", value) if key == "href" else value.replace("url(#", f"url(#{name}-")
        if key in ("d", "x", "y"):
            value = " ".join(_DECIMAL.sub(_shorter, value).split())
        elif key == "transform":
            value = _TRANSLATION.sub(lambda found: _DECIMAL.sub(_shorter, found[0]), value)
        elif key in ("style", "fill", "stroke"):  # of a hatched area, colours are attributes
            value = _COLOUR.sub(lambda found: _THEME.get(found[0], f"var(--c{found[0][1:]}, {found[0]})"), value)
        attributes[key] = value
    node.attrib = attributes


def _shorter(found: re.Match[str]) -> str:
    """A hundredth of a point is less than a screen or a printer shows."""
    return f"{float(found[0]):.2f}".rstrip("0").rstrip(".")
