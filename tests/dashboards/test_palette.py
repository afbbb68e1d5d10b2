"""Colours stay apart for eyes of every kind, and no colour means two things.

Colour blindness by Machado, Oliveira and Fernandes, "A Physiologically-based Model for Simulation of Color Vision
Deficiency" (2009), severity 1; differences as distances in CIELAB (CIE 1976).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest

from dashboards.palette import FAILED, FOUND, GOAL, PHASES, RUNS, SEARCHED, Colour, linear_rgb, run_colour

EYES = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]]
    ),
}
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def _lab(colour: Colour, eye: str) -> np.ndarray:
    light = np.clip(EYES[eye] @ (linear_rgb(np.array(colour, dtype=np.uint8)) / 255), 0, 1)
    x = TO_XYZ @ light / WHITE
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def _nearest(colours: Sequence[Colour], eye: str) -> float:
    return min(float(np.linalg.norm(_lab(a, eye) - _lab(b, eye))) for a, b in combinations(colours, 2))


def _rgb(code: str) -> Colour:
    return (int(code[1:3], 16), int(code[3:5], 16), int(code[5:7], 16))


def test_black_and_white_are_a_hundred_apart() -> None:
    assert _nearest([(0, 0, 0), (255, 255, 255)], "all cones") == pytest.approx(100, abs=0.5)


@pytest.mark.parametrize("eye", list(EYES))
def test_runs_and_findings_are_told_apart(eye: str) -> None:
    assert _nearest(RUNS, eye) > 15
    assert min(_nearest([run, finding], eye) for run in RUNS for finding in (FOUND, GOAL)) > 15
    assert _nearest([FOUND, FAILED, GOAL, SEARCHED], eye) > 15


@pytest.mark.parametrize("eye", list(EYES))
def test_phases_are_one_hue_told_apart_by_lightness(eye: str) -> None:
    lightness = sorted(float(_lab(_rgb(code), eye)[0]) for code in PHASES.values())
    assert min(np.diff(lightness)) > 10


def test_no_colour_belongs_to_two_families() -> None:
    families = [set(RUNS), {_rgb(code) for code in PHASES.values()}, {FOUND, FAILED, GOAL, SEARCHED}]
    assert sum(len(family) for family in families) == len(set.union(*families))


def test_phases_have_no_hue_of_a_run() -> None:
    def chroma(colour: Colour) -> float:
        return float(np.hypot(*_lab(colour, "all cones")[1:]))

    assert max(chroma(_rgb(code)) for code in PHASES.values()) < min(chroma(run) for run in RUNS if run != RUNS[-1])


def test_after_the_last_colour_the_first_comes_again() -> None:
    assert run_colour(len(RUNS)) == RUNS[0]
