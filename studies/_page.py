"""Tables that studies put into the documentation."""

from __future__ import annotations

from pathlib import Path

PAGE = Path(__file__).parent.parent / "docs" / "robustness.md"


def put_into_page(script: str, table: str) -> None:
    """Put a table between the comments of a script in ``docs/robustness.md``, in place of what is there."""
    begin, end = f"<!-- table of studies/{script} -->\n", f"<!-- end of studies/{script} -->"
    page = PAGE.read_text("utf-8")
    before, _, rest = page.partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        raise LookupError(f"{PAGE.name} has no place for {script}")
    PAGE.write_text(f"{before}{begin}\n{table}\n{end}{after}", "utf-8")
