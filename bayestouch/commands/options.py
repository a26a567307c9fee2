"""Options that several commands have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from bayestouch.errors import nearest

Command = TypeVar("Command", bound=Callable[..., Any])


class OneOf(click.Choice[str]):
    """Choice of an option; the message on a wrong name asks if the most similar one is meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Message on a wrong name."""
        said = super().get_invalid_choice_message(value, ctx)
        question = nearest(str(value), self.choices)
        return said.rstrip(".") + question if question else said


CONTACTS = OneOf(["layer", "hertz", "approximate frictionless"])
KERNELS = OneOf(["auto", "layer", "layer-line", "half-space", "half-space-line", "gaussian", "constant"])


def seeded(command: Command) -> Command:
    """Add `--seed` to a command that draws random numbers."""
    return click.option(
        "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of random numbers."
    )(command)


def grouped(command: Command) -> Command:
    """Add `--groups` to a command that writes a posterior file."""
    return click.option(
        "--groups",
        metavar="NAMES",
        default="",
        help="Further groups of the ArviZ schema to write: all, or some of log_likelihood, log_prior, prior, "
        "prior_predictive, posterior_predictive, with commas between them. [default: none]",
    )(command)


def clustered(command: Command) -> Command:
    """Add `--scheduler` to a command that can compute on a cluster."""
    return click.option(
        "--scheduler",
        metavar="ADDRESS",
        default=None,
        help="Scheduler of a Dask cluster for the computation, such as tcp://10.0.0.5:8786. [default: this machine]",
    )(command)


def spoken(command: Command) -> Command:
    """Add `--quiet` and `--json` to a command."""
    quiet = click.option("--quiet", is_flag=True, help="No progress and no summary.")
    as_json = click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
    return quiet(as_json(command))
