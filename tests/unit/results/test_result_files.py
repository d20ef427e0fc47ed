"""Result files that are damaged, or made by somebody else: one InputError, or the very numbers that were written."""

from __future__ import annotations

import json
import random
import shutil
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from support import preset_run, scene_of
from support.damaged_records import cut, flip, remove
from support.damaged_results import forge, virtual

from msfp_gen import InputError, Motion, simulate
from msfp_gen.cli import main
from msfp_gen.results.result import load_result
from msfp_gen.scene.scene_fields import Stop

COUNTS = [40, pytest.param(5000, marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=["recipe", "pieces"])
def saved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a run, whose motion is a table in the scene, or polynomials in a group."""
    result = preset_run("fenz-test2")
    history = result.history
    rows = {name: values[::20] for name, values in history.arrays().items()}
    history = replace(history, **rows, energy={name: values[::20] for name, values in history.energy.items()})
    scene = result.scene
    if request.param == "pieces":
        scene = replace(scene, motion=Motion.harmonic(0.01, 0.1), duration=None)
    path = tmp_path_factory.mktemp("saved") / "run.nc"
    return replace(result, scene=scene, history=history).to_netcdf(path)


@pytest.fixture
def copy(saved: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(saved, tmp_path / "run.nc"))


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_result(path)
    text = str(caught.value)
    assert text.startswith(f"path = '{path}': ") and text.isprintable() and len(text) <= 500
    return text


def noise(content: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(content))
    patch = dice.choice([b"\xff" * 8, b"\0" * 8, b"\xff\xff\xff\x7f", dice.randbytes(dice.randrange(1, 64))])
    return content[:at] + patch + content[at + len(patch) :]


@pytest.mark.parametrize("count", COUNTS)
def test_damage_is_refused_or_does_not_matter(saved: Path, tmp_path: Path, count: int) -> None:
    whole, expected, ends = saved.read_bytes(), load_result(saved), set()
    path = tmp_path / "damaged.nc"
    for seed in range(count):
        dice, content = random.Random(seed), whole
        for _ in range(dice.choice([1, 1, 3, 20])):
            content = dice.choice([flip, flip, cut, remove, noise, noise])(content, dice) if content else content
        path.write_bytes(content)
        try:
            found = load_result(path)
        except InputError:
            ends.add("refused")
        else:
            ends.add("read")
            assert found.dataset.identical(expected.dataset) and found.scene == expected.scene, seed
    assert ends == {"refused", "read"}


@pytest.mark.parametrize("count", [12, pytest.param(2000, marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
def test_forged_content_is_refused_or_is_a_result(copy: Path, saved: Path, tmp_path: Path, count: int) -> None:
    ends = set()
    for seed in range(count):
        shutil.copy(saved, copy)
        done = forge(copy, random.Random(seed))
        try:
            found = load_result(copy)
        except InputError:
            ends.add("refused")
            continue
        ends.add("read")
        assert found.summary and repr(found) and found.dataset and all(note.line for note in found.notes)
        if seed % 25:
            continue
        found.to_netcdf(tmp_path / "again.nc")
        assert load_result(tmp_path / "again.nc").dataset.identical(found.dataset), (seed, done)
    assert ends == {"refused", "read"}


# ---- what such a file could reach


@pytest.mark.parametrize("kind", ["arrays", "record"])
def test_a_result_opens_no_file_of_the_user(kind: str, tmp_path: Path) -> None:
    secret = tmp_path / "secret.csv"
    secret.write_text("time [s], u1 [m]\n" + "".join(f"{0.1 * i}, {1e-4 * i * i}\n" for i in range(60)))
    path = preset_run("fenz-test2").to_netcdf(tmp_path / "run.nc")
    with h5py.File(path, "r+") as file:
        head, _, tail = file.attrs["scene"].decode().partition("[motion]")
        after = tail[tail.index("\n[") :]
        file.attrs["scene"] = np.bytes_(f"{head}[motion]\nkind = {kind!r}\nfile = {str(secret)!r}\n{after}")
    assert "motion.file = " in refusal(path) and "a result opens no other file" in refusal(path)


def test_links_are_refused_wherever_they_lead(copy: Path, tmp_path: Path) -> None:
    shutil.copy(copy, tmp_path / "other.nc")
    for link in (h5py.SoftLink("/time"), h5py.ExternalLink("other.nc", "/gap"), h5py.ExternalLink("/etc/passwd", "/")):
        for name in ("gap", "unknown"):
            with h5py.File(copy, "r+") as file:
                if name in file:
                    del file[name]
                file[name] = link
            assert f"{name} is a link to another place" in refusal(copy)
            with h5py.File(copy, "r+") as file:
                del file[name]


def test_arrays_in_other_files_are_refused(copy: Path, tmp_path: Path) -> None:
    shutil.copy(copy, tmp_path / "other.nc")
    for make in (
        lambda file, shape: file.create_dataset("gap", shape, float, external=[("/dev/zero", 0, h5py.h5f.UNLIMITED)]),
        lambda file, shape: file.create_virtual_dataset("gap", virtual(shape, "gap")),
    ):
        with h5py.File(copy, "r+") as file:
            shape = file["gap"].shape
            del file["gap"]
            make(file, shape)
        assert "gap lies in another file" in refusal(copy)


def bomb(name: str, file: h5py.File) -> None:
    shape = (10**9, *file[name].shape[1:])
    del file[name]
    file.create_dataset(name, shape=shape, dtype=float, chunks=(2**14, *shape[1:]))


def test_nothing_is_allocated_that_the_file_cannot_hold(copy: Path, saved: Path) -> None:
    """Rows that were never written; a time axis of a billion of them; zeros that deflate to a thousandth, twice."""
    for name, words in (("time", "time claims 8000000000 bytes"), ("top_force", "top_force has shape (1000000000, 3)")):
        shutil.copy(saved, copy)
        with h5py.File(copy, "r+") as file:
            bomb(name, file)
        assert words in refusal(copy)
    shutil.copy(saved, copy)
    with h5py.File(copy, "r+") as file:
        values = file["time"][()]
        del file["time"]
        file.create_dataset("time", data=values, compression=9)
    assert "time is compressed, or in an unknown way" in refusal(copy)
    shutil.copy(saved, copy)
    with h5py.File(copy, "r+") as file:
        shape = file["gap"].shape
        del file["gap"]
        file.create_dataset("gap", shape, float, chunks=(2**24, 1), maxshape=(None, None))  # a chunk of 128 MB
    assert "gap claims" in refusal(copy)


def test_a_changed_byte_of_the_rows_is_found_by_hdf5(copy: Path) -> None:
    with h5py.File(copy) as file:
        chunk = file["top_force"].id.get_chunk_info(0)
    content = bytearray(copy.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    copy.write_bytes(content)
    assert "no netCDF-4 file that can be read" in refusal(copy)


def test_all_arrays_have_checksums(copy: Path) -> None:
    """Numbers and characters; a dimension without coordinate, as an object of HDF5, has no values."""

    def without(_: str, item: h5py.Dataset | h5py.Group) -> str | None:
        stored = isinstance(item, h5py.Dataset) and item.id.get_storage_size()
        assert not stored or item.dtype.kind in "ifS"
        return item.name if stored and not item.fletcher32 else None

    with h5py.File(copy) as file:
        assert file["time"].fletcher32 and file["axis"].fletcher32 and file.visititems(without) is None


def test_a_changed_byte_of_a_text_is_found_by_hdf5(copy: Path) -> None:
    whole = copy.read_bytes()
    for word in (b'name = "fenz-test2"', b'{"displacement": ['):
        content = bytearray(whole)
        content[content.index(word) + 9] ^= 1
        copy.write_bytes(content)
        assert "incorrect metadata checksum" in refusal(copy)


def test_texts_of_variable_length_are_refused(copy: Path) -> None:
    """HDF5 may loop for ever over damaged ones."""
    with h5py.File(copy, "r+") as file:
        file.attrs["message"] = "h5py writes a text so"
    assert "attribute message is a text of variable length, of an older version or another program" in refusal(copy)


def test_long_texts_are_kept(tmp_path: Path) -> None:
    """Attributes that no header has room for."""
    result = replace(preset_run("fenz-test2"), message="ü" * 50000)
    assert load_result(result.to_netcdf(tmp_path / "long.nc")).message == result.message


@pytest.mark.parametrize("damage", ["short", "unchecked", "missing"])
def test_lists_of_chunks_are_checked(damage: str, copy: Path) -> None:
    """HDF5 crashes on a chunk that is shorter than its checksum, and reads zeros for one that is missing."""
    with h5py.File(copy, "r+") as file:
        array = file["gap"]
        values = array[()]
        if damage == "short":
            array.id.write_direct_chunk((0, 0), b"123")
        elif damage == "unchecked":
            array.id.write_direct_chunk((0, 0), values.tobytes(), filter_mask=0b111)
        else:
            del file["gap"]
            chunks = (len(values) // 2 + 1, values.shape[1])
            array = file.create_dataset("gap", values.shape, chunks=chunks, dtype=float, fletcher32=True, compression=1)
            array[: chunks[0]] = values[: chunks[0]]
    assert "gap has chunks without a checksum, or lacks some" in refusal(copy)


def test_a_file_of_another_version_that_cannot_be_read_says_so(copy: Path) -> None:
    """A file that can be read is read; one that lacks a variable is not called damaged."""
    with h5py.File(copy, "r+") as file:
        file.attrs["edition"] = np.bytes_("0" * 12)
    assert load_result(copy).status == "ok"
    with h5py.File(copy, "r+") as file:
        del file["gap"]
    assert "another version of msfp-gen wrote this result" in refusal(copy)
    with h5py.File(copy, "r+") as file:
        del file.attrs["edition"]
    assert "another version of msfp-gen wrote this result" in refusal(copy)


def test_what_others_add_does_not_matter(copy: Path, saved: Path) -> None:
    with h5py.File(copy, "r+") as file:
        file.attrs["history"] = "made larger"
        file["mine"] = np.zeros((3, 3))
    assert load_result(copy).dataset.identical(load_result(saved).dataset)


def test_the_event_of_a_stop_is_of_no_surface(tmp_path: Path) -> None:
    stopped = simulate(scene_of("fenz-test2", duration=10.0, stop=Stop(displacement=0.005)))
    assert stopped.status == "stopped" and [(event.kind, event.surface) for event in stopped.events] == [("stop", 0)]
    (event,) = load_result(stopped.to_netcdf(tmp_path / "stopped.nc")).events
    assert (event.kind, event.surface, event.time) == ("stop", 0, stopped.events[0].time)


def test_a_command_says_it_in_one_line(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(copy, "r+") as file:
        file.attrs["counter_steps"] = np.bytes_("many")
    assert main(["characterise", str(copy)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: path = ") and error.count("\n") == 1 and "counter_steps is no count" in error


@pytest.mark.parametrize("field", ["kind", "text", "action", "time", "value", "surface"])
def test_each_field_of_a_note_is_checked(copy: Path, field: str) -> None:
    """One wrong field is enough; numbers that are whole are numbers too."""
    note = {"time": 1, "kind": "value", "surface": 0, "value": 2.0, "text": "a note", "action": ""}
    wrong = {"time": float("inf"), "value": "2", "surface": 1.0}.get(field, 3)
    for given, valid in ((note, True), ({**note, field: wrong}, False)):
        text = json.dumps([given]).replace("Infinity", "1e999")
        with h5py.File(copy, "r+") as file:
            file.attrs["notes"] = np.bytes_(text)
        with pytest.raises(InputError, match="damaged") if not valid else nullcontext():
            assert load_result(copy)
