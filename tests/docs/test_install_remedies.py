"""What the package says about installing works before it is on PyPI: no command asks for it there."""

from __future__ import annotations

import re

from support import ROOT

FROM_INDEX = re.compile(r"""pip install ["']?(?:-e )?["']?msfp[-_]gen""")
TEXTS = [
    ROOT / "README.md",
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "examples").rglob("*.*"),
    *(ROOT / "tools").glob("*"),
]
SOURCES = [
    *(ROOT / "msfp_gen").rglob("*.py"),
    *(ROOT / "generator").glob("*.py"),
    *(ROOT / "templates").glob("*.jinja"),
]


def test_no_text_installs_the_package_from_an_index() -> None:
    read = {path: path.read_text(encoding="utf-8", errors="replace") for path in (*TEXTS, *SOURCES) if path.is_file()}
    assert len(read) > 200
    assert [str(path) for path, text in read.items() if FROM_INDEX.search(text)] == []
