"""Files that `msfp-gen export` writes under a prefix: what belongs to the user is never replaced.

`share/msfp/manifest.json` holds the sha256 of every file written. A file that is there and is not as it was written
belongs to the user, and nothing is written then.
"""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from msfp_gen.common.output import write_bytes
from msfp_gen.errors import InputError

MANIFEST = "share/msfp/manifest.json"


@dataclass(frozen=True)
class Link:
    """A symbolic link to a file in the same folder."""

    to: str


Tree = dict[str, bytes | Link]  # path below the prefix -> content


def check_prefix(prefix: Path) -> None:
    """Raise InputError if `prefix` is a file, cannot be written to, or has a damaged manifest."""
    existing = next(path for path in (prefix, *prefix.parents) if path.exists())
    if not existing.is_dir():
        raise InputError(f"--prefix = {str(prefix)!r}: {existing} is a file; give a folder")
    if not os.access(existing, os.W_OK):
        raise InputError(f"--prefix = {str(prefix)!r}: {existing} cannot be written to; give another folder")
    _written(prefix)


def install(tree: Tree, prefix: Path) -> None:
    """Write the files below `prefix`, each in one rename, and delete what only an earlier export wrote.

    Raises InputError, and writes nothing, where a file of the user has the name of one of them.
    """
    written = _written(prefix)
    digests = {name: _digest_of(content) for name, content in tree.items()}
    for name, digest in digests.items():
        if (present := _digest_at(prefix / name)) is not None and present not in (digest, *written.get(name, ())):
            raise InputError(
                f"--prefix = {str(prefix)!r}: {name} is not as msfp-gen wrote it: move it away or give another folder"
            )
    # While files are replaced the old and the new ones are ours, so that an export that was stopped can be repeated.
    names = sorted({*written, *digests})
    _write_manifest(prefix, {name: [*written.get(name, ()), *filter(None, [digests.get(name)])] for name in names})
    for name, content in tree.items():
        _put(prefix / name, content)
    for name in set(written) - set(tree):
        if _digest_at(prefix / name) in written[name]:
            _remove(prefix, name)
    _write_manifest(prefix, {name: [digest] for name, digest in sorted(digests.items())})


def _written(prefix: Path) -> dict[str, list[str]]:
    """Files that msfp-gen wrote below a prefix, with their digests; of none where there is no manifest."""
    path = prefix / MANIFEST
    try:
        files = dict(json.loads(path.read_text(encoding="utf-8"))["files"])
        if all(_inside(name) and isinstance(digests, list) for name, digests in files.items()):
            return files
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        pass
    raise InputError(
        f"--prefix = {str(prefix)!r}: {MANIFEST} is damaged; give another folder, or delete it with its files"
    )


def _inside(name: str) -> bool:
    """Whether a path of a manifest stays below the prefix."""
    path = Path(name)
    return not path.is_absolute() and ".." not in path.parts


def _write_manifest(prefix: Path, files: dict[str, list[str]]) -> None:
    path = prefix / MANIFEST
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, [json.dumps({"files": files}, indent=1).encode() + b"\n"])


def _digest_of(content: bytes | Link) -> str:
    return f"link to {content.to}" if isinstance(content, Link) else hashlib.sha256(content).hexdigest()


def _digest_at(path: Path) -> str | None:
    """Digest of what lies at a path; None where there is nothing."""
    if path.is_symlink():
        return f"link to {path.readlink()}"
    if not path.exists():
        return None
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "no file"


def _put(path: Path, content: bytes | Link) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(content, bytes):
        write_bytes(path, [content])
    elif _digest_at(path) != _digest_of(content):
        path.unlink(missing_ok=True)
        path.symlink_to(content.to)


def _remove(prefix: Path, name: str) -> None:
    """Delete a file, and the folders that are then empty."""
    (prefix / name).unlink()
    with suppress(OSError):  # not empty
        for parent in Path(name).parents[:-1]:
            (prefix / parent).rmdir()
