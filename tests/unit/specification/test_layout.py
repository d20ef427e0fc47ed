import pickle
import subprocess
import sys

import numpy as np
import pytest

from msfp_gen.common.errors import InputError
from msfp_gen.specification.layout import Effects, Layout, ModelSpec


def test_layouts_of_the_report():
    assert Layout.tfp() == Layout(n=5, m=2, p=2)
    assert Layout.tfp().signs == (1, 1, -1, -1)
    assert Layout.tfp().surfaces == 4
    assert Layout.tfp().name == "5_2_2"
    assert Layout.dfp() == Layout(3, 1, 1)


@pytest.mark.parametrize("layout", [Layout(2, 1, 0), Layout(2, 0, 1), Layout(7, 3, 3), Layout(4, 1, 2)])
def test_one_sign_per_surface(layout):
    assert len(layout.signs) == layout.surfaces == layout.n - 1
    assert layout.signs.count(1) == layout.m


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ((5, 2, 3), ("layout.n = 5", "n = m + p + 1")),
        ((1, 0, 0), ("layout.n = 1", "at least 2")),
        ((5, -2, 6), ("layout.m = -2", "not below 0")),
        ((5.0, 2, 2), ("layout.n = 5.0", "whole number")),
        ((True, 0, 0), ("layout.n = True", "whole number")),
        (("5", 2, 2), ("layout.n = '5'", "plain number")),
    ],
)
def test_impossible_layouts_are_refused(counts, words):
    with pytest.raises(InputError) as error:
        Layout(*counts)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize(
    "wrong",
    [{"spin": "fixed"}, {"rims": 1}, {"dimension": 2}, {"bouc_wen": None}, {"friction": "coulomb"}, {"sliders": []}],
)
def test_unknown_effects_are_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(InputError, match=rf"effects\.{name} = .*give one of"):
        Effects(**wrong)


def test_massless_sliders_leave_spin_undetermined():
    with pytest.raises(InputError, match="spin"):
        Effects(sliders="massless", spin="free")
    assert Effects(sliders="massless", spin="patch").spin == "patch"


def test_key_names_every_choice():
    spec = ModelSpec(Layout.tfp(), Effects())
    assert spec.key == "5_2_2-spatial-locked-inertial-rims-report-constant"
    changes = [
        {"dimension": "planar"},
        {"spin": "free"},
        {"sliders": "massless"},
        {"rims": False},
        {"bouc_wen": "isotropic"},
    ]
    keys = {spec.key, ModelSpec(Layout.dfp()).key, *(ModelSpec(Layout.tfp(), Effects(**c)).key for c in changes)}
    assert len(keys) == len(changes) + 2


def test_specs_are_frozen_hashable_and_picklable():
    spec = ModelSpec(Layout.tfp(), Effects(rims=False))
    assert pickle.loads(pickle.dumps(spec)) == spec
    assert len({spec, ModelSpec(Layout.tfp(), Effects(rims=False))}) == 1
    with pytest.raises(AttributeError):
        spec.layout.n = 3


def test_layout_is_light_enough_for_the_generator():
    heavy = "{'numpy', 'pint', 'sympy', 'xarray'}"
    code = f"import sys, msfp_gen, msfp_gen.specification.layout; print(*({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_public_names_lead_to_their_homes():
    import msfp_gen

    assert msfp_gen.Layout is Layout
    assert set(msfp_gen._MODULES) | {"__version__"} == set(msfp_gen.__all__) <= set(dir(msfp_gen))
    with pytest.raises(AttributeError, match="nonsense"):
        _ = msfp_gen.nonsense


def test_a_word_of_an_array_is_a_word():
    effects = Effects(sliders=np.array(["massless"])[0])
    assert effects == Effects(sliders="massless") and type(effects.sliders) is str
    with pytest.raises(InputError, match=r"effects\.rims = 1: give one of True, False"):
        Effects(rims=1)
