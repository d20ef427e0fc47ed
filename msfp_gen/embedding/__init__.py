"""README of a folder of generated sources (docs/embedding.md)."""

from msfp_gen.embedding.guide import README, check_guide, write_guide

__all__ = ["README", "check_guide", "write_guide"]
