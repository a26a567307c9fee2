"""The text of docs/error_rates.md, around the tables of `_error_rate_page`."""

PAGE = """# Error rates of the diagnosis

How often `bayestouch diagnose` is right, on simulated fingers of which it knows nothing. The simulator
(`tests/independent`) shares no code with the package. Words such as held out, coverage, R, θ_c and P are in the
[glossary](glossary.md).

This is the *development study*. Its effects, forms and sizes were known while the catalogue and the search were
changed, and some of its formulas coincide with those of the catalogue ([](#which-formulas-the-effects-have)). The
[blind study](blind_study.md) has other formulas and other causes. They were written down before the code that it
examines was frozen. On 100 of 100 fingers without a cause it names nothing. Its other rates are lower: 76 % of single
effects are named first, and 75 % of unlisted causes are left unnamed.

The rates are in the first table below each heading with the name of a set of fingers. The *fresh* set is the fair one.
Its rows say:

- *No effect: `adequate`*: on a finger without a cause, the diagnosis named none. The other cases are false alarms.
- *Named first*: the simulated effect was the first that the diagnosis added. *Another effect named first*: it named a
  wrong cause.
- *Outside the catalogue: `unattributed`*: the catalogue does not have the cause, and the diagnosis said that no known
  effect explains the readings.

The table below it has the errors of touches that no fit has seen: *before*, with the calibration without effects, and
*after*, with what the diagnosis found. The column *no effect* is of fingers without an effect: noise alone makes these
errors.

{development}

This page is written by `studies/error_rates.py` from its results: {n} diagnoses of {fingers}. For each of these
fingers, up to four others without an effect were simulated. All results are of one version of the code, `{version}`:
the number of the release and a hash of the sources of the package and of the simulator. Results of another version
are not put beside them.

The *size* of an effect is the error that it makes in the mean readings of touches, relative to the noise of these
means. It is a root mean square, after the base parameters are fitted. The lack of fit is about 1 + size². Small fingers
have 8 elements, 175 touches that are fitted and 52 that are held out. Whole ones are as the practice fingers, with 16
elements, 468 touches that are fitted and 225 that are held out. Cases of a finger are run in random order, so that a
part of a run is a smaller study:

    python studies/error_rates.py -o FOLDER --small --light --fingers 2                    fingers 0 to 1
    python studies/error_rates.py -o FOLDER --small --light --fingers 2 --seeds-from 100   fingers 100 to 101
    python studies/error_rates.py -o FOLDER --light --seeds-from 100 --minutes 60          whole fingers, for an hour
    python studies/error_rates.py -o FOLDER --tables --docs docs/error_rates.md            this page

`--light` reads held-out touches only of effects of size 2, and of fingers without an effect. So the tables of errors
are of these. The last line of each block of text at the end of this page has the time of a diagnosis, in seconds.

An effect is hard to find if the noise hides it in all touches together. The size is relative to the noise of one touch.
But the diagnosis uses many touches. So an effect of size 0.5, the smallest of this study, is often found too: see the
row *all* of the tables at the end of this page. For smaller sizes this study says nothing. An effect is hard to
name where another effect changes the readings in the same way. If `bayestouch diagnose` calls two causes
indistinguishable, `measure` in its output says which touches would decide.

Terms of the tables:

- *How often*: number of cases in which it was so, of all such cases. *Interval*: of this rate. The *aim* is the rate
  that was set as a goal. Intervals are 95 % (Clopper and Pearson) and treat the cases as drawn from the effects, forms
  and sizes of the study. Cases of one finger share its touches, so the intervals are a little too narrow. The noise of
  readings is drawn anew for each case.
- *Out of reach*: to make an error of this size, the effect would need an absurd value. Such a case is not run. A
  diagnosis that failed counts as wrong.
- *Before*: the calibration without effects. *After*: with what the diagnosis found. Both are of the same held-out
  touches. *Against references as stated*: errors against the data set's own columns
  ([](diagnosis.md#references-that-a-diagnosis-moves)).
- *Bias*: without its sign, since biases of several fingers would cancel.
- *Adequate*: the verdict that nothing is missing. *Detected*: any other verdict. Names are those of
  [effects](effects.md).
- *Nothing is left that the test sees*: the verdict is "explained". *Lack of fit at most 1.1*: this limit does not
  allow for chance; the row "no effect" shows how often chance alone stays within it.
- *Excess*: the held-out lack of fit before, less 1. *Corrected* or *cut*: the share of the excess that is removed
  after.
- In the blocks of text `-` means that no case was run, and `nan` that no touches were read. The first table of a block
  has three columns for each size: how often the effect was detected, how often it was named first, and how often it was
  named first or declared indistinguishable from what was named.

## Which formulas the effects have

An effect of the simulator has the catalogue's name for its physical cause, and a formula of its own. Some formulas are
*members* of the catalogue's family: with plausible values of its parameters, the catalogue's formula gives the same
readings to 1 % (at size 2). `tests/simulator/test_forms.py` checks this, except for the forms of the noise, whose
formulas were compared by reading them. Rates of members and of other forms are listed separately. If the form is not a
member and the effect is large, the catalogue's formula may differ from the true one by more than the noise. Then the
verdict is "partly explained", and a correction describes a part of the rest.

The table compares with the catalogue of that version. [Looser forms](effects.md) came later and are not counted as
members: two and three waves a turn, an offset that changes with time, widths with exponential sides, free gain curves.

{forms}

## Causes outside the catalogue

Some fingers of the study have a cause that the catalogue does not have. A correct diagnosis is `unattributed`:

- `far_lobe`: the core bends, so that an element also reads a little of touches that are 45° away, on one side.
- `ripple`: the reading of an element changes in waves with the place of the touch, three waves within 20°.
- `distant_pair`: wires cross, so that two pairs of elements that are far apart leak into each other.
- `gear`: a wheel with 20 teeth turns the finger. It is cut unevenly, so the angle has an error that comes back with
  every tooth.
- `loose_patch`: under four elements the rubber has come off the core, and heavy touches press it back.
- `load_history`: a touch that is heavier than the touch before it reads more, and a lighter one less (hysteresis).

All but `load_history` depend only on the element, the place and the load. A correction can describe these.

{headlines}

```{{figure}} figures/error_rates_detection.png
Share of fingers in which an effect was detected and named, against its size.
```

```{{figure}} figures/error_rates_confusion.png
What was named first, for what was there (size 1 and above). Both figures are of {first}.
```

{tables}
"""

LOOKED_AT = """**Development set: fingers {fingers}.** They were looked at while the catalogue and the search were
changed, and some changes followed failures on these same cases: a memory with two exponentials, proximity together with
a drift of gains, and a loose patch. So the method was adjusted to these
data, and its rates on them may be too good."""

FRESH = """**Fresh: fingers {fingers}.** None of them was looked at while the catalogue and the search were changed. The
effects, their forms and their sizes are still those of the development set, on which some changes
followed failures: a memory with two exponentials, proximity together with a drift of gains, and a loose patch. For an
effect or a form that is not in this study the rates say nothing.

A cause that `bayestouch diagnose` names on your finger is as sure as these rates only if it is like one of the study.
So look at its evidence too: the errors of held-out touches before and after, and the causes that the data cannot
distinguish from it. A small effect is found more often with more touches and more samples of each, because its size
is relative to the noise of an averaged touch."""

SECTION = """## {Title}

| what | how often | interval | aim |
|---|---|---|---|
{rows}

{read}
"""

TABLES = """## Tables of the {title}

```text
{tables}
```
"""
