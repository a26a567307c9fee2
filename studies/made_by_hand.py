"""What else a finger made by hand has: what the catalogue's effects take up of it, and what is distinct.

Properties that no effect of the catalogue is about, from the simulator of the tests (`tests/independent/shape.py`): a
core off centre, tips that are tilted along the finger or turned about their normal, tips of 4 mm, tips that stick. The
finger is calibrated with edges, flats and two round tips, hardly any noise, so that what is left is the property. For
each: its rms over the peak, what is left of it when gains, depths, angles and the rubber are fitted anew, and the share
of the sum of squares of this that each effect of the catalogue takes up, alone; the table has the largest shares.

    python studies/made_by_hand.py [FOLDER] [--small] [--only PROPERTY ...] [--docs]
    python studies/made_by_hand.py [--only PROPERTY ...] --diagnose

`--docs` writes the table of docs/made_by_hand.md. `--diagnose` prints what a diagnosis names, in place of the table.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _page import MADE_BY_HAND, markdown_table, put_into_page  # noqa: E402
from independent import shape  # noqa: E402
from independent.dataset import Simulated, write  # noqa: E402
from independent.effects import Effect  # noqa: E402
from independent.finger import SMALL, build, record  # noqa: E402
from independent.sizes import applied  # noqa: E402

import bayestouch  # noqa: E402
from bayestouch.data.dataset import DataSet, load_dataset  # noqa: E402
from bayestouch.effects import catalogue  # noqa: E402
from bayestouch.effects.kinds import of_chain  # noqa: E402
from bayestouch.finger.start import base_fit  # noqa: E402
from bayestouch.model.candidates import Candidate, score_effects  # noqa: E402
from bayestouch.model.fitting import Fitted  # noqa: E402
from bayestouch.model.joining import fit_with  # noqa: E402
from bayestouch.model.split_data import SplitData  # noqa: E402

#: Noise of a hundredth of a percent of the peak.
DESIGN = replace(
    SMALL, noise_sd=0.1, force_sd=0.01, samples=2, tips=(0.0, 6.01, 12.3, np.inf), tip_span=40.0, tip_step=4.0
)
PROPERTIES = {
    "surface_profile": "surface out of round, 0.0084 /mm rms",
    "core_off_centre": "core 0.2 mm off centre",
    "pitched_tip": "tips tilted along the finger, 5 N/m sd",
    "skewed_tip": "tips turned by 3° sd about the normal",
    "short_tip": "tips 4 mm long",
    "sticking_tip": "tips that stick",
}
#: Effects that are listed with the share they take up.
LISTED = 3


def measured(effect: Effect, seed: int) -> tuple[DataSet, float]:
    """A finger with the property as it is measured; rms of what the property changes, over the peak."""
    of_finger, of_plan, of_noise = (np.random.default_rng([seed, stream]) for stream in range(3))
    plain = record(DESIGN, build(DESIGN, of_finger), of_plan)
    recording = applied(plain, [(effect, effect.start)], seed)
    changed = (recording.signal - plain.pressed().signal) / recording.peak
    noise = DESIGN.noise_sd * of_noise.standard_normal(recording.signal.shape)
    loads = recording.read_load + DESIGN.force_sd * of_noise.standard_normal(len(recording.time))
    used = recording.touch < sum(recording.parts[:2])
    with tempfile.TemporaryDirectory() as folder:
        write(Simulated(DESIGN, recording, recording.signal + noise, loads, {}), Path(folder))
        return load_dataset(folder), float(np.sqrt(np.mean(changed[used] ** 2)))


def fitted(dataset: DataSet) -> tuple[Fitted, SplitData]:
    """The base model fitted to all touches."""
    data = SplitData.of(dataset)
    return base_fit(data.observations(data.training | data.held_out), dataset.sensor, "layer"), data


def left(each: Fitted) -> float:
    """Rms of the residuals of touch means, over the peak."""
    residual = each.model.known.means.readings - each.model.predict(each.vector).touches
    return float(np.sqrt(np.nanmean((residual / each.model.peak) ** 2)))


def row(effect: Effect, seed: int = 0) -> list[str]:
    """One line of the table."""
    dataset, changed = measured(effect, seed)
    base, data = fitted(dataset)
    known = of_chain(catalogue(data.setting("layer", base.model.reference_load)))
    taken = removed(base, score_effects(base, known))
    return [
        PROPERTIES[effect.name],
        f"{100 * changed:.2f}",
        f"{100 * left(base):.2f}",
        ", ".join(f"{name} {100 * share:.0f} %" for share, name in taken[:LISTED]),
    ]


def removed(base: Fitted, candidates: Sequence[Candidate]) -> list[tuple[float, str]]:
    """Share of the sum of squares that each effect removes when it is fitted alone, and its name; largest first.

    All are fitted, since the scores are linear: an effect that is fitted may remove far more than its score says.
    """
    taken, before = list[tuple[float, str]](), left(base)
    for candidate in candidates:
        new = fit_with(candidate.effect, base, lambda start=candidate.start: start).fitted
        taken.append((1 - (left(new) / before) ** 2, candidate.effect.name))
    return sorted(taken, reverse=True)


def of_names(names: list[str]) -> list[Effect]:
    """Properties of these names."""
    return [each for each in (*shape.EFFECTS, *shape.MADE_BY_HAND) if each.name in names]


def diagnosed(names: list[str], seed: int = 0) -> None:
    """Print what a diagnosis says of a finger with each property."""
    for effect in of_names(names):
        found = bayestouch.diagnose(measured(effect, seed)[0], draws=64, seed=seed)
        print(f"{PROPERTIES[effect.name]}: {found.verdict}, {', '.join(found.effects) or 'nothing named'}", flush=True)


def main(names: list[str]) -> str:
    """Print the table of some properties; returns it."""
    rows = []
    for effect in of_names(names):
        rows.append(row(effect))
        print(*rows[-1], sep=" | ", flush=True)
    head = ("changes readings by, % of the peak", "a fit leaves, % of the peak", "share that single effects remove")
    return markdown_table(("property", *head), rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", help="where the table goes")
    parser.add_argument("--small", action="store_true", help="two properties")
    parser.add_argument("--only", nargs="+", choices=PROPERTIES, default=list(PROPERTIES), help="these properties")
    parser.add_argument("--docs", action="store_true", help="write the table of docs/made_by_hand.md")
    parser.add_argument("--diagnose", action="store_true", help="print what a diagnosis names, in place of the table")
    options = parser.parse_args()
    names = options.only[:2] if options.small else options.only
    if options.diagnose:
        diagnosed(names)
        parser.exit()
    table = main(names)
    if options.folder is not None:
        options.folder.mkdir(parents=True, exist_ok=True)
        (options.folder / "made_by_hand.md").write_text(table, "utf-8")
    if options.docs:
        put_into_page("made_by_hand.py", table, MADE_BY_HAND)
