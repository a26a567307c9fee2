"""Pictures of docs/gallery.md: each made anew by its study, at full size.

    python studies/gallery.py [STUDY ...]

Without names all of them, which takes the better part of an hour of one core. Pictures of effects are made by
`effects_gallery.py`, those of error rates by `error_rates.py --docs`.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

STUDIES = Path(__file__).resolve().parent
FOLDER = STUDIES.parent / "docs" / "gallery"

_ONE_EACH = """
    figure_2 figure_3 figure_4 figure_6 figure_9 figure_10 figure_12 figure_13
    table_1 table_2 table_3 table_3_modulus table_3_residual table_3_tips table_3_widths table_3_diagnosis
    table_4 noise_row table_4_noise explained place_mixtures sweet_spot_causes condition_numbers
    distinguishability sweet_spots sweet_spots_of_places design_questions
    before_and_after empirical_calibration ridge pooling sbc_calibration
"""
#: Data sets of which there is a picture of the loop.
LOOPS = ("baro-line", "baro-line_one_rest_reading", "fluid-oil-1.5", "array8-soft")
#: Study: pictures of its that the gallery shows.
PICTURES: dict[str, tuple[str, ...]] = {
    **{name: (name,) for name in _ONE_EACH.split()},
    "finite_strain_table": ("finite_strain",),
    "measured_diagnosis": ("measured_diagnosis", *(f"loop_{name}" for name in LOOPS)),
    "measured_pads": tuple(f"measured_pads_{name}" for name in ("baro-line", "array8-soft", "fluid-oil-1.5")),
    "sbc_touches": tuple(f"sbc_touches_{method}_{n}" for method in ("emcee", "importance") for n in (1, 20)),
    "sweet_spots_measured": ("sweet_spots_array8-soft", "sweet_spots_baro-line"),
}


def script(study: str) -> Path:
    """The file of a study: here, or among those of the paper."""
    here = STUDIES / f"{study}.py"
    return here if here.exists() else STUDIES / "nicolson_fearing" / here.name


def make(study: str, folder: Path = FOLDER) -> None:
    """Run a study and keep its pictures.

    Raises
    ------
    subprocess.CalledProcessError
        The study failed.
    FileNotFoundError
        It made another picture than it is listed with: its data are absent.
    """
    with TemporaryDirectory() as new:
        subprocess.run([sys.executable, str(script(study)), new], check=True)
        for name in PICTURES[study]:
            shutil.copy(Path(new) / f"{name}.png", folder)


def main(studies: list[str]) -> None:
    """Make the pictures of these studies, or of all."""
    FOLDER.mkdir(exist_ok=True)
    for study in studies or PICTURES:
        start = perf_counter()
        print(f"== {study}", flush=True)
        make(study)
        print(f"== {study}: {perf_counter() - start:.0f} s", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("studies", nargs="*", metavar="STUDY", help=", ".join(PICTURES))
    chosen = parser.parse_args().studies
    if unknown := set(chosen) - set(PICTURES):
        parser.error(f"no study that has pictures: {', '.join(sorted(unknown))}")
    main(chosen)
