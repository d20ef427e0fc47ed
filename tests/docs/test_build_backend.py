"""The build backend: archives do not depend on where and when they were built."""

from __future__ import annotations

import importlib.util
import io
import os
import tarfile
from pathlib import Path
from types import ModuleType
from zipfile import ZipFile, ZipInfo

import pytest
from support import ROOT


@pytest.fixture
def backend() -> ModuleType:
    spec = importlib.util.spec_from_file_location("build_backend", ROOT / "tools" / "build_backend.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_wheel_does_not_depend_on_times_and_permissions(backend: ModuleType, tmp_path: Path) -> None:
    for name, year, mode in (("one", 2001, 0o100600), ("two", 2026, 0o100664)):
        with ZipFile(tmp_path / name, "w") as archive:
            info = ZipInfo("msfp_gen/a.py", (year, 2, 3, 4, 5, 6))
            info.external_attr = mode << 16
            archive.writestr(info, "x = 1\n")
        backend.normal_zip(tmp_path / name, tmp_path / f"{name}.whl", 1_700_000_000)
    assert (tmp_path / "one").read_bytes() != (tmp_path / "two").read_bytes()
    assert (tmp_path / "one.whl").read_bytes() == (tmp_path / "two.whl").read_bytes()
    with ZipFile(tmp_path / "one.whl") as archive:
        assert archive.read("msfp_gen/a.py") == b"x = 1\n"
        assert archive.getinfo("msfp_gen/a.py").date_time == (2023, 11, 14, 22, 13, 20)


def test_an_sdist_does_not_depend_on_times_permissions_and_order(backend: ModuleType, tmp_path: Path) -> None:
    for name, time, mode, uid in (("one", 1.5, 0o600, 0), ("two", 9e8, 0o664, os.getuid() + 1)):
        with tarfile.open(tmp_path / name, "w:gz") as archive:
            for member in ("b.py", "a.py")[:: -1 if uid else 1]:
                info = tarfile.TarInfo(f"p/{member}")
                info.mtime, info.mode, info.uid, info.uname, info.size = time, mode, uid, str(uid), 6
                archive.addfile(info, io.BytesIO(b"x = 1\n"))
        backend.normal_tar(tmp_path / name, tmp_path / f"{name}.tar.gz", 1_700_000_000)
    assert (tmp_path / "one").read_bytes() != (tmp_path / "two").read_bytes()
    assert (tmp_path / "one.tar.gz").read_bytes() == (tmp_path / "two.tar.gz").read_bytes()
    with tarfile.open(tmp_path / "one.tar.gz") as archive:
        assert [(each.name, each.mode, each.mtime) for each in archive] == [
            ("p/a.py", 0o644, 1_700_000_000),
            ("p/b.py", 0o644, 1_700_000_000),
        ]
