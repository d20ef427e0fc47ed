"""`help` of a generated module: what its docstrings say that functions return is what they return."""

from __future__ import annotations

import inspect
import re
from typing import Any

import numpy as np
import pytest
from support import model_of

from msfp_gen import presets

MODELS: list[dict[str, Any]] = [{}, {"dimension": "planar"}, {"uplift": True}]
VARIABLES = ((0, 1, 6), (1, 0, 2), (2, 3, 0))


def returned(docstring: str) -> list[str]:
    """The entries of `Returns: ...`, which commas outside of parentheses separate."""
    _, _, text = " ".join(docstring.split()).partition("Returns: ")
    assert text.endswith("."), docstring
    return re.split(r", (?!int )(?![^()]*\))", text.removesuffix("."))


def shape(entry: str, names: dict[str, int]) -> tuple[int, ...]:
    """The shape that an entry states in parentheses; () where it states none."""
    found = re.search(r"\(([^()]*,[^()]*)\)", entry)
    parts = [] if found is None else [part.strip() for part in found[1].split(",")]
    return tuple(int(eval(part, {}, names)) for part in parts if part)


@pytest.mark.parametrize("effects", MODELS, ids=str)
def test_functions_return_what_their_docstrings_say(effects: dict[str, Any]) -> None:
    model, bearing = model_of((5, 2, 2), **effects), presets.bearing("fenz-tfp")
    module, stack = model.extension, model.stack(bearing)
    names = {key: value for key, value in vars(module).items() if key.isupper() and isinstance(value, int)}
    names |= {"n": module.SURFACES + 1, "k": len(VARIABLES)}
    several = names | {"k": 2}
    q, f = np.zeros((4, module.COORDINATES)), np.full((4, 2), 0.1)
    q[:, 5:] = -1e-5  # with uplift: closed
    state, outside = (q, 0 * q), (np.zeros((3, 6)), np.array([0.0, 0, -1e5, 0, 0, 0]))
    unknowns = stack.accelerations(*state, f, *outside, report=True)[-1]
    assert unknowns is not None
    calls: dict[str, tuple[Any, ...]] = {
        "accelerations": (*state, f, *outside),
        "observe": (*state, 0 * q, f, *outside),
        "condensed": (*state, 0 * q, f, *outside, 0.0, 0.0, 1.0, 0.0),
        "report": (*state, f, *outside, unknowns, VARIABLES),
        "vectors": (*state, 0 * q, outside[0]),
        "many_accelerations": tuple(np.stack([value, value]) for value in (*state, f, *outside)),
    }
    methods = {name for name, _ in inspect.getmembers(type(stack), inspect.isroutine) if not name.startswith("_")}
    assert methods == set(calls)
    for name, arguments in calls.items():
        entries, found = returned(inspect.getdoc(getattr(stack, name)) or ""), getattr(stack, name)(*arguments)
        assert len(entries) == len(found), (name, entries)
        for entry, value in zip(entries, found, strict=True):
            stated = shape(entry, several if name.startswith("many") else names)
            assert np.shape(value) == stated or (value is None and entry.endswith("or None")), entry
    *_, found = stack.accelerations(*state, f, *outside, report=True)
    assert np.shape(found) == (module.UNKNOWNS,)


@pytest.mark.parametrize("effects", MODELS, ids=str)
def test_the_example_of_a_module_returns_what_it_names(effects: dict[str, Any]) -> None:
    module = model_of((5, 2, 2), **effects).extension
    text = module.__doc__ or ""
    assert "model.Stack(" in text and "5_2_2" not in text
    example = re.search(r">>> ([\w, ]+) = stack\.accelerations", text)
    assert example is not None
    assert len(example[1].split(",")) == len(returned(inspect.getdoc(module.Stack.accelerations) or ""))
