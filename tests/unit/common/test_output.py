"""Output files: what a full disk says."""

from __future__ import annotations

from pathlib import Path

import pytest

from msfp_gen.common.output import write_text


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_names_the_file() -> None:
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        write_text(Path("/dev/full"), "text")
