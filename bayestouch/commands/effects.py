"""bayestouch effects."""

from __future__ import annotations

from typing import Any

import click

from bayestouch.commands.options import spoken
from bayestouch.commands.output import say


@click.command(short_help="List the effects that diagnose can find.")
@click.argument("name", required=False)
@spoken
def effects(name: str | None, quiet: bool, as_json: bool) -> None:
    """List the effects that diagnose can find, by stage of the chain; with NAME describe one effect.

    \b
    Example: bayestouch effects crosstalk
    """
    from bayestouch.effects.listing import effect_facts, listing

    if name is None:
        rows = listing()
        width = max(len(row["name"]) for row in rows)
        lines = [f"\n  {row['stage']:8} {row['name']:{width}}  {row['summary']}" for row in rows]
        say("".join(lines), {"effects": rows}, head=f"{len(rows)} effects", quiet=quiet, as_json=as_json)
        return
    facts: dict[str, Any] = effect_facts(name)
    lines = [f": {facts['summary']} (stage {facts['stage']})", "", facts["physics"]]
    for each in facts["parameters"]:
        null = "" if each["null"] is None else f"; {each['null']:g} does nothing"
        lines.append(f"  {each['name']}{' in ' + each['unit'] if each['unit'] else ''}: {each['description']}{null}")
    say("\n".join(lines), facts, head=name, quiet=quiet, as_json=as_json)
