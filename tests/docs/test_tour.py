"""The functions and files that docs/extending.md names in its tour are where it says."""

from __future__ import annotations

import re

from support import ROOT

PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8").split("\n## A tour")[1].split("\n## ")[0]


def test_every_function_is_in_its_file() -> None:
    links = re.findall(r"\[`(\w+)`\]\(\.\./([^)]+)\)", PAGE)
    assert links
    for name, file in links:
        text = (ROOT / file).read_text(encoding="utf-8")
        assert re.search(rf"^(?:def |[\w ]*\bint ){name}\(", text, re.MULTILINE), f"{name} in {file}"


def test_every_file_and_every_name_exists() -> None:
    """Files in backquotes lie in the package or in the runtime; kernels and functions of C occur there."""
    sources = {path: path.read_text(encoding="utf-8") for path in (ROOT / "msfp_gen" / "runtime").rglob("*.c")}
    for file in re.findall(r"`([\w/.]+\.(?:py|c|jinja))`", PAGE):
        folders = (ROOT, ROOT / "msfp_gen", ROOT / "msfp_gen" / "runtime")
        assert any((folder / file).is_file() for folder in folders), file
    for name in re.findall(r"`(msfp_\w+)`", PAGE):
        assert any(re.search(rf"\b{name}\(", text) for text in sources.values()), name
