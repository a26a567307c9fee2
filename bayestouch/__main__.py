"""``python -m bayestouch``."""

from bayestouch.commands.cli import run

run()
