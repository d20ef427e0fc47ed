"""Groups of an HDF5 file that another person may have made: only data inside the file, of the expected type and size.

HDF5 follows links and external storage to other files, and allocates what a file claims. Here nothing is opened that
lies elsewhere, and no array is read that is larger than its bytes in the file can hold. Damaged bytes are found by the
checksums of HDF5 itself (fletcher32, and those of the description of the file since HDF5 1.8). Texts have a fixed
length: HDF5 loops for ever over some damaged files where it looks for a text of another length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import h5py

EXPANSION = 1100  # bytes of an array over its bytes in the file, at most; deflate reaches 1032
SMALLEST_CHUNK = 2**20  # [bytes]; a chunk, which HDF5 allocates whole, may be larger than a smaller array
CHECKSUM = 4  # [bytes]; of each chunk, at its end
MOST_ATTRIBUTES = 1000  # in the header of a group
Attribute = str | int | float


class StoredGroup:
    """A group of a file. Methods raise ValueError with the reason where its content is not as expected.

    size: of the file [bytes]. turned: names of arrays that are stored with the other sign.
    """

    def __init__(self, group: h5py.Group, size: int, turned: Collection[str] = ()) -> None:
        import h5py

        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name} is a link to another place")
        self._group, self._size, self._turned = group, size, turned

    def __contains__(self, name: str) -> bool:
        return name in self._group

    def group(self, name: str) -> StoredGroup:
        """A group in this one."""
        import h5py

        group = self._group.get(name)
        if not isinstance(group, h5py.Group):
            raise ValueError(f"the group {name} is missing")
        return StoredGroup(group, self._size, self._turned)

    def turning(self, names: Collection[str]) -> StoredGroup:
        """The same group; arrays of these names are read with the other sign."""
        return StoredGroup(self._group, self._size, names)

    def attributes(self, wanted: Callable[[str], bool]) -> dict[str, Attribute]:
        """The attributes with names that are `wanted`, as texts and numbers."""
        return {name: self._attribute(name) for name in self._group.attrs if wanted(name)}

    def rows(self, name: str) -> int:
        """Number of rows of an array."""
        shape = self._dataset(name).shape
        if not shape:
            raise ValueError(f"{name} has no rows")
        return int(shape[0])

    def array(self, name: str, shape: tuple[int, ...], kind: Any = np.float64, compressed: bool = True) -> Any:
        """An array of this shape and type, ndarray. compressed: whether it may be stored so."""
        dataset = self._dataset(name)
        if dataset.shape != shape or dataset.dtype != np.dtype(kind):
            raise ValueError(f"{name} has shape {dataset.shape} and type {dataset.dtype}: expected {shape}")
        self._check_storage(dataset, name, compressed)
        return 0.0 - dataset[()] if name in self._turned else dataset[()]

    def texts(self, name: str, count: int, words: Collection[str]) -> list[str]:
        """A list of texts, each one of `words`, which is stored as characters."""
        shape = self._dataset(name).shape
        if shape[:1] != (count,) or (len(shape) != 2 and count):
            raise ValueError(f"{name} is no list of {count} texts")
        if not count:
            return []
        characters = self.array(name, shape, "S1")
        texts: list[str] = [b"".join(row).decode() for row in characters.tolist()]
        if not set(texts) <= set(words):
            raise ValueError(f"{name} has a word that is none of {', '.join(words)}")
        return texts

    def _dataset(self, name: str) -> h5py.Dataset:
        import h5py

        dataset = self._group.get(name)
        if not isinstance(dataset, h5py.Dataset):
            raise ValueError(f"{name} is missing")
        return dataset

    def _check_storage(self, dataset: h5py.Dataset, name: str, compressed: bool) -> None:
        """Raise ValueError unless the data lies in the file and has the size that its bytes there can have."""
        if dataset.is_virtual or dataset.external:
            raise ValueError(f"{name} lies in another file")
        from h5py import h5z

        known = {h5z.FILTER_FLETCHER32} | ({h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE} if compressed else set())
        properties = dataset.id.get_create_plist()
        filters = [properties.get_filter(index)[0] for index in range(properties.get_nfilters())]
        if len(set(filters)) < len(filters) or not set(filters) <= known:
            raise ValueError(f"{name} is compressed, or in an unknown way")
        stored, size = dataset.id.get_storage_size(), math.prod(dataset.shape) * dataset.dtype.itemsize
        chunk = math.prod(dataset.chunks or (0,)) * dataset.dtype.itemsize
        most = stored * (EXPANSION if h5z.FILTER_DEFLATE in filters else 1)
        if stored > self._size or size > most or chunk > max(size, SMALLEST_CHUNK):
            raise ValueError(f"{name} claims {size} bytes, and the file has {stored} of them")
        if h5z.FILTER_FLETCHER32 in filters:
            self._check_chunks(dataset, name, 1 << filters.index(h5z.FILTER_FLETCHER32))

    def _check_chunks(self, dataset: h5py.Dataset, name: str, checksum: int) -> None:
        """Raise ValueError unless each chunk is there, with its checksum."""
        # The list of chunks has no checksum itself, and HDF5 crashes where a chunk is shorter than its checksum.
        # checksum: the bit of a chunk's filter mask that HDF5 sets where the chunk was written without one.
        found, sizes = set(), list(zip(dataset.shape, dataset.chunks, strict=True))

        def take(chunk: Any) -> bool | None:
            """True, which ends the iteration, for a chunk that is not as expected."""
            placed = all(at < n and at % size == 0 for at, (n, size) in zip(chunk.chunk_offset, sizes, strict=True))
            found.add(chunk.chunk_offset)
            return None if placed and chunk.size > CHECKSUM and not chunk.filter_mask & checksum else True

        if dataset.id.chunk_iter(take) or len(found) < math.prod(-(-n // size) for n, size in sizes):
            raise ValueError(f"{name} has chunks without a checksum, or lacks some")

    def _attribute(self, name: str) -> Attribute:
        import h5py

        stored = self._group.attrs.get_id(name)
        text = h5py.check_string_dtype(stored.dtype)
        if text is not None and text.length is None:  # HDF5 may loop for ever where it reads one
            raise ValueError(f"attribute {name} is a text of variable length, of an older version or another program")
        if stored.shape not in ((), (1,)) or stored.dtype.kind not in "ifS" or stored.get_storage_size() > self._size:
            raise ValueError(f"attribute {name} is no text and no number")
        value = np.asarray(self._group.attrs[name]).item()
        return value.decode() if isinstance(value, bytes) else value  # UnicodeDecodeError is a ValueError


@contextmanager
def file_in_memory() -> Iterator[h5py.File]:
    """A new HDF5 file, in memory: HDF5 crashes instead of raising an error when the disk is full."""
    import h5py
    from h5py import h5f, h5p

    creation, access = h5p.create(h5p.FILE_CREATE), h5p.create(h5p.FILE_ACCESS)
    # Attributes of the root up to 64 kB lie in its header, whose checksum is theirs.
    creation.set_attr_phase_change(MOST_ATTRIBUTES, 0)
    creation.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)  # netCDF-4 asks for this order
    creation.set_attr_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    access.set_libver_bounds(h5f.LIBVER_V18, h5f.LIBVER_V18)  # as netCDF 4; since it, headers have checksums
    access.set_fapl_core(backing_store=False)
    with h5py.File(h5f.create(b"result", h5f.ACC_TRUNC, creation, access)) as file:
        yield file


@contextmanager
def stored_groups(path: Path) -> Iterator[StoredGroup]:
    """The root of an HDF5 file. Raises OSError where the file is none; a wrong checksum does so where it is read."""
    import h5py

    with h5py.File(path, "r") as file, np.errstate(all="ignore"):  # of other programs: numbers may be too large
        yield StoredGroup(file, path.stat().st_size)
