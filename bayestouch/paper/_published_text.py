"""Sentences of Nicolson and Fearing (1995) that contain numbers, as data for `bayestouch.paper.published`.

Each entry is (where, quote, numbers) and each number (key, as printed, unit[, value]); the value is given
only if the print is a word or a fraction.
"""

from __future__ import annotations

Number = tuple[str, str, str] | tuple[str, str, str, float]
Sentence = tuple[str, str, tuple[Number, ...]]

_FIGURE_7 = "r_a = 9.4 mm, r_s = 9.9 mm, r_b = 12.7 mm, Dielectric thickness 0.4 mm, Sensor spacing 1.52 mm."
_TABLE_4_CAPTION = "fitted for 40 touches at 1 degree intervals of 6 different indenter radii"

SENTENCES: tuple[Sentence, ...] = (
    (
        "Section 2.1",
        "that of a one pole low pass filter at 20 dB/decade",
        (("rolloff.displacement", "20", "dB/decade"),),
    ),
    (
        "Section 2.1",
        "the strain response decays much faster at more … than 100 dB/decade",
        (("rolloff.strain_at_least", "100", "dB/decade"),),
    ),
    (
        "Section 2.1",
        "deep, α = r_a/r_b = 0.70, and shallow, α = 0.90",
        (("alpha.deep", "0.70", "1"), ("alpha.shallow", "0.90", "1")),
    ),
    (
        "Section 2.1",
        "deep sensors have a -40 dB cut-off at 4.5 cycles/radian and shallow sensors have their cut-off at "
        "25 cycles/radian",
        (
            ("cutoff.level", "-40", "dB"),
            ("cutoff.deep", "4.5", "cycles/radian"),
            ("cutoff.shallow", "25", "cycles/radian"),
        ),
    ),
    ("Section 2.1", "Holding the load constant at 200 N/m", (("figure_3.load", "200", "N/m"),)),
    (
        "Figure 3, caption",
        "a fixed load (200 N/m) and varying r_c ∈ {0.5, 1.6, 3.9, 12.3, 25.3} mm",
        tuple((f"figure_3.r_c[{r}]", r, "mm") for r in ("0.5", "1.6", "3.9", "12.3", "25.3")),
    ),
    ("Section 2.1", "for 5 different indenter radii is shown in Figure 3", (("figure_3.n_radii", "5", "1"),)),
    (
        "Section 2.1",
        "At 3 cycles/radian the frequency responses are clearly different and should be distinguishable with "
        "α = 0.70 and a noise level at -40 dB.",
        (("figure_3.distinct_at", "3", "cycles/radian"), ("figure_3.noise_level", "-40", "dB")),
    ),
    (
        "Section 2.1",
        "can be distinguished at a 95 % level when the square root of the mean square error exceeds 2 "
        "standard deviations of the noise",
        (("figure_4.level", "95", "%"), ("figure_4.threshold", "2", "noise sd")),
    ),
    (
        "Section 2.1",
        "A noise plane is also shown at 2 standard deviations of the typical noise",
        (("figure_4.noise_plane", "2", "noise sd"),),
    ),
    (
        "Section 2.1",
        "For deep sensors with α = 0.70, flat and edge indenters can be distinguished with noise levels as "
        "high as 3.7 % of the peak strain.",
        (("figure_4.flat_from_edge_noise", "3.7", "% peak strain"),),
    ),
    ("Section 2.1", "If the noise is as low as 1 %", (("figure_4.low_noise", "1", "% peak strain"),)),
    (
        "Section 2.1",
        "deep sensors can distinguish an indenter with r_c/r_b = 0.16 from an edge indenter",
        (("figure_4.r_c_over_r_b", "0.16", "1"),),
    ),
    (
        "Figure 6, caption",
        "flat frictionless indenters with 2 mm and 4 mm contact widths",
        (("figure_6.narrow_width", "2", "mm"), ("figure_6.wide_width", "4", "mm")),
    ),
    (
        "Figure 7, caption",
        _FIGURE_7,
        (
            ("core_radius", "9.4", "mm"),
            ("sensing_radius", "9.9", "mm"),
            ("outer_radius", "12.7", "mm"),
            ("dielectric_thickness", "0.4", "mm"),
            ("spacing", "1.52", "mm"),
        ),
    ),
    (
        "Section 3",
        "round probe tips made from machinable wax with r_c varying from 1.59 mm to 25.25 mm",
        (("tips.smallest", "1.59", "mm"), ("tips.largest", "25.25", "mm")),
    ),
    (
        "Section 3",
        "In addition a 90° corner and a flat indenter were used.",
        (("tips.corner_angle", "90", "degree"),),
    ),
    ("Section 3", "All indenters had a length of 4 mm", (("tips.length", "4", "mm"),)),
    ("Section 3", "so that the 4 mm length was along the axis", (("tips.length_again", "4", "mm"),)),
    (
        "Section 3",
        "at 1° intervals with a load of 200 N/m",
        (("touches.interval", "1", "degree"), ("touches.load", "200", "N/m")),
    ),
    (
        "Section 3",
        "Both the tactile and force data were sampled 20 times at each point.",
        (("touches.n_samples", "20", "1"),),
    ),
    (
        "Section 3.1",
        "summary statistics of the parameter fits over 14 sensor elements",
        (("table_1.n_elements_text", "14", "1"),),
    ),
    (
        "Table 1, caption",
        "over the 16 elements of the circumferential array",
        (("table_1.n_elements_caption", "16", "1"),),
    ),
    (
        "Section 3.1",
        "The force sensor has a noise level equivalent to 0.5 % peak strain.",
        (("noise.force_sensor", "0.5", "% peak strain"),),
    ),
    (
        "Section 3.1",
        "has a standard deviation of 0.4 % peak strain so we expect a fitting error of 0.9 % peak strain",
        (("noise.averaged_readings", "0.4", "% peak strain"), ("noise.expected_fit", "0.9", "% peak strain")),
    ),
    (
        "Section 3.1",
        "on average the error is twice the noise level",
        (("noise.error_over_noise", "twice", "1", 2.0),),
    ),
    (
        "Section 3.1",
        "Use of a Hertz model resulted in an average error of 4.2 % strain while use of the frictionless "
        "contact model described in [11] resulted in an average error of 2.2 % strain.",
        (("flat_fit.hertz", "4.2", "% strain"), ("flat_fit.frictionless", "2.2", "% strain")),
    ),
    (
        "Section 3.2",
        "standard errors in the previous section were computed over a 50° range centered about the sensor",
        (("fit_range.model", "50", "degree"),),
    ),
    (
        "Section 3.2",
        "now computed over touches over the full 180° , is now 1.41 % of the peak strain, significantly less "
        "than the 2.16 % for the model-based fit",
        (
            ("fit_range.empirical", "180", "degree"),
            ("fit_error.empirical", "1.41", "% peak strain"),
            ("fit_error.model", "2.16", "% peak strain"),
        ),
    ),
    (
        "Section 3.2",
        "The model fitted E has a condition number of 2.7 and the empirical E has a condition number of 3.3.",
        (("condition_number.model", "2.7", "1"), ("condition_number.empirical", "3.3", "1")),
    ),
    (
        "Section 4",
        "typical execution time of 0.1 second on a Sparc 20 could be reduced to 0.04 second when total load",
        (("fit_time.without_load", "0.1", "s"), ("fit_time.with_load", "0.04", "s")),
    ),
    (
        "Section 4",
        "Table 3 gives the mean estimate of r_c over 40 degrees for 9 different indenters.",
        (("table_3.range", "40", "degree"), ("table_3.n_indenters", "9", "1")),
    ),
    (
        "Section 4",
        "unbiased estimate of r_c for indenters of radius 13 mm and less",
        (("table_3.unbiased_to", "13", "mm"),),
    ),
    (
        "Section 4",
        "computed over 20 samples each of 40 touches using 6 different indenter radii",
        (("table_4.n_samples", "20", "1"), ("table_4.n_touches", "40", "1"), ("table_4.n_radii", "6", "1")),
    ),
    (
        "Table 4, caption",
        _TABLE_4_CAPTION,
        (
            ("table_4.n_touches_caption", "40", "1"),
            ("table_4.interval_caption", "1", "degree"),
            ("table_4.n_radii_caption", "6", "1"),
        ),
    ),
    (
        "Section 4",
        "standard deviations of the errors in parameters fitted to 20 times averaged data",
        (("table_4.n_averaged", "20", "1"),),
    ),
    (
        "Section 4",
        "Contact location estimation error is very small, 1/25 th of the sensor spacing.",
        (("location_error.over_spacing", "1/25", "1", 1 / 25),),
    ),
    (
        "Section 4",
        "If we include only the sensor noise than the standard deviation is halved.",
        (("location_error.noise_part", "halved", "1", 0.5),),
    ),
    (
        "Section 4",
        "total load estimates are noisy, with a standard deviation of 5 % of the applied load",
        (("load_error.over_load", "5", "% of load"),),
    ),
    (
        "Section 4",
        "For r_c = r_b the standard deviation in r_c will be twice that for R .",
        (("radius_error.r_c_over_R", "twice", "1", 2.0),),
    ),
    (
        "Section 4",
        "The standard deviation in R due to noise is 0.77 mm, meaning that for small r_c indenters, radii "
        "differences of 1.5 mm should be distinguishable at a 95 % level at a fixed location.",
        (
            ("radius_error.noise", "0.77", "mm"),
            ("radius_error.distinguishable", "1.5", "mm"),
            ("radius_error.level", "95", "%"),
        ),
    ),
    (
        "Figure 12, caption",
        "Estimates of r_c for a 12.3 mm radius indenter.",
        (("figure_12.r_c", "12.3", "mm"),),
    ),
    (
        "Figure 12, caption",
        "the solid line is the fitted r_c to 20 times averaged data",
        (("figure_12.n_averaged", "20", "1"),),
    ),
    (
        "Figure 13, caption",
        "From lower to upper trace r_c = {0.5, 3.90, 6.01, 9.30, 12.30} mm.",
        tuple((f"figure_13.r_c[{r}]", r, "mm") for r in ("0.5", "3.90", "6.01", "9.30", "12.30")),
    ),
    (
        "Figure 13, caption",
        "using model-based (top) and empirical (bottom) calibration on 20 times averaged data",
        (("figure_13.n_averaged", "20", "1"),),
    ),
    (
        "Section 4",
        "Figure 13 shows r_c estimates for 5 different indenters as a function of location.",
        (("figure_13.n_radii", "5", "1"),),
    ),
    (
        "Section 5",
        "a precision of 1/25 th of the sensor spacing",
        (("location_error.over_spacing_conclusion", "1/25", "1", 1 / 25),),
    ),
    (
        "Section 5",
        "Using 20 times averaging and the empirical calibration R could be estimated with a standard "
        "deviation of 0.60 mm.",
        (("radius_error.n_averaged", "20", "1"), ("radius_error.averaged", "0.60", "mm")),
    ),
)
