"""Tables that studies put into the documentation."""

from __future__ import annotations

from pathlib import Path

DOCS = Path(__file__).parent.parent / "docs"


def write_between(mark: str, text: str, page: Path) -> None:
    """Put text between two equal comments of a page, in place of what is there."""
    head, *parts = page.read_text("utf-8").split(mark)
    if len(parts) != 2:
        raise LookupError(f"{page.name}: expected {mark} twice")
    page.write_text(f"{head}{mark}\n\n{text}\n\n{mark}{parts[1]}", "utf-8")


def put_into_page(script: str, table: str, name: str = "robustness.md") -> None:
    """Put a table between the comments of a script in a page of the documentation, in place of what is there."""
    path = DOCS / name
    begin, end = f"<!-- table of studies/{script} -->\n", f"<!-- end of studies/{script} -->"
    page = path.read_text("utf-8")
    before, _, rest = page.partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        raise LookupError(f"{name} has no place for {script}")
    path.write_text(f"{before}{begin}\n{table}\n{end}{after}", "utf-8")
