# SPDX-License-Identifier: GPL-3.0-or-later
"""Brings addon/translations/*.po up to date with the texts that Sinew shows, by gettext's msgmerge:

    .venv/bin/python tools/translations.py

New texts are added without a translation, and named; texts that are shown no more become obsolete.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import sinew_addon

ROOT = Path(__file__).resolve().parents[1]
HEADER = 'msgid ""\nmsgstr "Content-Type: text/plain; charset=UTF-8\\n"\n'


def main() -> None:
    sinew_addon.register()
    import texts as found
    from sinew_addon.ui.translations import LANGUAGES

    shown, literals = found.shown(), found.literals()
    for language, translated in LANGUAGES.items():
        # Some texts are made below the panels.
        texts = dict.fromkeys([*shown, *(text for text in translated if text in literals)])
        entries = [f'msgid {json.dumps(text, ensure_ascii=False)}\nmsgstr ""\n' for text in texts]
        with tempfile.TemporaryDirectory() as folder:
            template = Path(folder, "sinew.pot")
            template.write_text("\n".join([HEADER, *entries]), encoding="utf-8")
            po = ROOT / "addon" / "translations" / f"{language}.po"
            options = ["--update", "--backup=none", "--no-fuzzy-matching", "--no-wrap", "--no-location"]
            subprocess.run(["msgmerge", *options, po, template], check=True)
            missing = [text for text in shown if text not in translated]
            if missing:
                print(f"{language}: {len(missing)} texts are not translated: {missing}", file=sys.stderr)


if __name__ == "__main__":
    main()
