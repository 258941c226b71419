"""What the pages say runs, leads somewhere, and is all there is to say."""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import femprep
from femprep.cli._app import COMMANDS, load
from femprep.export.table import FORMATS, markdown_table

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "examples/README.md"))]

_BLOCK = re.compile(r"(?:<!-- (run|file)(?:: ([\w.]+))? -->\n)?```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"\]\(([^()\s]+(?:\([^()\s]*\)[^()\s]*)*)\)")


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def blocks(page: Path) -> list[tuple[str, str, str, str]]:
    """Mark, file name, language and text of each fenced block of a page."""
    return _BLOCK.findall(page.read_text(encoding="utf-8"))


def commands(page: Path) -> list[str]:
    """Every ``femprep ...`` line of a page's blocks."""
    lines = [
        line.removeprefix("$ ") for _, _, kind, text in blocks(page) if kind != "python" for line in text.split("\n")
    ]
    return [line for line in lines if line.startswith("femprep ")]


@pytest.fixture(scope="module")
def generate() -> ModuleType:
    spec = importlib.util.spec_from_file_location("docs_generate", DOCS / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", [page for page in PAGES if "```python" in page.read_text()], ids=name)
def test_python_of_a_page_compiles_and_uses_public_names(page: Path) -> None:
    for _, file, kind, text in blocks(page):
        if kind == "python":
            compile(text, file or name(page), "exec")
            assert set(re.findall(r"\bfp\.(\w+)", text)) <= set(femprep.__all__)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_names_of_the_api_on_a_page_are_public(page: Path) -> None:
    assert set(re.findall(r"`fp\.(\w+)", page.read_text())) <= set(femprep.__all__)


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=name)
def test_commands_of_a_page_are_those_of_the_command_line(page: Path) -> None:
    for line in commands(page):
        _, command, *arguments = shlex.split(line)
        # Parses every argument by the command's own grammar, and runs nothing.
        context = load(command).make_context(command, arguments)
        for value in context.params.get("format") or () if command == "mesh" else ():
            assert value in FORMATS


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    for link in _LINK.findall(re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)):
        if link.startswith("http"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.is_file(), f"{name(page)}: {link}"
        # What is generated has headings of its own, which MkDocs looks after.
        if anchor and "generated: options" not in target.read_text():
            assert anchor in {_slug(title) for title in re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE)}, (
                link
            )


def _slug(title: str) -> str:
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", title.lower()).strip())


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = re.findall(r"^ +- (?:\w+: )?(\S+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))


def test_files_that_pages_name_are_there() -> None:
    for page in PAGES:
        for file in re.findall(r"\b(?:examples|tests|docs|schemas)/[\w./-]+\.(?:py|png|md|json)\b", page.read_text()):
            assert (ROOT / file).is_file(), f"{name(page)}: {file}"


def test_nothing_that_is_generated_is_asked_for_in_vain_or_never(generate: ModuleType) -> None:
    asked = [
        mark
        for page in DOCS.rglob("*.md")
        for mark in re.findall(r"^<!-- generated: ([\w-]+) -->$", page.read_text(), re.M)
    ]
    assert sorted(asked) == sorted(generate.PARTS)


def test_options_formats_and_commands_are_those_of_the_code(generate: ModuleType) -> None:
    options, told = generate.options(), generate.commands()
    kinds = [getattr(femprep, name) for name in femprep.__all__ if name.endswith("Options")]
    assert len(kinds) == 13
    for kind in kinds:
        groups = [name for name in kind.model_fields if f"## `[{name}]`" in options]
        assert len(groups) == {"Options": 11, "AnnotateOptions": 3}.get(kind.__name__, 0)
        assert [name for name in kind.model_fields if name not in groups and f"| `{name}` |" not in options] == []
    assert markdown_table() == generate.fill("<!-- generated: formats -->")
    for command in COMMANDS:
        assert f"## femprep {command}\n" in told
        for param in load(command).params:
            assert all(f"`{flag}`" in told for flag in param.opts if flag.startswith("--"))


def test_exit_statuses_are_those_of_the_code(generate: ModuleType) -> None:
    rows = re.findall(r"^\| (\d+) \|(.*)\|$", generate.exit_statuses(), re.MULTILINE)
    assert [int(status) for status, _ in rows] == [0, 1, 2, 3, 130]
    for kind in (femprep.InputError, femprep.StageError, femprep.QualityError, femprep.DiskFullError):
        assert [f"`{kind.__name__}`" in text for _, text in rows].index(True) == kind.exit_status


def test_every_public_function_is_on_the_page_of_the_api(generate: ModuleType) -> None:
    shown = {line.rpartition(".")[2] for line in generate.api().splitlines() if line.startswith("::: ")}
    assert shown == {key for key in femprep.__all__ if callable(getattr(femprep, key))}


def test_signatures_on_the_page_of_the_api_name_every_option() -> None:
    griffe = pytest.importorskip("griffe")
    read = griffe.load("femprep.wall.planes.landmarks", extensions=griffe.load_extensions(DOCS / "signatures.py"))
    shown = {each.name: each.default for each in read["find_base"].parameters}
    asked = inspect.signature(femprep.find_base).parameters
    assert list(shown) == list(asked)
    assert shown["minimum_thickness"] == str(asked["minimum_thickness"].default)


def test_roles_and_modules_of_docstrings_are_no_text_of_pages(generate: ModuleType) -> None:
    html = generate.on_page_content("see :class:<code>~femprep.image.Grid</code>", None, None, None)
    assert html == "see <code>Grid</code>"


def test_a_page_that_asks_for_what_is_not_made_is_refused(generate: ModuleType) -> None:
    with pytest.raises(KeyError):
        generate.fill("<!-- generated: nothing -->")


def test_paths_of_the_house_are_there() -> None:
    for page in DOCS.rglob("*.md"):
        for path in re.findall(r"`(femprep/[\w/.]+)`", page.read_text()):
            assert (ROOT / path).exists(), f"{name(page)}: {path}"


def test_version_to_cite_is_that_of_the_package() -> None:
    assert f"\nversion: {femprep.__version__}\n" in (ROOT / "CITATION.cff").read_text()


@pytest.mark.slow
@pytest.mark.solver
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_tutorial_runs_as_printed(tmp_path: Path) -> None:
    here = Path(sys.executable).parent
    env = {**os.environ, "PATH": f"{here}{os.pathsep}{os.environ['PATH']}"}
    ran = []
    for mark, file, _, text in blocks(DOCS / "tutorial.md"):
        if mark == "file":
            (tmp_path / file).write_text(text)
        for line in text.splitlines() if mark == "run" else ():
            done = subprocess.run(
                line.removeprefix("$ "), shell=True, cwd=tmp_path, env=env, capture_output=True, text=True
            )
            assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
            ran.append(done.stdout)
    assert len(ran) == 5
    assert 2.0 < float(re.findall(r"greatest displacement ([\d.]+) mm", ran[-1])[0]) < 2.8
    assert (tmp_path / "heart" / "methods.bib").is_file()


@pytest.mark.slow
def test_pages_build_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocstrings")
    pytest.importorskip("material")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(
        build, cwd=ROOT, capture_output=True, text=True, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "reference" / "api.html").read_text()
    assert "Fit a closed, smooth surface" in page
    assert (tmp_path / "site" / "pictures" / "demo.png").is_file()
