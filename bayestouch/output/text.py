"""Numbers as text, in the same form in sentences and in tables."""

from __future__ import annotations

import math
from typing import Any


def number(value: Any, digits: int = 3) -> str:
    """Return a number as text with `digits` significant digits, a minus sign and, if readable, no exponent.

    None and values that are not finite become a dash; text is returned unchanged.
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    if value is None or not math.isfinite(value):
        return "–"
    if float(value).is_integer() and abs(value) < 1e6:
        return f"{int(value):d}".replace("-", "−")
    magnitude = math.floor(math.log10(abs(value)))
    if not -4 <= magnitude < 6:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    return fixed(value, max(digits - 1 - magnitude, 0))


def exact(value: Any) -> str:
    """Return a stated number as text with up to six significant digits and no added zeros."""
    return number(value) if isinstance(value, str) or value is None else f"{value:.6g}".replace("-", "−")


def fixed(value: Any, decimals: int) -> str:
    """Return a number as text with `decimals` decimals; zero has no minus sign."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


def in_form(value: float, form: str) -> str:
    """Return a number in a form with decimals, such as ``.2f``; with three digits, as in tables, if few would be left.

    An error has at least two digits. A bias, whose form has a sign, has at least one: it is compared with the error.
    """
    text = f"{value:{form}}"
    signed = form.startswith("+")
    if value == 0 or "." not in text or len(text.lstrip("+-0.")) > (0 if signed else 1):
        return text
    return f"{'+' if signed and value > 0 else ''}{number(value)}"


def percent(value: Any) -> str:
    """Return a percentage as text: without decimals from 10 up, otherwise with one."""
    return fixed(value, 0 if value is not None and abs(value) >= 10 else 1)


def plus_minus(mean: Any, sd: Any) -> str:
    """Return the text mean ± standard deviation: the sd has two significant digits, the mean the same decimals."""
    if mean is None or not math.isfinite(mean):
        return "–"
    if sd is None or not math.isfinite(sd) or sd <= 0:
        return number(mean, 4)
    decimals = min(max(1 - math.floor(math.log10(sd)), 0), 8)
    if abs(mean) >= 1e6 or decimals >= 7:
        return f"{number(mean, 4)} ± {number(sd, 2)}"
    return f"{fixed(mean, decimals)} ± {fixed(sd, decimals)}"


def plural(count: int, noun: str) -> str:
    """Return a count with its noun: ``1 touch``, ``2 touches``."""
    if count == 1:
        return f"1 {noun}"
    return f"{count} {noun}{'es' if noun.endswith(('ch', 'sh', 's', 'x')) else 's'}"


def those_with(count: int, noun: str) -> str:
    """Return a count with its noun and its verb: ``1 touch has``, ``2 touches have``."""
    return f"{plural(count, noun)} {'has' if count == 1 else 'have'}"


def ranging(low: float, high: float, digits: int = 3) -> str:
    """Return a range as text: ``from 1 to 2``, or ``1`` where both ends are the same text."""
    first, last = number(low, digits), number(high, digits)
    return first if first == last else f"from {first} to {last}"


def listed(parts: list[str]) -> str:
    """Return a list as text: ``a``, ``a and b``, ``a, b and c``."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
