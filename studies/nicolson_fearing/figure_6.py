"""Figure 6: pressure under flats with contacts 2 mm and 4 mm wide, by Hertz and with the rigid core.

At a given width the rigid core carries more load with a higher peak. The curves do not depend on the modulus.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import _path  # noqa: F401
import numpy as np
from _published import figure, options, print_beside, save
from scipy.optimize import brentq

from bayestouch.contact import HertzContact, LayerContact
from bayestouch.contact.hertz import pressure as hertz_pressure
from bayestouch.paper import published
from bayestouch.reliability import Beside
from nicolson_fearing.paper_finger import DESIGN

RADII = {"core_radius_mm": DESIGN.core_radius_mm, "outer_radius_mm": DESIGN.outer_radius_mm}
WIDTHS = ("narrow_width", "wide_width")
MODULUS = 1.0  # MPa; cancels


@dataclass(frozen=True)
class Contact:
    """A flat's contact of one width; pressures over the peak that Hertz predicts, loads over Hertz's.

    Attributes
    ----------
    width_mm : float
        Of the layer's contact.
    place_mm, hertz, layer : (n,) arrays
        Pressures across it.
    load_share, hertz_width_mm : float
        Load that the layer carries at this width over Hertz's, and Hertz's width at the layer's load.
    """

    width_mm: float
    place_mm: np.ndarray
    hertz: np.ndarray
    layer: np.ndarray
    load_share: float
    hertz_width_mm: float


def contact(width_mm: float) -> Contact:
    """Solve for the loads that give this width."""
    outer, sigma = DESIGN.outer_radius_mm, DESIGN.poisson_ratio
    layer, half_plane = LayerContact.for_body(*RADII.values(), sigma), HertzContact(outer, sigma)
    kappas = [
        brentq(lambda k, m=model: float(m.half_width(k)) - width_mm / 2, 1e-3, 100.0) for model in (layer, half_plane)
    ]
    place = np.linspace(-0.6, 0.6, 481) * width_mm
    theta, arc = place / outer, width_mm / outer
    by_hertz = hertz_pressure(
        theta,
        arc_rad=arc,
        indenter_radius_mm=np.inf,
        shear_modulus_MPa=MODULUS,
        outer_radius_mm=outer,
        poisson_ratio=sigma,
    )
    by_layer = layer.pressure(kappas[0], theta, load_N_per_mm=kappas[0] * MODULUS / outer)
    return Contact(
        width_mm=2 * float(layer.half_width(kappas[0])),
        place_mm=place,
        hertz=by_hertz / by_hertz.max(),
        layer=by_layer / by_hertz.max(),
        load_share=kappas[0] / kappas[1],
        hertz_width_mm=2 * float(half_plane.half_width(kappas[0])),
    )


def contacts() -> dict[str, Contact]:
    """Both widths."""
    return {name: contact(published.number(f"figure_6.{name}").value) for name in WIDTHS}


def rows(found: dict[str, Contact]) -> list[Beside]:
    """The widths: set, and what goes with them."""
    return [
        Beside(
            f"figure_6.{name}",
            each.width_mm,
            why=f"peak pressure {each.layer.max():.2f} and load {each.load_share:.2f} times those of a Hertz contact "
            f"of this width; by Hertz the contact of this load would be {each.hertz_width_mm:.2f} mm wide",
            put_in=True,
        )
        for name, each in found.items()
    ]


def picture(folder: Path, found: dict[str, Contact]) -> None:
    """Both pressures at both widths."""
    drawn, side = figure(figsize=(6.0, 4.0))
    for colour, each in zip(("C0", "C1"), found.values(), strict=True):
        side.plot(each.place_mm, each.hertz, "--", color=colour, label=f"Hertz, {each.width_mm:.0f} mm")
        side.plot(each.place_mm, each.layer, "-", color=colour, label=f"rigid core, {each.width_mm:.0f} mm")
        ends = [-each.width_mm / 2, each.width_mm / 2]
        side.plot(ends, [0, 0], "|", color=colour, ms=14, mew=1.5, clip_on=False, zorder=3)
    side.set(
        xlabel="place along the surface (mm)",
        ylabel="pressure over Hertz's peak",
        title="Figure 6: pressure under a flat",
    )
    side.set_ylim(0, None)
    side.legend(loc="lower center")
    save(drawn, folder, "figure_6")


def main(small: bool = False, folder: Path | None = None) -> list[Beside]:
    """Print the numbers and save the picture; small is the same."""
    found = contacts()
    out = rows(found)
    print_beside(out)
    if folder is not None:
        picture(folder, found)
    return out


if __name__ == "__main__":
    main(*options(__doc__))
