"""``python -m bayestouch``."""

from bayestouch.cli import run

run()
