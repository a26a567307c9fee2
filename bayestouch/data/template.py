"""Template of a data set: `sensor.toml` with comments, and tables with a header and no rows."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

from bayestouch.data.dataset import dataset_files
from bayestouch.data.files import write_together
from bayestouch.data.geometry import BODIES, geometries
from bayestouch.data.tables import MAX_COLUMNS
from bayestouch.errors import InputError, nearest, require_whole

_SENSOR = """\
# The sensor as built. What is behind a # is a comment; take the # away from a line to use it.
name = {name}
body = "{body}"

{geometry}
[rubber]                    # nominal values, which calibration corrects; with none the priors are wide
# shear_modulus_MPa = 0.15
# poisson_ratio = 0.48

[readings]
# unit = "counts"
# quantity = "strain"

[source]                    # free text, carried into every report
# made_by = ""
# date = ""
"""


def new_dataset(folder: str | Path, *, body: str = "finger", elements: int = 8) -> tuple[Path, ...]:
    """Write a template of a data set: a ``sensor.toml`` with comments and empty tables to fill in.

    Parameters
    ----------
    folder : str or Path
        Created if necessary; the sensor gets its name.
    body : {"finger", "pad"}
    elements : int
        Number of elements; the tables have one column of readings for each, and at most 10,000 columns.

    Returns
    -------
    tuple of Path
        Files written: ``sensor.toml``, ``calibration.csv``, ``touches.csv``.

    Raises
    ------
    InputError
        The folder already contains one of these files, or cannot be written to; too many elements.

    Examples
    --------
    >>> import bayestouch
    >>> [path.name for path in bayestouch.new_dataset("my-sensor", elements=4)]
    ['sensor.toml', 'calibration.csv', 'touches.csv']
    """
    if body not in BODIES:
        raise InputError(f"body: expected {' or '.join(BODIES)}, got {body!r}{nearest(str(body), BODIES)}")
    require_whole("elements", elements, 1)
    kind, folder = geometries()[body], Path(folder)
    known = ("touch", "sample", "indenter_radius_mm", *kind.all_location_columns, kind.load_column)
    if elements > (most := MAX_COLUMNS - len(known)):
        raise InputError(f"elements: expected at most {most}, for tables of {MAX_COLUMNS} columns, got {elements}")
    columns = tuple(f"e{e + 1:02d}" for e in range(elements))
    header = (*known, *columns)
    texts = {
        folder / "sensor.toml": _sensor(folder.resolve().name, body, columns),
        folder / "calibration.csv": ",".join(header) + "\n",
        folder / "touches.csv": ",".join(header) + "\n",
    }
    for file in dataset_files(folder):
        if file.exists():
            raise InputError("exists already and is not replaced", file=file)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make this folder: {error.strerror or error}", file=folder) from error
    write_together({file: partial(_write, text) for file, text in texts.items()})
    return tuple(texts)


def _sensor(name: str, body: str, columns: tuple[str, ...]) -> str:
    geometry = geometries()[body].template.format(
        elements=len(columns), columns=columns[0] if len(columns) == 1 else f"{columns[0]} … {columns[-1]}"
    )
    # A JSON string is a TOML string too. A file name may hold bytes that are no text in UTF-8.
    in_utf8 = json.dumps(name, ensure_ascii=False).encode(errors="replace").decode()
    return _SENSOR.format(name=in_utf8, body=body, geometry=geometry)


def _write(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
