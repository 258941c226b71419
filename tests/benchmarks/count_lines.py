"""Code lines (no comments, docstrings or blank lines) of each folder, and what they are.

    python tests/benchmarks/count_lines.py [FOLDER ...]
    python tests/benchmarks/count_lines.py --since ebc7d42     those of files that came since a commit, told from others

A file came since a commit where git finds none there that at least three tenths of it were renamed or copied from.
"""

import argparse
import ast
import io
import subprocess
import tokenize
from collections import Counter
from pathlib import Path

SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(text: str) -> set[int]:
    """Numbers of the lines of a file that hold code; a string that stands alone is a docstring."""
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        for inner in node.body if isinstance(node, DOCUMENTED) else ():
            if (
                isinstance(inner, ast.Expr)
                and isinstance(inner.value, ast.Constant)
                and isinstance(inner.value.value, str)
            ):
                lines -= _span(inner)
    return lines


def _span(first: ast.stmt, last: ast.stmt | None = None) -> set[int]:
    """Lines of a statement, from its decorators on; of a definition up to before a statement in it."""
    start = min([first.lineno, *(one.lineno for one in getattr(first, "decorator_list", ()))])
    return set(range(start, max(first.lineno + 1, last.lineno) if last else (first.end_lineno or start) + 1))


def kinds_of(text: str) -> Counter[str]:
    """How many of the lines that hold code are imports, signatures, fields of classes, tables, refusals, the rest."""
    tree, rest, found = ast.parse(text), code_lines(text), Counter[str]()
    parts: dict[str, list[set[int]]] = {"imports": [], "signatures": [], "classes and fields": [], "refusals": []}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            parts["imports"].append(_span(node))
        elif isinstance(node, ast.FunctionDef):
            parts["signatures"].append(_span(node, node.body[0]))
        elif isinstance(node, ast.ClassDef):
            fields = [_span(one) for one in node.body if isinstance(one, ast.AnnAssign | ast.Assign)]
            parts["classes and fields"] += [_span(node, node.body[0]), *fields]
        elif isinstance(node, ast.Raise):
            parts["refusals"].append(_span(node))
    parts["tables and constants"] = [_span(one) for one in tree.body if isinstance(one, ast.Assign | ast.AnnAssign)]
    for kind, spans in parts.items():
        own = rest & set().union(*spans)
        found[kind], rest = len(own), rest - own
    found["statements"] = len(rest)
    return found


def new_files(root: Path, since: str) -> set[Path]:
    """Files of a folder that are of none that were there at a commit."""
    command = ["git", "diff", "-M30%", "-C30%", "-l3000", "--relative", "--diff-filter=A", "--name-only", since, "."]
    told = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout
    return {root / name for name in told.split("\n") if name.endswith(".py")}


def table(root: Path, paths: list[Path]) -> None:
    """Print code lines and files of each folder, two levels deep, and of all, and what the lines are."""
    lines: Counter[str] = Counter()
    files: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for path in paths:
        parts, text = path.relative_to(root).parts, path.read_text("utf8")
        kinds += kinds_of(text)
        for room in {".", parts[0], "/".join(parts[:2]) if len(parts) > 2 else parts[0]}:
            lines[room] += len(code_lines(text))
            files[room] += 1
    for room in sorted(lines):
        print(f"{lines[room]:7d} lines {files[room]:4d} files  {root.name}/{room}")
    print(", ".join(f"{count} {kind}" for kind, count in kinds.most_common()))


def main() -> None:
    """Print the tables of some folders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path, default=[Path(__file__).parents[2] / "femprep"])
    parser.add_argument("--since", help="a commit")
    given = parser.parse_args()
    for root in given.folders:
        paths = sorted(root.rglob("*.py"))
        if given.since:
            new = new_files(root, given.since)
            print(f"in files that were there, or are of such, at {given.since}:")
            table(root, [path for path in paths if path not in new])
            print("in files that came since:")
            paths = [path for path in paths if path in new]
        table(root, paths)


if __name__ == "__main__":
    main()
