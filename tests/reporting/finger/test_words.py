"""Sentences at the top of a finger's report, written out."""

from __future__ import annotations

from typing import Any

from bayestouch.reporting.finger.words import errors_and_limits, own_answers

LIMITS = {
    "distinguished_percent": 95.0,
    "told_from_edge_tried": True,
    "told_from_edge_r_c_mm": 3.18,
    "told_from_flat_tried": True,
    "told_from_flat_r_c_mm": 12.7,
    "told_from_edge_some": False,
    "told_from_flat_some": True,
}
NONE = {"n": 0, "bias": None, "sd": None, "rms": None}
LOAD = {"n": 5, "rms": 1.234, "rms_percent": 12.4, "unit": "N/m"}


def numbers(**changes: Any) -> dict[str, Any]:
    rows = [
        {"indenter": "edge", "R": {"rms": 0.3}},
        {"indenter": "3 mm", "R": {"rms": 0.1}},
        {"indenter": "flat", "R": {"rms": 0.5}},
    ]
    estimates: dict[str, Any] = {
        "overall": {
            "theta_c": {"n": 40, "rms": 0.512, "rms_mm": 0.113, "spacing": 10.0},
            "P": LOAD,
            "R": {"n": 40, "rms": 0.3456, "bias": -0.12, "sd": 0.34},
        },
        "posterior_sd": {"theta_c": 0.0456, "R": 0.789},
        "by_indenter": rows,
        "radius_limits": LIMITS,
    }
    places = {
        "best": {"angle_deg": 12.4, "R_error_mm": 0.123},
        "worst": {"angle_deg": -31.6, "R_error_mm": 4.56},
        "threshold_mm": {"lowest": 0.123, "highest": 0.456},
        "nowhere_percent": 0.0,
        "use_load": True,
    }
    return {"estimates": estimates | changes.pop("estimates", {}), "places": places | changes.pop("places", {})}


def test_errors() -> None:
    said, key = errors_and_limits(numbers())
    assert said == [
        "Location is read to 0.51° rms (0.11 mm along the surface, 1/20 of the element spacing) over 40 touches.",
        "Without help from the force sensor, load is read to 1.2 N/m rms (12 % of the mean load).",
        "The composite radius R (1/R = 1/r_b + 1/r_c) is read to 0.35 mm rms, by indenter from 0.10 mm (3 mm) to "
        "0.50 mm (flat).",
        "At 95 % of touches tips of r_c = 3.18 mm and blunter are distinguished from a knife edge and tips of "
        "r_c = 12.7 mm and sharper are distinguished from a flat.",
    ]
    assert [(row["quantity"], row["value"], row["unit"]) for row in key] == [
        ("location error, rms", 0.512, "degree"),
        ("load error, rms", 1.234, "N/m"),
        ("composite radius R error, rms", 0.3456, "mm"),
        ("distinguished from a knife edge", 3.18, "mm"),
        ("distinguished from a flat", 12.7, "mm"),
    ]
    assert key[2]["detail"] == "bias −0.12 mm, standard deviation 0.34 mm"
    assert key[4]["detail"] == "r_c and sharper, of the tips tried, at 95 % of touches"


def test_without_references() -> None:
    overall = {"theta_c": NONE, "P": NONE, "R": NONE}
    said, key = errors_and_limits(numbers(estimates={"overall": overall}))
    assert "knows the location of a typical touch to 0.046° (posterior standard deviation)" in said[0]
    assert (
        said[1].startswith("No load was measured") and "R is 0.79 mm at a typical touch" in said[2] and len(said) == 3
    )
    assert [row["value"] for row in key] == [0.0456, 0.789]


def test_limits_that_were_not_tried_or_not_met() -> None:
    estimates: dict[str, Any] = {"by_indenter": numbers()["estimates"]["by_indenter"][:1]}
    estimates["radius_limits"] = LIMITS | {"told_from_edge_r_c_mm": None, "told_from_flat_tried": False}
    said, key = errors_and_limits(numbers(estimates=estimates))
    assert said[-2].endswith("is read to 0.35 mm rms.")
    assert said[-1] == "At 95 % of touches no tip that was tried is distinguished from a knife edge." and len(key) == 4
    estimates["radius_limits"]["told_from_edge_some"] = True
    said, _ = errors_and_limits(numbers(estimates=estimates))
    assert said[-1] == (
        "At 95 % of touches the bluntest tip that was tried is not distinguished from a knife edge, though others are."
    )
    estimates["radius_limits"] = LIMITS | {"told_from_edge_tried": False, "told_from_flat_tried": False}
    said, _ = errors_and_limits(numbers(estimates=estimates))
    assert said[-1].startswith("There are no knife edges or flats beside round tips")


def test_where_and_down_to_which_radius() -> None:
    where, smallest = own_answers(numbers())
    assert where["short"] == "Best at θ = 12°, worst at −32°"
    assert "0.12 mm rms at the best location and 4.6 mm at the worst" in where["reason"]
    assert smallest["short"] == "r_c = 0.12 to 0.46 mm, depending on location"
    assert smallest["reason"] == (
        "Blunter tips are distinguished from a knife edge with 95 % probability (predicted). Of the tips tried, "
        "3.18 mm and blunter were."
    )
    places = {"threshold_mm": {"lowest": 0.123, "highest": 0.124}, "nowhere_percent": 12.4}
    untried = {"radius_limits": LIMITS | {"told_from_edge_tried": False}}
    smallest = own_answers(numbers(places=places, estimates=untried))[1]
    assert smallest["short"] == "r_c = 0.12 mm" and smallest["reason"].endswith(" At 12 % of locations nothing is.")
    nowhere = own_answers(numbers(places={"threshold_mm": {"lowest": None, "highest": None}}))[1]
    assert nowhere["short"] == "None" and nowhere["reason"].startswith(
        "Nowhere does one touch distinguish even a flat from a knife edge"
    )


def test_errors_are_of_touches_with_or_without_a_load() -> None:
    for used, word in ((True, "with"), (False, "without")):
        reason = own_answers(numbers(places={"use_load": used}))[0]["reason"]
        assert reason.startswith(
            f"Predicted from the calibration, for touches {word} a measured load: the error of R is "
        )
