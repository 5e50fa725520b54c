# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages of the site that are made from code: the command line, the Python package, the C++ headers.

    python tools/website/make_reference.py commands|python|cpp

mkdocs_hook.py calls this when the site is built. The parsers are asked, so Sinew's library must be installed;
Python and C++ are read, not run.
"""

from __future__ import annotations

import argparse
import ast
import html
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "native" / "python" / "sinew"
HEADERS = ROOT / "native" / "sinew"

# A line of what is said of arguments: their names, a colon, the rest.
_DEFINITION = re.compile(r"([a-z_]\w*(?:, [a-z_]\w*)*): (.*)")


# --- Text


def escaped(text: str) -> str:
    """Plain text as Markdown that shows just that, but for what is in backticks."""
    parts = re.split(r"(`[^`]*`)", text)
    for index in range(0, len(parts), 2):
        parts[index] = re.sub(r"([\\*_\[\]#|])", r"\\\1", html.escape(parts[index], quote=False))
    return "".join(parts)


def said(text: str) -> str:
    """A docstring or a help text as Markdown: prose flows, arguments become a list, what is aligned stays."""
    return "\n\n".join(_paragraph(part) for part in re.split(r"\n\s*\n", text.strip("\n")))


def _paragraph(text: str) -> str:
    lines = text.splitlines()
    if _DEFINITION.match(lines[0]) and all(_DEFINITION.match(line) or line[0] == " " for line in lines):
        items: list[str] = []
        for line in lines:
            match = _DEFINITION.match(line)
            if match:
                items.append(f"- `{match[1]}`: {escaped(match[2])}")
            else:
                items[-1] += " " + escaped(line.strip())
        return "\n".join(items)
    if any(re.match(r"  ", line) or re.search(r"\S {2,}\S", line) for line in lines):
        return block("text", text)
    return escaped(" ".join(lines))


def block(language: str, text: str) -> str:
    return f"```{language}\n{text}\n```"


def row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("\n", " ") for cell in cells) + " |"


# --- The command line


def command_line() -> str:
    """Each subcommand of `sinew`, from the parsers that also print its help."""
    # argparse breaks lines where the terminal ends, and colours them from Python 3.14 on.
    os.environ.update(COLUMNS="100", NO_COLOR="1")
    sys.path.insert(0, str(ROOT))
    from addon import cli

    parser, _modules = cli.make_parser()
    subparsers = next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    helps = {action.dest: action.help for action in subparsers._choices_actions}
    pages = [
        "# Command line",
        "`sinew COMMAND --help` prints the same. Exit status 0: all went well; 1: something failed; 2: wrong "
        "use. No file that is read is ever written over.",
        "\n".join(
            (
                row("command", "what it does"),
                row("---", "---"),
                *(row(f"[`{name}`](#sinew-{name})", escaped(text or "")) for name, text in helps.items()),
            )
        ),
        "Before the command:",
        _options(parser),
    ]
    for name, subparser in subparsers.choices.items():
        pages += [f"## sinew {name}", said(subparser.description or helps[name] or "")]
        usage = subparser.format_usage().rstrip().splitlines()
        # Without the word "usage: ", and what is aligned to it.
        pages += [block("text", "\n".join(line[7:] for line in usage)), _options(subparser)]
        if subparser.epilog:
            pages.append(said(subparser.epilog))
    return "\n\n".join(pages) + "\n"


def _options(parser: argparse.ArgumentParser) -> str:
    rows = [row("argument", "meaning"), row("---", "---")]
    formatter = parser._get_formatter()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction) or action.help == argparse.SUPPRESS:
            continue
        name = ", ".join(action.option_strings)
        if action.nargs != 0:
            values = action.metavar or (
                "{" + ",".join(map(str, action.choices)) + "}" if action.choices else action.dest.upper()
            )
            name = f"{name} {values}".strip()
        text = escaped(formatter._expand_help(action)) if action.help else ""
        if action.required and action.option_strings:
            text = f"{text} (required)".strip()
        rows.append(row(f"`{name}`", text))
    return "\n".join(rows)


# --- The Python package


def python_api() -> str:
    """What `sinew` and its modules name in `__all__`, from their docstrings and types."""
    package = parsed("__init__.py")
    native = parsed("_native/__init__.pyi")
    known = _definitions(native)
    pages = ["# Python", said(_docstring(package))]
    for name in exported(native):
        pages += _described(name, known[name], "##")
    modules = sorted(path.stem for path in PACKAGE.glob("[a-z]*.py"))
    for name in modules:
        pages += _module(name)
    pages += ["## Results", "Named tuples that functions of these modules return."]
    for name, found in _definitions(parsed("_types.py")).items():
        if isinstance(found[0], ast.ClassDef):
            pages += _described(name, found, "###")
    return "\n\n".join(pages) + "\n"


def parsed(name: str) -> ast.Module:
    """A file of the package."""
    return ast.parse((PACKAGE / name).read_text(encoding="utf-8"))


def _docstring(node: ast.Module | ast.ClassDef | ast.FunctionDef) -> str:
    return ast.get_docstring(node) or ""


def exported(module: ast.Module) -> list[str]:
    """`__all__`, or nothing."""
    for node in module.body:
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and ast.unparse(node).startswith("__all__"):
            return ast.literal_eval(node.value)
    return []


def _definitions(module: ast.Module | ast.ClassDef) -> dict[str, list[ast.ClassDef | ast.FunctionDef]]:
    """Classes and functions by name; overloads of one are several."""
    found: dict[str, list[ast.ClassDef | ast.FunctionDef]] = {}
    for node in module.body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            found.setdefault(node.name, []).append(node)
    return found


def _assigned(module: ast.Module) -> dict[str, ast.expr]:
    found = {}
    for node in module.body:
        if isinstance(node, ast.Assign):
            found[ast.unparse(node.targets[0])] = node.value
        elif isinstance(node, ast.AnnAssign) and node.value:
            found[ast.unparse(node.target)] = node.annotation
    return found


def _module(name: str) -> list[str]:
    module = parsed(f"{name}.py")
    known, assigned = _definitions(parsed(f"_native/{name}.pyi")) | _definitions(module), _assigned(module)
    pages = [f"## sinew.{name}", said(_docstring(module))]
    # A module without a list has all that the native one has.
    for member in exported(module) or known:
        title = f"{name}.{member}"
        if member in known:
            pages += _described(title, known[member], "###")
        elif member in assigned:
            pages += [f"### {title}", block("python", f"{member}: {_type(assigned[member])}")]
    return pages


def _described(title: str, nodes: list[ast.ClassDef | ast.FunctionDef], level: str) -> list[str]:
    pages = [f"{level} {title}"]
    for node in nodes:
        if isinstance(node, ast.ClassDef):
            pages += _class(title, node, level + "#")
        else:
            pages += [block("python", _signature(node, title.rpartition(".")[2])), said(_docstring(node))]
    return pages


def _class(title: str, node: ast.ClassDef, level: str) -> list[str]:
    pages = [said(_docstring(node))]
    members = _definitions(node)
    for made in members.pop("__init__", []):
        assert isinstance(made, ast.FunctionDef)
        pages += [block("python", _signature(made, title, result=False)), said(_docstring(made))]
    values = [
        row(f"`{field.target.id}`", f"`{_type(field.annotation)}`", "")
        for field in node.body
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
    ]
    functions = []
    for name, nodes in members.items():
        first = nodes[0]
        if isinstance(first, ast.FunctionDef) and "property" in map(ast.unparse, first.decorator_list):
            kind = _type(first.returns) if first.returns else ""
            values.append(row(f"`{name}`", f"`{kind}`", escaped(_docstring(first))))
        elif not name.startswith("_"):
            functions += _described(f"{title}.{name}", nodes, level)
    if values:
        pages.append("\n".join((row("property", "type", ""), row("---", "---", "---"), *values)))
    return [page for page in (*pages, *functions) if page]


def _signature(node: ast.FunctionDef, name: str, result: bool = True) -> str:
    arguments = list(_arguments(node.args))
    returns = f" -> {_type(node.returns)}" if result and node.returns else ""
    line = f"{name}({', '.join(arguments)}){returns}"
    if len(line) <= 88:
        return line
    return "\n".join((f"{name}(", *(f"    {argument}," for argument in arguments), f"){returns}"))


def _arguments(arguments: ast.arguments) -> Iterator[str]:
    plain = [*arguments.posonlyargs, *arguments.args]
    defaults = [None] * (len(plain) - len(arguments.defaults)) + arguments.defaults
    for argument, default in zip(plain, defaults, strict=True):
        if argument.arg != "self":
            yield _argument(argument, default)
    if arguments.vararg:
        yield f"*{_argument(arguments.vararg, None)}"
    elif arguments.kwonlyargs:
        yield "*"
    for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        yield _argument(argument, default)
    if arguments.kwarg:
        yield f"**{_argument(arguments.kwarg, None)}"


def _argument(argument: ast.arg, default: ast.expr | None) -> str:
    return _type(argument) + ("" if default is None else f" = {ast.unparse(default)}")


def _type(node: ast.AST) -> str:
    """A type as one writes it, without the modules of those that everyone knows."""
    return re.sub(
        r"\b(numpy\.typing|typing|collections\.abc|sinew\._types)\.", "", ast.unparse(node)
    ).replace("numpy.", "np.")


# --- The C++ headers


def cpp_api() -> str:
    """The public headers without bodies and private parts, as they are commented."""
    pages = [
        "# C++",
        "`cmake --install`, then `find_package(sinew)` and `target_link_libraries(… sinew::sinew)`. Here are "
        "the headers, all in namespace `sinew`, without the bodies of functions. The definition of each "
        "method is in `sinew/methods/NAME/NAME.h`.",
    ]
    for name in public_headers():
        pages += [
            f"## sinew/{name}",
            block("cpp", declarations((HEADERS / name).read_text(encoding="utf-8"))),
        ]
    return "\n\n".join(pages) + "\n"


def public_headers() -> list[str]:
    """Those that are installed, but for the definitions of methods."""
    described = (HEADERS / "CMakeLists.txt").read_text(encoding="utf-8")
    listed = re.search(r"list\(APPEND headers\s+([^)]*)\)", described)
    if listed is None:
        raise ValueError("native/sinew/CMakeLists.txt lists no headers")
    top = sorted({path.name for path in HEADERS.glob("*.h")} - {"sinew.h", "deformer_state.h"})
    folders = ("transform", "interpolate")
    others = [path for f in folders for path in (HEADERS / f).glob("*.h")]
    others += [path for path in HEADERS.glob("stages/*/*.h") if path.stem == path.parent.name]
    return [*top, *listed[1].split(), *sorted(path.relative_to(HEADERS).as_posix() for path in others)]


def declarations(header: str) -> str:
    """What is in namespace sinew, as commented; without bodies of functions, private parts and details."""
    text = header.partition("namespace sinew {\n")[2].rpartition("}  // namespace sinew")[0]
    text = re.sub(
        r"^namespace detail \{.*?^\}  // namespace detail$", "", text, flags=re.MULTILINE | re.DOTALL
    )
    code = _code_alone(text)
    kept, position = [], 0
    for found in re.finditer(r"\)[\s\w]*\{", code):
        if found.start() < position or _is_lambda(code, found.start()):
            continue
        kept += [text[position : found.end() - 1].rstrip(), ";"]
        position = _closing(code, found.end() - 1) + 1
    text = "".join([*kept, text[position:]])
    text = re.sub(r"\n+private:\n.*?(?=\n\};)", "", text, flags=re.DOTALL)
    return re.sub(r"\n{3,}", "\n\n", text).strip()


def _code_alone(text: str) -> str:
    """With spaces in place of comments and strings."""
    return re.sub(r'//[^\n]*|/\*.*?\*/|"[^"\n]*"', lambda match: " " * len(match[0]), text, flags=re.DOTALL)


def _closing(code: str, brace: int) -> int:
    depth = 0
    for position in range(brace, len(code)):
        depth += {"{": 1, "}": -1}.get(code[position], 0)
        if depth == 0:
            return position
    raise ValueError("braces that do not match")


def _is_lambda(code: str, closing: int) -> bool:
    """Whether the parameters that end at `closing` are those of a lambda."""
    depth = 0
    for position in range(closing, -1, -1):
        depth += {")": 1, "(": -1}.get(code[position], 0)
        if depth == 0:
            return code[:position].rstrip().endswith("]")
    return False


PAGES = {"commands": command_line, "python": python_api, "cpp": cpp_api}

if __name__ == "__main__":
    chosen = argparse.ArgumentParser(description=__doc__)
    chosen.add_argument("page", choices=PAGES)
    sys.stdout.write(PAGES[chosen.parse_args().page]())
