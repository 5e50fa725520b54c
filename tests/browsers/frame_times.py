# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints how long browsers take for a frame of a page that turns, with WebGL in software: docs/viewer.md.

.venvs/browsers/bin/python tests/browsers/frame_times.py human.html
"""

import statistics
import sys
from pathlib import Path

import browsers

# All frames, each until its pixels can be read.
TIMES = """
const { gl, draw, state, header } = window.sinew, times = [], pixel = new Uint8Array(4);
for (let frame = 0; frame < header.frames.length; ++frame) {
  state.frame = frame;
  const started = performance.now();
  draw(IS_SMOOTH);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  times.push(performance.now() - started);
}
return times
"""

page = Path(sys.argv[1]).resolve()
print(f"{page.name}: {page.stat().st_size / 1e6:.2f} MB; milliseconds a frame, least and median")
for kind in browsers.ALL:
    with kind() as browser:
        browser.show(page)
        for panes in (1, 2):
            for is_smooth in ("false", "true"):
                browser.run(f"window.sinew.set({{ panes: {panes} }})")
                # The first one compiles.
                browser.run(TIMES.replace("IS_SMOOTH", is_smooth))
                times = browser.run(TIMES.replace("IS_SMOOTH", is_smooth))
                how = "smooth" if is_smooth == "true" else "while it moves"
                values = f"{min(times):.0f}, {statistics.median(times):.0f}"
                print(f"{kind.__name__}, {panes} shown, {how}: {values}")
