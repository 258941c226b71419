"""What examples/README.md and the page of figures say of the examples is there."""

from __future__ import annotations

import re
from pathlib import Path

EXAMPLES = Path(__file__).parent.parent / "examples"
TEXT = (EXAMPLES / "README.md").read_text()
FIGURES = (EXAMPLES.parent / "docs" / "figures.md").read_text()


def test_every_example_has_a_line_a_section_and_a_test() -> None:
    scripts = sorted(EXAMPLES.glob("[0-9]*.py"))
    sections = re.split(r"^## ", FIGURES, flags=re.MULTILINE)[1:]
    assert [script.name for script in scripts] == [re.findall(r"examples/(\w+\.py)", text)[0] for text in sections]
    here = Path(__file__).parent
    tests = "".join(path.read_text() for path in (*here.glob("test_examples_*.py"), *here.glob("solvers/test_*.py")))
    for script in scripts:
        assert f"python examples/{script.name}" in FIGURES
        assert f"]({script.name})" in TEXT
        assert script.name in tests


def test_every_link_leads_somewhere_and_every_picture_is_shown() -> None:
    links = [link for link in re.findall(r"\]\(([^)]+)\)", TEXT) if not link.startswith("http")]
    assert len(links) >= 8
    for link in links:
        assert (EXAMPLES / link).is_file(), link
    assert set(re.findall(r"\]\(\.\./examples/pictures/([^)]+)\)", FIGURES)) == {
        path.name for path in (EXAMPLES / "pictures").glob("*.png")
    }
