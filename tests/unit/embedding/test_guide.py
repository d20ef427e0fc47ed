"""README.md of a folder that `msfp-gen generate -o` writes; test_generate_import.py reads that of a whole folder."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from msfp_gen import Effects, InputError, Layout
from msfp_gen.embedding.library import README, write_guide
from msfp_gen.generator import generate
from msfp_gen.specification.layout import ModelSpec


@pytest.mark.parametrize(
    ("layout", "effects"),
    [
        (Layout(2, 1, 0), Effects(dimension="planar", sliders="massless")),
        (Layout(3, 0, 2), Effects(friction="pvt", uplift=True)),
        (Layout(7, 3, 3), Effects(friction="custom", friction_law="mu * (1 - c1 * exp(-c2 * v))", top_rotation=True)),
    ],
)
def test_the_tables_fit_every_model(layout: Layout, effects: Effects, tmp_path: Path) -> None:
    text = write_guide(ModelSpec(layout, effects), tmp_path, "msfp_model").read_text(encoding="utf-8")
    assert not re.search(r"\[\[ ?\w+ ?\]\]", text) and ("separation along" in text) == effects.uplift
    assert effects.law is None or all(f"| {name} |" in text for name in effects.law.columns)


def test_operations_are_those_of_the_emitted_programs(tmp_path: Path) -> None:
    """The sums of the table from what the header states of each program, by the names in `schedule.py`."""
    spec = ModelSpec(Layout(2, 1, 0), Effects(dimension="planar"))
    text = write_guide(spec, tmp_path, "msfp_2_1_0").read_text(encoding="utf-8")
    header = generate(spec).files["msfp_kernels.h"]
    stated = re.findall(r"\n \* (\d+) operations; out: .*?\*/\n(?:.|\n)*?void msfp_(\w+?)(?:_lanes)?\(", header)
    count = {name: int(number) for number, name in stated}

    def total(*names: str) -> int:
        return sum(count[name] for name in names)

    top = total("top_wrench", "foot")
    bodies = total("forward", "linear_balance", "angular_balance", "balances")
    surfaces = total("rim_coordinates", "rim", "slip_rotation", "report_contact", "report_wrench")
    assert f"| momentum balances | {count['forward']} | {bodies} | {surfaces} | {top} |" in text
    rim = ("rim_coordinates", "rim", "interface_force")
    surfaces = total(*rim, "surface_local", "contact_stage", "contact", "surface_moment", "moment_to_world")
    assert f"| condensed | {count['forward']} | {total('forward', 'angular_balance')} | {surfaces} | {top} |" in text


def test_files_of_the_user_are_not_replaced(tmp_path: Path) -> None:
    spec = ModelSpec(Layout.tfp(), Effects())
    write_guide(spec, tmp_path, "msfp_5_2_2")
    write_guide(spec, tmp_path, "msfp_5_2_2")
    (tmp_path / README).write_text("mine\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"msfp-gen did not write README\.md: move it away"):
        write_guide(spec, tmp_path, "msfp_5_2_2")
    assert (tmp_path / README).read_text(encoding="utf-8") == "mine\n"
