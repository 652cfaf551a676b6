"""The HTML report of the committed records, for the tests that read it and those that open it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from yarnverify.report.html import page

REPORTS = Path(__file__).parent.parent / "reports"


def records() -> dict[str, Any]:
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (REPORTS / "records").glob("*.json")}


def whole_page(found: dict[str, Any] | None = None) -> str:
    pictures = {path.stem: path.read_text(encoding="utf-8") for path in (REPORTS / "pictures").glob("*.svg")}
    return page(records() if found is None else found, pictures)
