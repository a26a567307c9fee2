"""The command line: all commands, errors in one line, exit status 0, 1, 2 or 130."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

import click

from bayestouch.commands.calibrate import calibrate
from bayestouch.commands.check import check
from bayestouch.commands.diagnose import diagnose
from bayestouch.commands.effects import effects
from bayestouch.commands.example import example
from bayestouch.commands.infer import infer
from bayestouch.commands.init import init
from bayestouch.commands.output import Interrupted, say_next_step
from bayestouch.commands.report import report
from bayestouch.commands.simulate import simulate
from bayestouch.errors import InputError
from bayestouch.version import __version__

STOPPED = 130  # exit status of a shell for a command ended by Ctrl-C


class Verbs(click.Group):
    """Group of commands, listed in the order of their use; Ctrl-C ends each with a message of one line."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted from None


@click.group(
    cls=Verbs,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="bayestouch")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Reliability of the readings of a tactile sensor, by Bayesian calibration.

    \b
    Start a data set:     bayestouch init my-finger
    Check its data:       bayestouch check my-finger
    Report reliability:   bayestouch report my-finger -o my-report

    Without a command it says what the folder that you are in holds, and the next step.
    """
    ctx.color = _colour()
    if ctx.invoked_subcommand is None:
        say_next_step(Path())


for verb in (init, check, calibrate, infer, diagnose, effects, report, simulate, example):
    cli.add_command(verb)


def _colour() -> bool | None:
    """False (no colours) with NO_COLOR (https://no-color.org); otherwise None: click uses colours on a terminal."""
    return False if os.environ.get("NO_COLOR") else None


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status: 0 done, 2 wrong input or options, 130 Ctrl-C, 1 other errors."""
    try:
        cli.main(args=arguments, prog_name="bayestouch", standalone_mode=False)
    except InputError as error:
        return _fail(str(error), 2)
    except Interrupted as stop:
        return _fail(str(stop), STOPPED)
    except OSError as error:
        # A path that may not be looked at; an error without a file is a fault of the package, and needs its traceback.
        if error.filename is None:
            raise
        return _fail(f"{error.filename}: {error.strerror or error}", 2)
    except MemoryError as error:
        much = f" ({error})" if str(error) else ""  # numpy says how much, Python does not
        return _fail(f"not enough memory{much}; ask for fewer --draws, or take a part of the data", 1)
    except click.ClickException as error:
        return _fail(" ".join([*error.format_message().split(), *_example(error)]), 2)
    except (click.Abort, KeyboardInterrupt):
        return _fail("stopped", STOPPED)
    return 0


def _example(error: click.ClickException) -> list[str]:
    """The example of the command whose arguments are wrong, from its help."""
    command = error.ctx.command if isinstance(error, click.UsageError) and error.ctx is not None else None
    found = re.search(r"^\s*(Example: .+)$", (command and command.help) or "", re.MULTILINE)
    return [found[1]] if found else []


def _fail(message: str, status: int) -> int:
    click.echo(f"{click.style('bayestouch:', fg='red', bold=True)} {message}", err=True, color=_colour())
    return status


def run() -> None:
    """Entry point of the console script."""
    sys.exit(main())
