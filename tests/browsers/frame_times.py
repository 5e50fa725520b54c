# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints how long browsers take for a frame of a page that turns, in software: docs/viewer.md.

.venvs/browsers/bin/python tests/browsers/frame_times.py human.html
"""

import itertools
import statistics
import sys
from pathlib import Path

import browsers

# All frames, each until it is drawn.
TIMES = """
const { way, draw, state, header } = window.sinew, times = [];
for (let frame = 0; frame < header.frames.length; ++frame) {
  state.frame = frame;
  const started = performance.now();
  draw(IS_SMOOTH);
  await way.finish();
  times.push(performance.now() - started);
}
return times
"""

page = Path(sys.argv[1]).resolve()
print(f"{page.name}: {page.stat().st_size / 1e6:.2f} MB; milliseconds a frame, least and median")
for kind in browsers.ALL:
    with kind() as browser:
        for browser.way, panes in itertools.product(("webgl", "webgpu"), (1, 2)):
            browser.show(page)
            browser.run(f"window.sinew.set({{ panes: {panes} }})")
            for is_smooth, how in (("false", "while it moves"), ("true", "smooth")):
                # The first one compiles.
                browser.run(TIMES.replace("IS_SMOOTH", is_smooth))
                times = browser.run(TIMES.replace("IS_SMOOTH", is_smooth))
                values = f"{min(times):.0f}, {statistics.median(times):.0f}"
                print(f"{kind.__name__}, {browser.way}, {panes} shown, {how}: {values}")
