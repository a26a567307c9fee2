"""Contradictions and gaps in the paper; public in `bayestouch.paper.published`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Note:
    """A statement of the paper that its own numbers or equations contradict, or that is incomplete."""

    where: str
    printed: str
    finding: str

    def __str__(self) -> str:
        return f"{self.where}: {self.printed}. {self.finding}"


NOTES: tuple[Note, ...] = (
    Note(
        "Appendix A, equation (8)",
        "(1/r_b + 1/r_c) under the root",
        "It must be the inverse, R: only then is θ_w an angle and does the pressure of (7) integrate to P. "
        "Equations (7) and (9) are right as printed.",
    ),
    Note(
        "Section 3.1",
        "noise of 0.5 % and of 0.4 % of the peak strain, so a fitting error of 0.9 %",
        "The sum is linear; independent noise adds in quadrature, to 0.64 %. The mean error of 2.16 % is "
        "then 3.4 times the noise, not twice.",
    ),
    Note(
        "Table 1",
        "14 elements in the text, 16 in the caption",
        "The paper does not say which; two elements may have been left out of the fits.",
    ),
    Note(
        "Section 3.1",
        "average errors of 4.2 % and 2.2 % strain",
        "Every other error is in % of the peak strain, and a strain of 4.2 % is itself of the size of a "
        "peak; % of the peak is meant.",
    ),
    Note(
        "Section 3.2",
        "1.41 % against 2.16 % of the peak strain",
        "The first is over 180° of touches, the second over 50° about the element, so their ratio is not the "
        "gain of one calibration over the other on the same touches.",
    ),
    Note(
        "Table 3",
        "a row for r_c = 0.50 mm",
        "The round tips start at 1.59 mm; the row may be the 90° corner, which the paper does not say.",
    ),
    Note(
        "Table 4",
        "total, location and noise",
        "Location and noise add in quadrature to the total, within the rounding of the print, for θ_c in "
        "both calibrations and for P in the empirical one. The printed total is too small by more than "
        "rounding explains for P model based (13.23 against 13.1 N/m) and for R (1.274 against 1.26 mm model "
        "based, 0.976 against 0.96 mm empirical).",
    ),
    Note(
        "Section 4",
        "contact location error is 1/25 of the sensor spacing",
        "The 0.24° of Table 4 are 0.053 mm at the surface, 1/29 of 1.52 mm, and 1/37 at r_s = 9.9 mm; the "
        "fraction is rounded to the cautious side.",
    ),
    Note(
        "Section 4",
        "with only the sensor noise the standard deviation is halved",
        "Table 4 has 0.14° against 0.24°, a factor of 0.58.",
    ),
    Note(
        "Section 4",
        "a standard deviation of 5 % of the applied load",
        "That is the noise row (9.6 and 9.8 of 200 N/m); the totals are 6.6 % and 5.9 %.",
    ),
    Note(
        "Section 4",
        "radii that differ by 1.5 mm are distinguishable at a 95 % level",
        "This is 2 × 0.77 mm, the error of one estimate. The difference of two estimates has √2 times the "
        "standard deviation: 1.5 mm is then 1.4 standard deviations (83 %), and 95 % needs 2.1 mm.",
    ),
    Note(
        "Section 4",
        "for r_c = r_b the standard deviation in r_c is twice that of R",
        "From 1/R = 1/r_b + 1/r_c, dr_c/dR = (r_c/R)², which is 4 at r_c = r_b.",
    ),
    Note(
        "Figure 2",
        "-40 dB cut-offs at 4.5 and 25 cycles/radian",
        "Cycles/radian is k/2π for the mode cos kθ; the sensing radii of the curves are not printed.",
    ),
    Note(
        "Whole paper",
        "no shear modulus, no number of Fourier coefficients",
        "Neither μ nor n_c is printed anywhere, so both have to be inferred or chosen, and said.",
    ),
)
