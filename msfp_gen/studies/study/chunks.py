"""Chunks of a study and their files: each part is named after a digest of everything that determines its rows."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from msfp_gen.common.identity import fingerprint
from msfp_gen.common.output import clear_all_leftovers, write_bytes
from msfp_gen.errors import InputError
from msfp_gen.jit.cache import digest_sources
from msfp_gen.scene.file.loader import toml_file
from msfp_gen.scene.file.toml_text import dumps
from msfp_gen.studies.study.definition import Study, Task
from msfp_gen.version import __version__

FORMAT = 1  # of the rows of a part
STUDY_FILE = "study.toml"
PARTS = "part-*.parquet"
_NAME = re.compile(r"part-(\d{7})-[0-9a-f]{16}\.parquet")


class Chunks:
    """The chunks of a study and their parts in a folder."""

    def __init__(self, study: Study, folder: Path) -> None:
        self.study = study
        self.folder = folder

    def path(self, task: Task) -> Path:
        """The file of the part of a chunk."""
        total = self._base.copy()
        total.update(f"{task.first} {len(task)}".encode())
        codes = iter(task.codes)
        for digests in self._digests:
            total.update(digests[next(codes)].tobytes() if digests is not None else b"")
        total.update(np.ascontiguousarray(task.drawn, dtype="<f8").tobytes())
        return self.folder / f"part-{task.number:07d}-{total.hexdigest()[:16]}.parquet"

    @cached_property
    def digest(self) -> str:
        """Digest of everything that all rows have in common: scene, quantities, limits and equations."""
        return str(self._base.hexdigest())

    @cached_property
    def _base(self) -> Any:
        study = self.study
        common = {
            "format": FORMAT,
            "version": __version__,
            "equations": digest_sources(),
            "scene": study.recipe.scene,
            "base": study.base,
            "factors": study.recipe.factors,
            "axes": [(axis.name, axis.change, axis.paths, axis.surfaces, axis.random) for axis in study.axes],
            "keep": [study.keep.names, study.keep.formulas, study.keep.surfaces],
            "intensity": study.table.get("records", {}).get("intensity"),
            "run_seconds": study.limits.run_seconds,
        }
        return sha256(fingerprint(common, study.files).encode())

    @cached_property
    def _digests(self) -> list[Any]:
        """Of each grid axis the digests of its values and labels, as an array of 16 bytes each."""
        study, found = self.study, []
        for index, axis in enumerate(study.axes):
            if axis.values is None:
                continue
            each = [
                (study.recipe.records[value] if axis.change == "record" else value, label, study.opened.get((index, k)))
                for k, (value, label) in enumerate(zip(axis.values, axis.labels, strict=True))
            ]
            digests = [bytes.fromhex(fingerprint(value, study.files))[:16] for value in each]
            found.append(np.array(digests, dtype="V16"))
        return found

    @cached_property
    def identity(self) -> str:
        """Digest of everything that any row of the study depends on; that of what workers keep for it."""
        return fingerprint((self.digest, [each.tobytes() for each in self._digests]))

    def open(self) -> None:
        """Write `study.toml`; parts of a last, shorter chunk that the study has outgrown are removed.

        Raises InputError where the folder has parts of another study, or of another version.
        """
        clear_all_leftovers(self.folder, ".parquet")
        present = parts_in(self.folder)
        if present:
            self._check(present)
        about = {
            "runs": self.study.runs,
            "chunk": self.study.chunk,
            "samples": len(self.study.samples),
            "msfp_gen": __version__,
            "digest": self.digest,
        }
        text = dumps({"about": about, **self.study.table, "chunk": self.study.chunk})
        path = self.folder / STUDY_FILE
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            write_bytes(path, [text.encode()])

    def started(self) -> None:
        """Note that runs start now: the time of `study.toml`, from which their rate is counted."""
        os.utime(self.folder / STUDY_FILE)

    def _check(self, present: dict[str, int]) -> None:
        chunks = self.study.chunks
        other = [
            name
            for name, number in present.items()
            if number >= chunks or self.path(self.study.task(number)).name != name
        ]
        before = _about(self.folder)
        old_runs, old_chunk = int(before.get("runs", 0)), int(before.get("chunk", 1))
        short = old_runs // old_chunk if old_runs % old_chunk else -1  # the last chunk, unless it was a whole one
        for name in other:
            if present[name] != short or old_runs >= self.study.runs:
                raise InputError(
                    f"output = {str(self.folder)!r}: this folder has parts of another study "
                    f"({self._difference(before)}); give another folder"
                )
        for name in other:
            (self.folder / name).unlink()

    def _difference(self, before: dict[str, Any]) -> str:
        """Where the study in the folder differs."""
        if before.get("msfp_gen", __version__) != __version__:
            return f"computed by msfp-gen {before['msfp_gen']}"
        old = _read(self.folder)
        new = {"about": {}, **self.study.table, "chunk": self.study.chunk}
        return next(
            (f"{key} differs" for key in (*new, *old) if key != "about" and _text(old.get(key)) != _text(new.get(key))),
            "its files or the equations have changed",
        )


def chunks_in(study: Study, folder: Path) -> Chunks:
    """The chunks of a study in a folder: of the size that they have there, unless the study file gives one."""
    size = _about(folder).get("chunk")
    if study.given_chunk is None and isinstance(size, int) and size > 0 and parts_in(folder):
        study = replace(study, given_chunk=size)
    return Chunks(study, folder)


def _text(value: Any) -> str:
    return dumps({"value": value})


def parts_in(folder: Path) -> dict[str, int]:
    """Name -> number of the chunk, of every part in a folder."""
    return {path.name: int(found[1]) for path in folder.glob(PARTS) if (found := _NAME.fullmatch(path.name))}


@contextmanager
def readable_parts(path: Path) -> Iterator[None]:
    """Raise InputError that names a part, or the folder of all, where reading shows that it is damaged."""
    from pyarrow import ArrowException

    try:
        yield
    except (ArrowException, OSError, LookupError, ValueError) as error:
        raise InputError(
            f"{str(path)!r}: a part of the study is damaged ({error}); remove it and run the study again"
        ) from error


def _read(folder: Path) -> dict[str, Any]:
    path = folder / STUDY_FILE
    return toml_file(path) if path.is_file() else {}


def _about(folder: Path) -> dict[str, Any]:
    return dict(_read(folder).get("about", {}))


def study_table(folder: Path) -> dict[str, Any]:
    """The table of `study.toml` in the folder of a study. Raises InputError where there is none."""
    if not (folder / STUDY_FILE).is_file():
        raise InputError(
            f"{str(folder)!r}: no {STUDY_FILE} here; give the folder of a study (`msfp-gen study FILE -o DIR`)"
        )
    try:
        table = toml_file(folder / STUDY_FILE)
        counts = {key: int(table["about"][key]) for key in ("runs", "chunk", "samples")}
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{folder / STUDY_FILE}: not written by msfp-gen ({error}); run the study again") from None
    return {**table, "about": {**table["about"], **counts}}
