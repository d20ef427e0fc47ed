"""Bearings as Functional Mock-up Units of FMI 2.0 and 3.0 (docs/fmu.md)."""

from msfp_gen.fmu.unit import WrittenUnit, write_fmu

__all__ = ["WrittenUnit", "write_fmu"]
