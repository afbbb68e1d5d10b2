"""The colours of beliefs, the same in logs' viewer channels, dashboard, pages and figures.

They are those of matplotlib's magma, which is perceptually uniform, reversed and cropped to 0.03 to 0.80, so that
unlikely is pale and likely is deep on a light floor. They are listed here, so that a log's bytes depend on no release
of matplotlib.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from workbench.arrays import Uints8

_TABLE = np.frombuffer(
    bytes.fromhex(
        "fcf0b2fceeb0fcecaefcecaefdebacfde9aafde7a9fde5a7fde5a7fde3a5fde2a3fde0a1fde0a1fddea0fddc9efdda9c"
        "fed89afed89afed799fed597fed395fed395fed194fecf92fecd90fecc8ffecc8ffeca8dfec88cfec68afec68afec488"
        "fec287fec185fec185febf84febd82febb81feb97ffeb97ffeb77efeb67cfeb47bfeb47bfeb27afeb078feae77feac76"
        "feac76feaa74fea973fea772fea772fea571fea36ffea16efea16efe9f6dfe9d6cfd9b6bfd9a6afd9a6afd9869fd9668"
        "fd9467fd9467fd9266fc9065fc8e64fc8c63fc8c63fc8a62fc8961fb8761fb8761fb8560fb835ffa815ffa815ffa7f5e"
        "fa7d5ef97b5df9795df9795df9785df8765cf8745cf8745cf7725cf7705cf66e5cf66c5cf66c5cf56b5cf4695cf4675c"
        "f4675cf3655cf2645cf2625df2625df1605df05f5eef5d5eee5b5eee5b5eed5a5fec5860eb5760eb5760ea5661e95462"
        "e85362e75263e75263e55064e44f64e34e65e34e65e24d66e04c67df4a68df4a68de4968dc4869db476ad9466bd9466b"
        "d8456cd6456cd5446dd5446dd3436ed2426fd0416fcf4070cf4070cd4071cc3f71ca3e72ca3e72c83e73c73d73c53c74"
        "c53c74c43c75c23b75c03a76bf3a77bf3a77bd3977bc3978ba3878ba3878b83779b73779b5367ab3367ab3367ab2357b"
        "b0357bae347bae347bad347cab337caa337da8327da8327da6317da5317ea3307ea3307ea1307ea02f7f9e2f7f9e2f7f"
        "9c2e7f9b2e7f992d80982d80982d80962c80942c80932b80932b80912b81902a818e2a818c29818c29818b2981892881"
        "8827818827818627818426818326818326818125818025827e24827c23827c23827b2382792282782281782281762181"
        "752181732081721f81721f81701f816e1e816d1d816d1d816b1d816a1c81681c81681c81671b80651a80641a80621980"
        "6219806018805f187f5d177f5d177f5c167f5a167e59157e57157e57157e56147d54137d52137c52137c51127c4f127b"
        "4e117b4e117b4c117a4a1079491078471078471078451077440f76420f75420f75400f743f0f723d0f713b0f703b0f70"
    ),
    dtype=np.uint8,
).reshape(256, 3)


def belief_colours(share: npt.ArrayLike) -> Uints8:
    """Colours of beliefs given as fractions of the scale's top, shape (..., 3); out of range is clipped."""
    at = np.clip(np.nan_to_num(np.asarray(share, dtype=np.float64)), 0.0, 1.0)
    return _TABLE[np.round(at * 255).astype(np.intp)]
