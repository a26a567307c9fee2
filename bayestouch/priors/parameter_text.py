"""Conversion of parameters and their priors to JSON and back, for posterior files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from bayestouch.array_types import FloatArray
from bayestouch.errors import InputError, shown
from bayestouch.priors import parameters, radius
from bayestouch.priors.parameters import Parameter, Prior

_TEXTS = ("name", "symbol", "latex", "unit", "description")
# Attributes of priors that are no numbers: a word, and another prior.
_WORDS, _PRIORS = ("text", "quantity"), ("prior", "density")


@dataclass(frozen=True)
class PriorOfOtherCode:
    """A prior defined by code outside bayestouch; the file contains its description, but not its density."""

    text: str
    low: float
    high: float

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest allowed value."""
        return self.low, self.high

    def log_density(self, value: ArrayLike) -> FloatArray:
        """Raise an error, because the density is not known.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError(f"the density of the prior {self.text!r} is not in the file: other code defined it")

    def quantile(self, probability: ArrayLike) -> FloatArray:
        """Raise an error, because the density is not known (see `log_density`)."""
        return self.log_density(probability)

    def __str__(self) -> str:
        return self.text


def parameters_to_json(parameters: Iterable[Parameter]) -> str:
    """Return parameters as JSON; `parameters_from_json` returns the same parameters."""
    return json.dumps(
        [
            {name: getattr(one, name) for name in _TEXTS}
            | {"prior": _prior_to_plain(one.prior), "relative": one.relative}
            for one in parameters
        ],
        ensure_ascii=False,
    )


def parameters_from_json(text: str) -> tuple[Parameter, ...]:
    """Return the parameters that a JSON text describes.

    Raises
    ------
    InputError
        The text is not JSON of parameters, or a prior is impossible.
    """
    try:
        return tuple(
            Parameter(
                prior=_prior_from_plain(one["prior"]),
                # Files of 0.1.0 say it in the description alone.
                relative=bool(one.get("relative", "prior" in one["description"])),
                **{name: str(one[name]) for name in _TEXTS},
            )
            for one in json.loads(text)
        )
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, ArithmeticError, RecursionError):
        raise InputError(f"expected parameters as JSON, got {shown(text)}") from None


def _prior_to_plain(prior: Prior) -> dict[str, Any]:
    if _is_known(prior) and is_dataclass(prior):
        values = {field.name: getattr(prior, field.name) for field in fields(prior)}
        return {"kind": type(prior).__name__} | {name: _to_plain(name, value) for name, value in values.items()}
    low, high = prior.support
    return {
        "kind": "PriorOfOtherCode",
        "text": str(prior),
        "low": _number_to_plain(low),
        "high": _number_to_plain(high),
    }


def _prior_from_plain(plain: dict[str, Any]) -> Prior:
    values = {key: _from_plain(key, value) for key, value in plain.items() if key != "kind"}
    if plain["kind"] == "PriorOfOtherCode":
        return PriorOfOtherCode(**values)
    kind = _known(str(plain["kind"]))
    if kind is None:
        raise InputError(f"expected a prior that this version knows, got {shown(plain['kind'])}")
    return cast("Prior", kind(**values))


def _known(name: str) -> type | None:
    """Class of a prior of this package. A name comes from a file: nothing else may be called."""
    kind = getattr(parameters, name, getattr(radius, name, None))
    return kind if isinstance(kind, type) and is_dataclass(kind) and hasattr(kind, "log_density") else None


def _is_known(prior: Prior) -> bool:
    # A class of the same name from other code must not be read as a class of this package.
    inner = (getattr(prior, name, None) for name in _PRIORS)
    return _known(type(prior).__name__) is type(prior) and all(each is None or _is_known(each) for each in inner)


def _to_plain(name: str, value: Any) -> Any:
    if name in _WORDS or (name in _PRIORS and value is None):
        return value
    return _prior_to_plain(value) if name in _PRIORS else _number_to_plain(value)


def _from_plain(name: str, value: Any) -> Any:
    if name in _WORDS or (name in _PRIORS and value is None):
        return value
    return _prior_from_plain(value) if name in _PRIORS else _number_from_plain(value)


def _number_to_plain(value: Any) -> Any:
    """Number for JSON; infinities become text, because JSON has none."""
    if isinstance(value, tuple | list | np.ndarray):
        return [_number_to_plain(one) for one in value]
    number = float(value)
    return number if math.isfinite(number) else str(number)


def _number_from_plain(value: Any) -> Any:
    return tuple(_number_from_plain(one) for one in value) if isinstance(value, list) else float(value)
