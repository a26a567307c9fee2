"""Calibrations that several tests of this folder read from file."""

from __future__ import annotations

import pytest
from calibrated_files import Calibrated, calibrated, calibrated_with_crosstalk


@pytest.fixture(scope="session")
def well_known(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    """Fifty touches of six samples: the posterior is normal to a per cent, and repeats fix the noise to 5 %."""
    return calibrated(tmp_path_factory.mktemp("well_known"), step=2.0, samples=6, draws=4000, seed=1)


@pytest.fixture(scope="session")
def hardly_known(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    """Twenty-six touches of two samples: readings of a long touch are known better than this calibration."""
    return calibrated(tmp_path_factory.mktemp("hardly_known"), step=4.0, samples=2, draws=2000, seed=1)


@pytest.fixture(scope="session")
def with_crosstalk(tmp_path_factory: pytest.TempPathFactory) -> Calibrated:
    """A finger with crosstalk, which its calibration states."""
    return calibrated_with_crosstalk(tmp_path_factory.mktemp("with_crosstalk"))
