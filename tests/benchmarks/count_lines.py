"""Code lines (no comments, docstrings or blank lines) of each folder: ``python count_lines.py [FOLDER ...]``."""

import ast
import io
import sys
import tokenize
from collections import Counter
from pathlib import Path

SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(path: Path) -> int:
    """Return how many lines of a file hold code; a string that stands alone is a docstring."""
    text = path.read_text("utf8")
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
                lines -= set(range(inner.lineno, (inner.end_lineno or inner.lineno) + 1))
    return len(lines)


def main() -> None:
    """Print code lines and files of each folder, two levels deep, and of all."""
    roots = [Path(name) for name in sys.argv[1:]] or [Path(__file__).parents[2] / "femprep"]
    for root in roots:
        lines: Counter[str] = Counter()
        files: Counter[str] = Counter()
        for path in sorted(root.rglob("*.py")):
            parts = path.relative_to(root).parts
            for room in {".", parts[0], "/".join(parts[:2]) if len(parts) > 2 else parts[0]}:
                lines[room] += code_lines(path)
                files[room] += 1
        for room in sorted(lines):
            print(f"{lines[room]:7d} lines {files[room]:4d} files  {root.name}/{room}")


if __name__ == "__main__":
    main()
