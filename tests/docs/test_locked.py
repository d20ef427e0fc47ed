"""The locked dependencies of CI are those that pyproject.toml names."""

from __future__ import annotations

import re
import tomllib

from packaging.requirements import Requirement
from support import ROOT

LOCKED = (ROOT / ".ci" / "requirements.txt").read_text(encoding="utf-8")


def test_every_dependency_is_locked_to_a_version_that_is_allowed() -> None:
    versions = dict(re.findall(r"^([\w.-]+)==([\w.]+)", LOCKED, re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = re.findall(r"--extra (\w+)", LOCKED.partition("\n")[2].partition("\n")[0])
    assert {"test", "docs"} <= set(extras)
    lines = [*project["dependencies"], *(line for extra in extras for line in project["optional-dependencies"][extra])]
    wrong = [line for line in lines if versions.get((r := Requirement(line)).name, "0") not in r.specifier]
    assert not wrong, "renew .ci/requirements.txt by the command in its first lines"


def test_every_file_has_a_hash() -> None:
    entries = re.split(r"\n(?=[\w.-]+==)", LOCKED)[1:]
    assert len(entries) > 50 and not [entry.split()[0] for entry in entries if "--hash=sha256:" not in entry]
