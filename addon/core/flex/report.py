# SPDX-License-Identifier: GPL-3.0-or-later
"""Verdicts as text: lines of a terminal, JUnit's XML, Markdown, JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from .verdict import Finding, Verdict


@dataclass(frozen=True)
class FileReport:
    """
    verdict   None where the file could not be judged: `error` then says why
    left_out  a sentence for each mesh that could not be judged
    """

    file: str
    verdict: Verdict | None = None
    left_out: tuple[str, ...] = ()
    error: str = ""

    @property
    def is_good(self) -> bool:
        return self.verdict is not None and self.verdict.is_good and not self.left_out

    @property
    def headline(self) -> str:
        if self.verdict is None:
            return self.error
        good = sum(joint.is_good for joint in self.verdict.joints)
        return f"{good} of {len(self.verdict.joints)} joints pass"

    def to_dict(self) -> dict[str, Any]:
        found: dict[str, Any] = {"file": self.file, "passed": self.is_good, "left_out": list(self.left_out)}
        if self.verdict is None:
            return found | {"error": self.error}
        return found | {"joints": [joint.to_dict() for joint in self.verdict.joints]}


def lines(report: FileReport) -> Iterator[str]:
    yield f"{report.file}: {'ok' if report.is_good else 'FAILED'}: {report.headline}"
    for reason in report.left_out:
        yield f"  left out: {reason}"
    findings = report.verdict.findings if report.verdict is not None else []
    for finding in findings:
        mends = f"; not under {', '.join(finding.mends)}" if finding.mends else ""
        yield f"  {finding.joint}: {finding.text}{_at(finding)}{mends}"
    for limit in dict.fromkeys(finding.limit for finding in findings):
        yield f"  {limit.label}: {limit.meaning} {limit.advice}"


def junit(reports: Sequence[FileReport]) -> str:
    suites = ElementTree.Element("testsuites", name="sinew flex")
    for report in reports:
        joints = report.verdict.joints if report.verdict is not None else ()
        failures = sum(not joint.is_good for joint in joints)
        errors = len(report.left_out) + (report.verdict is None)
        suite = ElementTree.SubElement(
            suites,
            "testsuite",
            name=report.file,
            tests=str(len(joints) + errors),
            failures=str(failures),
            errors=str(errors),
        )
        for joint in joints:
            case = ElementTree.SubElement(suite, "testcase", classname=report.file, name=joint.name)
            if joint.findings:
                failure = ElementTree.SubElement(case, "failure", message=joint.findings[0].text)
                failure.text = "\n".join(
                    f"{each.text}{_at(each)}\n{each.limit.meaning} {each.advice}" for each in joint.findings
                )
        for reason in (*report.left_out, *((report.error,) if report.verdict is None else ())):
            case = ElementTree.SubElement(suite, "testcase", classname=report.file, name="file")
            ElementTree.SubElement(case, "error", message=reason)
    ElementTree.indent(suites)
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(suites, encoding="unicode") + "\n"
    )


def markdown(reports: Sequence[FileReport]) -> str:
    parts = []
    for report in reports:
        mark = "pass" if report.is_good else "**fail**"
        parts.append(f"### {_cell(report.file)}: {mark}\n\n{_cell(report.headline)}\n")
        parts += [f"- left out: {_cell(reason)}\n" for reason in report.left_out]
        findings = report.verdict.findings if report.verdict is not None else []
        if findings:
            rows = [
                "| joint | finding | where | what to do |",
                "|---|---|---|---|",
                *(
                    f"| {' | '.join(map(_cell, (each.joint, each.text, each.place, each.advice)))} |"
                    for each in findings
                ),
            ]
            parts.append("\n".join(rows) + "\n")
    return "\n".join(parts)


def _at(finding: Finding) -> str:
    return f" at {finding.place}" if finding.place else ""


def _cell(text: str) -> str:
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")
