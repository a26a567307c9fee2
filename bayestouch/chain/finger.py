"""The measuring chain of a cylindrical finger: readings from touches."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayestouch.array_types import FloatArray
from bayestouch.body.finite_strain import FiniteStrainResponse, FiniteStrainTable, check_tabulated_finger
from bayestouch.chain.element_weight import ElementWeight
from bayestouch.chain.response import ContactSpectra, ResponseTable, mode_strain
from bayestouch.chain.surface import Profile

# Values that neither the solved contact nor the table depends on, and values that only the contact does not depend on.
_NOT_IN_TABLES = {"response", "angle", "offset", "surface", "finite_strain"}
_OF_ELEMENTS = {"sensing_radius_mm", "element_weight", "friction"}


@dataclass(frozen=True, eq=False)
class FingerChain:
    """A finger with a value for every calibration parameter.

    Attributes
    ----------
    core_radius_mm, outer_radius_mm : float
        ``r_a`` and ``r_b``.
    response : (n_elements,) array
        Reading per N/m of a knife edge directly above the element. The data determine it better than the gain.
    sensing_radius_mm : (n_elements,) array
        ``r_s``.
    angle : (n_elements,) array
        ``θ_s``, rad.
    offset : (n_elements,) array
        Reading without touch.
    poisson_ratio, shear_modulus_MPa : float
        σ and μ of the rubber.
    largest_load : float
        Largest line load of the table, N/m.
    contact : str
        Name of the contact model.
    layer_share : float
        Fraction of the exact contact on the bonded layer in the pressure spectrum; the rest is from `contact`.
    element_weight : ElementWeight or None
        Weight with which the elements average along the arc; None if they are points.
    friction : float
        Friction under the indenter, see `bayestouch.chain.response.mode_strain`.
    finite_strain : float
        Fraction of `bayestouch.body.finite_strain` in `predict`: 0 linear, 1 neo-Hookean with projected strains.
    surface : Profile or None
        Departure of the outer surface from a circle of radius `outer_radius_mm`; None for a round one.
    """

    core_radius_mm: float
    outer_radius_mm: float
    response: FloatArray
    sensing_radius_mm: FloatArray
    angle: FloatArray
    offset: FloatArray
    poisson_ratio: float
    shear_modulus_MPa: float
    largest_load: float
    contact: str = "layer"
    layer_share: float = 0.0
    element_weight: ElementWeight | None = None
    friction: float = 0.0
    finite_strain: float = 0.0
    surface: Profile | None = None

    def __getstate__(self) -> dict[str, object]:
        """State for a worker process, without the tables: 13 MB that it computes in some hundredths of a second."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.response)

    @cached_property
    def spectra(self) -> ContactSpectra:
        """Pressure spectra and body solution at this Poisson's ratio."""

        def of(contact: str) -> ContactSpectra:
            return ContactSpectra.of(
                (self.core_radius_mm, self.outer_radius_mm),
                self.poisson_ratio,
                largest_kappa=self.largest_load / 1000 * self.outer_radius_mm / self.shear_modulus_MPa,
                largest_sensing_radius_mm=float(self.sensing_radius_mm.max()),
                contact=contact,
            )

        solved = of(self.contact)
        if not self.layer_share:
            return solved
        towards = of("layer").spectra - solved.spectra
        return replace(solved, spectra=solved.spectra + self.layer_share * towards)

    @cached_property
    def table(self) -> ResponseTable:
        """Table of the response of the elements over κ and angle."""
        return ResponseTable.of(
            self.spectra, self.sensing_radius_mm, element_weight=self.element_weight, friction=self.friction
        )

    @property
    def mode_strain(self) -> NDArray[np.complex128]:
        """Strain of each element per unit of each mode of the pressure, see `bayestouch.chain.response.mode_strain`."""
        return mode_strain(
            self.spectra.body, self.sensing_radius_mm, element_weight=self.element_weight, friction=self.friction
        )

    @cached_property
    def added_by_finite_strain(self) -> FiniteStrainResponse:
        """Nonlinear part of the response at ``finite_strain`` = 1; depths beyond the table use its limits."""
        check_tabulated_finger(self.core_radius_mm, self.outer_radius_mm)
        table = FiniteStrainTable.load()
        ends = table.sensing_radius_mm[[0, -1]]
        return table.for_elements(np.clip(self.sensing_radius_mm, *ends))

    @property
    def gain(self) -> FloatArray:
        """Reading per unit compressive strain (the inverse of the paper's ``G_ii``), shape (n_elements,)."""
        return self.response * 1000 * self.shear_modulus_MPa / self.table.peak_strain

    def effective_radius(self, radius_mm: ArrayLike, angle: ArrayLike) -> FloatArray:
        """Return the composite radius (...) in mm on the surface as it is, of touches of composite radius R (mm).

        R is that on a round surface; `angle` is the place touched, rad. They differ if the finger is out of round.
        """
        radius = np.asarray(radius_mm, dtype=float)
        return radius if self.surface is None else self.surface.effective_radius(radius, np.asarray(angle, dtype=float))

    def predict(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the expected readings under touches.

        Parameters
        ----------
        radius_mm : (...,) array_like
            Composite radius R in mm on a round surface: 0 a knife edge, ``r_b`` a flat.
        angle : (...,) array_like
            Contact location ``θ_c``, rad.
        load : (...,) array_like
            Line load P, N/m.

        Returns
        -------
        (..., n_elements) array
            Expected readings, in the sensor's unit.
        """
        return self.readings(self.table, self.response, radius_mm, angle, load)

    def readings(
        self, table: ResponseTable, response: FloatArray, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike
    ) -> FloatArray:
        """Return what `predict` does, with this contact but another table and `response` (n_elements,)."""
        load = np.asarray(load, dtype=float)
        kappa = load / 1000 * self.effective_radius(radius_mm, angle) / self.shear_modulus_MPa
        shape = table(kappa, self.angle - np.asarray(angle)[..., None])
        linear = np.asarray(self.offset + response * load[..., None] * shape)
        return linear + self.beyond_linear(radius_mm, angle, load) if self.finite_strain else linear

    def beyond_linear(self, radius_mm: ArrayLike, angle: ArrayLike, load: ArrayLike) -> FloatArray:
        """Return the part of the readings due to finite strain, (..., n_elements); parameters as in `predict`."""
        load = np.asarray(load, dtype=float)
        turn = self.angle - np.asarray(angle)[..., None]
        radius = self.effective_radius(radius_mm, angle)
        added = self.added_by_finite_strain(load / 1000 / self.shear_modulus_MPa, radius, turn)
        return np.asarray(self.finite_strain * self.response * load[..., None] * added)

    def with_(self, **changes: object) -> FingerChain:
        """Return the finger with some values changed; keeps the solved contact if the change does not affect it."""
        new = replace(self, **changes)  # type: ignore[arg-type]  # a wrong name raises an error in `replace`
        if set(changes) == {"surface"}:
            self.table  # noqa: B018  # compute it once for all surfaces
        kept: tuple[str, ...] = ()
        # Contacts depend on load and modulus by their ratio alone.
        pressed, as_before = (one.largest_load / one.shear_modulus_MPa for one in (new, self))
        same_contact = {*changes} == {"largest_load", "shear_modulus_MPa"} and math.isclose(pressed, as_before)
        if same_contact or {*changes} <= _NOT_IN_TABLES:
            kept = ("spectra", "table", "added_by_finite_strain")
        elif {*changes} <= _NOT_IN_TABLES | _OF_ELEMENTS:
            # The spectra end where the strain of the shallowest element does.
            deep_enough = float(new.sensing_radius_mm.max()) <= float(self.sensing_radius_mm.max()) + 1e-3
            kept = ("spectra",) if deep_enough else ()
        new.__dict__.update({name: self.__dict__[name] for name in kept if name in self.__dict__})
        return new
