"""bayestouch simulate."""

from __future__ import annotations

from pathlib import Path

import click

from bayestouch.commands.options import OneOf, seeded, spoken
from bayestouch.commands.output import check_new_dataset, say
from bayestouch.data.geometry import BODIES
from bayestouch.errors import InputError
from bayestouch.output.progress import progress_bar


@click.command(short_help="Simulate a data set with known truth.")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Data set folder to write.")
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME=VALUE",
    help="Value of an effect's first parameter, or NAME.PARAMETER=VALUE; repeatable.",
)
@click.option("--body", type=OneOf(tuple(BODIES)), default="finger", show_default=True)
@seeded
@spoken
def simulate(output: Path, effects: tuple[str, ...], body: str, seed: int, quiet: bool, as_json: bool) -> None:
    """Simulate a data set with known truth, which is written to truth.json.

    \b
    Example: bayestouch simulate -o simulated-finger --effect crosstalk=0.04 --seed 3
    """
    from bayestouch.simulation import DESIGNS, save_simulated
    from bayestouch.simulation import simulate as simulate_dataset

    check_new_dataset(output)
    if body not in DESIGNS:
        raise InputError(f"--body: a {body} cannot be simulated; expected {' or '.join(DESIGNS)}")
    sizes = _effects(effects)
    with progress_bar("simulate", quiet) as advance:
        simulated = simulate_dataset(DESIGNS[body](), effects=sizes, seed=seed)
        save_simulated(simulated, output)
        advance(1.0)
    count = simulated.dataset.touches.n_touches
    facts = {"folder": str(output), "touches": count, "effects": sizes, "seed": seed}
    text = f": {count} touches, simulated with seed {seed}"
    say(text, facts, head=str(output), quiet=quiet, as_json=as_json)


def _effects(pairs: tuple[str, ...]) -> dict[str, float]:
    effects: dict[str, float] = {}
    for pair in pairs:
        name, separator, text = pair.partition("=")
        try:
            value = float(text)
        except ValueError:
            separator = ""
        if not separator or not name:
            raise InputError(f"--effect: expected NAME=VALUE with a number, got {pair!r}")
        if name in effects:
            raise InputError(f"--effect: {name} is given twice")
        effects[name] = value
    return effects
