"""What explains a folder of generated sources: README.md, Makefile and an example in C (docs/embedding.md)."""

from msfp_gen.embedding.guide import GUIDE, check_guide, write_guide

__all__ = ["GUIDE", "check_guide", "write_guide"]
