"""Tables printed in the paper, for the report on the simulated finger of the package."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from bayestouch.paper.published import NOTES, TABLE_1, TABLE_2, TABLE_3, TABLE_4

SOURCE = (
    "E. J. Nicolson and R. S. Fearing, The Reliability of Curvature Estimates from Linear Elastic Tactile Sensors, 1995"
)
_QUANTITIES = {
    "sigma": "Poisson's ratio σ",
    "r_s": "sensing radius r_s",
    "error": "fitting error",
    "noise_level": "noise level of unaveraged data",
}


def published_tables() -> dict[str, Any]:
    """Tables 1 to 4 as printed, each row with its place in the paper, and notes on contradictions with the text."""

    def fits(table: str, rows: Any) -> list[dict[str, Any]]:
        return [
            {
                "where": f"Table {table}, row {number}",
                "quantity": _QUANTITIES[row.quantity],
                "unit": row.unit,
                "minimum": row.minimum,
                "average": row.average,
                "maximum": row.maximum,
            }
            for number, row in enumerate(rows, start=1)
        ]

    return {
        "source": SOURCE,
        "table_1": fits("1", TABLE_1),
        "table_2": fits("2", TABLE_2),
        "table_3": [{"where": f"Table 3, row {i}", **asdict(row)} for i, row in enumerate(TABLE_3, start=1)],
        "table_4": [{"where": f"Table 4, row {i}", **asdict(row)} for i, row in enumerate(TABLE_4, start=1)],
        "notes": [
            {"where": note.where, "printed": note.printed, "finding": note.finding}
            for note in NOTES
            if note.where.startswith("Table") or note.where.startswith("Section 4")
        ],
    }
