"""Time from the movement of a slider of the explorer to the end of the drawing: prints the table of docs/figures.md.

The page runs in headless Chromium from a file, as in the tests. Each row is the median of the movements of one slider
through its range near the middle. Needs ziglang, selenium, Chromium and its driver.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from quick import installed, parser, pick

from msfp_gen.report.explore import EXPLORED, write_explorer

sys.path.append(str(Path(__file__).parents[1]))
from tests.support.explorer_page import CHROMIUM, DRIVER, SLIDE, act, choose_preset, explorer_in_browser

SHARES = np.linspace(0.9, 1.1, pick(45, 3))  # of the slider's middle


def main() -> None:
    """Print the table."""
    parser(__doc__).parse_args()
    if not (CHROMIUM and DRIVER and installed("ziglang", "all") and installed("selenium", "all")):
        print("left out: this needs ziglang, selenium, Chromium and its driver")
        return
    print("| preset | run [ms] | run and drawing [ms] |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "profile").mkdir()
        page = write_explorer(Path(folder) / "page.html")
        with explorer_in_browser(page, Path(folder) / "profile") as browser:
            for name in EXPLORED:
                choose_preset(browser, name)
                slider = "scale of the record" if "ridgecrest" in name else "amplitude"
                times = []
                for share in SHARES:
                    act(browser, SLIDE, slider, float(share))
                    times.append(browser.execute_script("return [state.times.run, state.times.redraw]"))
                run, redraw = np.median(times, axis=0)
                print(f"| `{name}` | {run:.0f} | {redraw:.0f} |", flush=True)


if __name__ == "__main__":
    main()
