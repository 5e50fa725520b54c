# SPDX-License-Identifier: GPL-3.0-or-later
"""Reports of files as text: lines of a terminal, JUnit's XML, Markdown. A report is what --json prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Any
from xml.etree import ElementTree

from ...skinning.variants import name_of
from .verdict import by_cause

Report = Mapping[str, Any]


def of_file(file: str, outcome: Report) -> Report:
    """Returns the report of a file.

    outcome  "joints", as from Verdict.to_dict(), and "left_out", a sentence for each mesh that could not be
             judged; or "error", why the file could not
    """
    if "error" in outcome:
        return {"file": file, "passed": False, "left_out": [], "error": outcome["error"]}
    joints, left_out = outcome["joints"], outcome["left_out"]
    passed = not left_out and all(joint["passed"] for joint in joints)
    return {"file": file, "passed": passed, "left_out": left_out, "joints": joints}


def lines(report: Report) -> Iterator[str]:
    yield f"{report['file']}: {'ok' if report['passed'] else 'FAILED'}: {headline(report)}"
    for reason in report["left_out"]:
        yield f"  left out: {reason}"
    findings = _by_cause(report)
    for own, others in findings:
        yield f"  {_line(*own)}"
        yield from (f"    from it: {_line(*each)}" for each in others)
    # What is said of several joints is said once.
    yield from dict.fromkeys(
        f"  {finding['label']}: {finding['meaning']} {finding['advice']}"
        for (_joint, finding), _others in findings
    )


def junit(reports: Sequence[Report]) -> str:
    suites = ElementTree.Element("testsuites", name="sinew flex")
    for report in reports:
        joints = report.get("joints", [])
        errors = [*report["left_out"], *([report["error"]] if "error" in report else [])]
        suite = ElementTree.SubElement(
            suites,
            "testsuite",
            name=report["file"],
            tests=str(len(joints) + len(errors)),
            failures=str(sum(not joint["passed"] for joint in joints)),
            errors=str(len(errors)),
        )
        for joint in joints:
            case = ElementTree.SubElement(
                suite, "testcase", classname=report["file"], name=_of_xml(joint["joint"])
            )
            if joint["findings"]:
                texts = [f"{_text(each)}\n{each['meaning']} {each['advice']}" for each in joint["findings"]]
                failure = ElementTree.SubElement(
                    case, "failure", message=_of_xml(_text(joint["findings"][0]))
                )
                failure.text = _of_xml("\n".join(texts))
        for reason in errors:
            case = ElementTree.SubElement(suite, "testcase", classname=report["file"], name="file")
            ElementTree.SubElement(case, "error", message=_of_xml(reason))
    ElementTree.indent(suites)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ElementTree.tostring(suites, encoding="unicode")}\n'


def markdown(reports: Sequence[Report]) -> str:
    parts = []
    for report in reports:
        mark = "pass" if report["passed"] else "**fail**"
        parts.append(f"### {_cell(report['file'])}: {mark}\n\n{_cell(headline(report))}\n")
        parts += [f"- left out: {_cell(reason)}\n" for reason in report["left_out"]]
        rows = [
            f"| {' | '.join(map(_cell, (joint, each['text'], each['place'], each['advice'])))} |"
            for own, others in _by_cause(report)
            for joint, each in (own, *others)
        ]
        if rows:
            head = ["| joint | finding | where | what to do |", "|---|---|---|---|"]
            parts.append("\n".join([*head, *rows]) + "\n")
    return "\n".join(parts)


_Found = tuple[str, Report]
"""The name of a joint, and a finding."""


def _by_cause(report: Report) -> list[tuple[_Found, list[_Found]]]:
    """As of Verdict.by_cause()."""
    found = [(joint["joint"], each) for joint in report.get("joints", []) for each in joint["findings"]]
    return by_cause(
        found,
        lambda each: (each[0], each[1]["name"]),
        lambda each: each[1]["caused_by"] and (each[1]["caused_by"]["joint"], each[1]["caused_by"]["name"]),
        lambda each: inf if each[1]["times"] is None else each[1]["times"],
    )


def _line(joint: str, finding: Report) -> str:
    mends = f"; not under {', '.join(map(name_of, finding['mends']))}" if finding["mends"] else ""
    return f"{joint}: {_text(finding)}{mends}"


def headline(report: Report) -> str:
    if "error" in report:
        return str(report["error"])
    joints = report["joints"]
    return f"{sum(joint['passed'] for joint in joints)} of {len(joints)} joints pass"


def _text(finding: Report) -> str:
    return f"{finding['text']} at {finding['place']}" if finding["place"] else str(finding["text"])


def _cell(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")


def _of_xml(text: str) -> str:
    """Without the characters that XML can not have: names in files contain any."""
    return "".join(each if each in "\t\n" or each >= " " else "\N{REPLACEMENT CHARACTER}" for each in text)
