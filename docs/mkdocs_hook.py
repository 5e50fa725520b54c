# SPDX-License-Identifier: GPL-3.0-or-later
"""What the site has beside docs/: documents elsewhere in the repository, and pages made from code.

Every page is known to mkdocs by its path in the repository, so that a link between documents is the same on
the site as in the repository; and mkdocs, which checks links, finds those that lead nowhere.
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mkdocs.structure.files import File, Files

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

ROOT = Path(__file__).resolve().parents[1]

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
    "tests/golden/README.md": "golden.html",
}


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


def _linked(files: Files) -> set[str]:
    """What pages link to in the repository, as paths there: figures, say, that are no pages."""
    found = set()
    for page in files.documentation_pages():
        folder = posixpath.dirname(page.src_uri)
        for link in re.findall(r"\]\(([^)#\s:]+)\)", page.content_string):
            found.add(posixpath.normpath(posixpath.join(folder, link)))
    return found
