"""Malformed scene files: each gives one clear line that names the field, the value and the remedy."""

import copy

import pytest
from support.malformed_scenes import GOOD, ROWS, broken

from msfp_gen import presets
from msfp_gen.common.errors import InputError
from msfp_gen.scene.file.loader import dumps, scene_from_table
from msfp_gen.scene.file.source import load_scene


def line(error):
    text = str(error.value)
    assert "\n" not in text and len(text) < 400, text
    return text


@pytest.mark.parametrize(("path", "value", "words"), ROWS, ids=lambda item: item if isinstance(item, str) else None)
def test_each_malformed_scene_gives_one_clear_line(path, value, words):
    with pytest.raises(InputError) as error:
        scene_from_table(broken(path, value))
    message = line(error)
    assert all(word in message for word in words), message


def test_the_unbroken_scene_is_fine():
    assert scene_from_table(copy.deepcopy(GOOD)) == presets.scene("fenz-test2")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"name = ", ("no valid TOML", "end of document")),
        (b"name = 'a'\nname = 'b'\n", ("no valid TOML", "line 2")),
        (b"name = '\xff'", ("no UTF-8", "byte 8")),
        (b"", ("bearing is missing",)),
        (b"bearing = 'fenz-tfp'\nmotion = {kind = 'ramp'}", ("motion.acceleration is missing",)),
    ],
)
def test_files_that_are_no_scenes_are_named(tmp_path, content, words):
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        load_scene(path)
    assert all(word in line(error) for word in ("scene.toml", *words)), str(error.value)


MISSING = [("fenz-tets1", "fenz-test1"), ("no/such.toml", "give the"), (".", "path")]


@pytest.mark.parametrize(("source", "word"), MISSING)
def test_files_that_are_not_there(source, word):
    with pytest.raises(InputError) as error:
        load_scene(source)
    assert word in line(error) and repr(source) in str(error.value)


def test_errors_of_files_name_file_and_field(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(dumps(broken("bearing.surfaces.2.radius", "76 kN")), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scene(path)
    assert line(error).startswith(f"{path}: bearing.surfaces[2].radius = '76 kN' (surface 3): ")
