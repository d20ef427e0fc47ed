"""Numbers of tables as text."""

from __future__ import annotations

import pytest

from msfp_gen.common.tables import decimal_text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (445.31, "445.3"), (36.0, "36.00"), (12345.6, "12346"), (-1.23456, "-1.235"), (0.0714, "0.0714"),
        (5.1e-5, "0.0001"), (4e-5, "< 0.0001"), (-4e-5, "> -0.0001"),
    ],
)  # fmt: skip
def test_numbers_have_four_digits_and_no_exponent(value: float, text: str) -> None:
    assert decimal_text(value) == text
