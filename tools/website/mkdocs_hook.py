# SPDX-License-Identifier: GPL-3.0-or-later
"""What the site has beside docs/: documents elsewhere in the repository, and pages made from code.

Every page is known to mkdocs by its path in the repository, so that a link between documents is the same on
the site as in the repository; and mkdocs, which checks links, finds those that lead nowhere.
"""

from __future__ import annotations

import os
import posixpath
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]

# Where the site has documents that are not in docs/.
OUTSIDE = {
    "README.md": "index.html",
    "CONTRIBUTING.md": "contributing.html",
    "CHANGELOG.md": "changelog.html",
    "SECURITY.md": "security.html",
    "RELEASING.md": "releasing.html",
    "NOTICES.md": "notices.html",
    "bench/README.md": "measurements.html",
    "experiments/README.md": "experiments.html",
    "experiments/future_work/fits.md": "fits.html",
    "experiments/future_work/ik.md": "ik.html",
    "tests/README.md": "tests.html",
    "tests/golden/README.md": "golden.html",
}

# Files whose characters turn on the site, in the order of docs/viewer.md. Made by the command of .venv; the
# site has those that are there.
TURNING = [ROOT / "blend_files" / name for name in ("wrist.blend", "elbow.blend", "shoulder.blend")]
TURNING.append(Path(os.environ.get("SINEW_RIGS", ROOT / "rigs"), "human.blend"))
PICTURE = "![Two methods on a wrist, with the stretch of edges as colours](viewer.png)"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """All files by their paths in the repository, with what is elsewhere and what is made."""
    known = Files([])
    for file in files:
        if file.src_dir == config.docs_dir:
            file = _file(config, f"docs/{file.src_uri}", file.dest_uri)
        known.append(file)
    for source, place in OUTSIDE.items():
        known.append(_file(config, source, place))
    for name, text in _made():
        made = File.generated(config, f"docs/{name}.md", content=text)
        made.dest_uri = f"{name}.html"
        known.append(made)
    for path in _turning():
        known.append(
            File(f"live/{path.name}", str(path.parents[1]), config.site_dir, use_directory_urls=False)
        )
    for source in sorted(_linked(known)):
        if known.get_file_from_path(source) is None and (ROOT / source).is_file():
            known.append(_file(config, source, source.removeprefix("docs/")))
    return known


def _file(config: MkDocsConfig, source: str, place: str) -> File:
    return File(source, str(ROOT), config.site_dir, config.use_directory_urls, dest_uri=place)


def _made() -> list[tuple[str, str]]:
    # With the folder of this file, which is where mkdocs does not look.
    sys.path.insert(0, str(Path(__file__).parent))
    try:
        import make_reference
    finally:
        sys.path.pop(0)
    return [(name, make()) for name, make in make_reference.PAGES.items()]


def _turning() -> list[Path]:
    """Pages of TURNING, in build/live."""
    sinew, folder = ROOT / ".venv/bin/sinew", ROOT / "build" / "live"
    pages = {path: folder / f"{path.stem}.html" for path in TURNING if sinew.exists() and path.exists()}
    options = "--methods", "lbs,dq,cor", "--viewer"
    commands = [[sinew, "compare", path, *options, page] for path, page in pages.items()]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    for process in [subprocess.Popen(command, **quiet) for command in commands]:
        if process.wait():
            raise subprocess.CalledProcessError(process.returncode, process.args)
    return list(pages.values())


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """In the place of its picture, the page that turns has a character that turns."""
    pages = [file.src_uri for file in files if file.src_uri.startswith("live/")]
    if page.file.src_uri != "docs/viewer.md" or not pages:
        return markdown
    assert PICTURE in markdown
    others = ", ".join(f"[{Path(uri).stem}](../{uri})" for uri in pages)
    style = "width:100%;height:44rem;border:0"
    frame = f'<iframe src="{pages[0]}" title="A wrist that turns" style="{style}"></iframe>'
    return markdown.replace(PICTURE, f"{frame}\n\nEach with a page of its own: {others}.")


def _linked(files: Files) -> set[str]:
    """What pages link to in the repository, as paths there: figures, say, that are no pages."""
    found = set()
    for page in files.documentation_pages():
        folder = posixpath.dirname(page.src_uri)
        for link in re.findall(r"\]\(([^)#\s:]+)\)", page.content_string):
            found.add(posixpath.normpath(posixpath.join(folder, link)))
    return found
