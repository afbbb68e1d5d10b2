"""The special functions of the mixture's fit are scipy's."""

from __future__ import annotations

import numpy as np
from scipy import special

from workbench.beliefs import placement_mixture


def test_gamma_and_digamma_are_those_of_scipy() -> None:
    x = 10.0 ** np.linspace(-9, 4, 2000).reshape(2, 1000)
    np.testing.assert_allclose(placement_mixture._log_gamma(x), special.gammaln(x), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(placement_mixture._digamma(x), special.digamma(x), rtol=1e-12, atol=1e-12)
