"""The worked examples of docs/embedding.md and docs/other-programs.md, one problem, run and print what the pages say.

Those in C and Fortran are files of an exported library (tests/unit/embedding); the example of a unit (FMU) is in
tests/unit/embedding.
"""

from __future__ import annotations

import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT
from support.peers import opensees_runs


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def promised(page: str) -> str:
    """What a page says that its example prints."""
    found = re.search(r"It prints `(.*?)`", (ROOT / "docs" / page).read_text(encoding="utf-8"))
    assert found
    return found[1]


def test_both_pages_promise_the_same() -> None:
    assert promised("embedding.md") == promised("other-programs.md")


def test_the_examples_in_python_run(capsys: pytest.CaptureFixture[str]) -> None:
    code = blocks("embedding.md", "python")
    assert len(code) == 2
    names: dict[str, object] = {}
    for block in code:
        exec(block, names)
    assert capsys.readouterr().out.strip() == promised("embedding.md")


@pytest.mark.skipif(not opensees_runs(), reason="OpenSeesPy cannot be imported")
def test_the_example_in_opensees_runs_with_the_command_that_serves(tmp_path: Path) -> None:
    """At a free port in place of the one of the page."""
    (tmp_path / "bearing.toml").write_text(blocks("other-programs.md", "toml")[0], encoding="utf-8")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    text = (ROOT / "docs" / "other-programs.md").read_text(encoding="utf-8")
    (command,) = re.findall(r"^msfp-gen serve bearing.toml .*$", text, flags=re.MULTILINE)
    arguments = command.replace("7000", str(port)).split()[1:]
    server = subprocess.Popen(
        [sys.executable, "-m", "msfp_gen", *arguments],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert server.stdout
    assert "serving bearing.toml" in server.stdout.readline()
    code = blocks("other-programs.md", "python")[0]
    client = [sys.executable, "-c", code.replace("7000", str(port))]
    done = subprocess.run(client, capture_output=True, text=True, timeout=500)
    assert promised("other-programs.md") in done.stdout.splitlines(), done.stdout + done.stderr
    rest, _ = server.communicate(timeout=60)
    assert server.returncode == 0 and "ended at t = 4 s" in rest
