"""Models for other programs: the C library of `export`, and the README of a generated folder (docs/embedding.md)."""

from msfp_gen.embedding.library import README, Library, check_guide, export_library, write_guide

__all__ = ["README", "Library", "check_guide", "export_library", "write_guide"]
