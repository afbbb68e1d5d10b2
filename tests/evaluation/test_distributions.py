"""Quantiles of the beta distribution and of Student's t are scipy's."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import special

from workbench.evaluation.distributions import beta_cdf, beta_quantile, student_quantile

SHAPES = st.floats(0.5, 500)


@given(st.floats(0, 1), SHAPES, SHAPES)
def test_the_beta_distribution_is_that_of_scipy(x: float, a: float, b: float) -> None:
    assert beta_cdf(x, a, b) == pytest.approx(float(special.betainc(a, b, x)), rel=1e-9, abs=1e-12)


@given(st.floats(0.001, 0.999), st.floats(1, 500), st.floats(1, 500))
def test_its_quantiles_are_those_of_scipy(p: float, a: float, b: float) -> None:
    assert beta_quantile(p, a, b) == pytest.approx(float(special.betaincinv(a, b, p)), rel=1e-9)


@given(st.floats(0.51, 0.9999), st.integers(1, 200))
def test_quantiles_of_t_are_those_of_scipy(p: float, degrees: int) -> None:
    assert student_quantile(p, degrees) == pytest.approx(float(special.stdtrit(degrees, p)), rel=1e-8)


def test_a_case_from_the_tables() -> None:
    """Student (1908): with one degree of freedom t is 12.706 at 97.5 %; the uniform distribution is beta(1, 1)."""
    assert student_quantile(0.975, 1) == pytest.approx(12.7062, abs=1e-4)
    assert beta_quantile(0.3, 1, 1) == pytest.approx(0.3)
