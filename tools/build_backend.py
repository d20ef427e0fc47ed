"""The build backend: setuptools, whose archives depend on the content of the files and on SOURCE_DATE_EPOCH alone.

Times, permissions and owners of the files of a checkout are those of the machine that made it. The wheel and the sdist
state the time SOURCE_DATE_EPOCH (seconds since 1970; left out: now), permissions 644 or 755, and no owner, so that
anyone can build the bytes that were published and compare.
"""

import gzip
import os
import tarfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403 the hooks that are as those of setuptools

Settings = dict[str, Any] | None


def build_wheel(folder: str, config_settings: Settings = None, metadata_directory: str | None = None) -> str:
    """Write the wheel into a folder; returns its name."""
    name = build_meta.build_wheel(folder, config_settings, metadata_directory)
    rewrite(Path(folder, name), normal_zip)
    return name


def build_sdist(folder: str, config_settings: Settings = None) -> str:
    """Write the sdist into a folder; returns its name."""
    name = build_meta.build_sdist(folder, config_settings)
    rewrite(Path(folder, name), normal_tar)
    return name


def rewrite(path: Path, write: Callable[[Path, Path, int], None]) -> None:
    """Replace an archive by a normal one, with the time of the build."""
    draft = path.with_name(path.name + ".draft")
    write(path, draft, int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))
    draft.replace(path)


def normal_zip(path: Path, target: Path, seconds: int) -> None:
    """Copy a wheel: order and content stay."""
    date = time.gmtime(max(seconds, 315532800))[:6]  # a ZIP begins in 1980
    with ZipFile(path) as source, ZipFile(target, "w", ZIP_DEFLATED) as copy:
        for member in source.infolist():
            info = ZipInfo(member.filename, date)
            info.external_attr = (0o100000 | mode(member.external_attr >> 16)) << 16
            copy.writestr(info, source.read(member), ZIP_DEFLATED)


def normal_tar(path: Path, target: Path, seconds: int) -> None:
    """Copy a sdist: by name, content stays."""
    with (
        tarfile.open(path) as source,
        target.open("wb") as file,
        gzip.GzipFile("", "wb", mtime=seconds, fileobj=file) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as copy,
    ):
        for member in sorted(source.getmembers(), key=lambda each: each.name):
            info = tarfile.TarInfo(member.name)
            info.type, info.size, info.linkname = member.type, member.size, member.linkname
            info.mtime, info.mode = seconds, 0o755 if member.isdir() else mode(member.mode)
            copy.addfile(info, source.extractfile(member) if member.isfile() else None)


def mode(permissions: int) -> int:
    """755 of what its owner may execute, else 644."""
    return 0o755 if permissions & 0o100 else 0o644
