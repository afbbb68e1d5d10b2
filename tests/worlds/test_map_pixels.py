"""Maps are read as ROS 2's map_server reads them, pixel by pixel.

The values of the table follow loadMapFromFile in nav2_map_server/src/map_io.cpp by hand, in two columns: until
navigation2's pull request 5071 of April 2025 (Humble, Iron, Jazzy), and since. A pixel's shade is the mean of its
colours, and since then its luma in 8 bits; its occupancy is 1 - shade, or shade when negate is set.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from workbench.errors import MalformedFile
from workbench.worlds.sites.map_pixels import (
    MapMode,
    PixelRules,
    cell_values,
    cell_values_since_2025,
    grey_pixels,
)
from workbench.worlds.sites.ros_map import read_map, read_survey_map

NEW, OLD = (0.65, 0.25), (0.65, 0.196)
"""occupied_thresh and free_thresh of today's savers and of map_saver in ROS 1."""

Row = tuple[str, object, MapMode, bool, tuple[float, float], int, int]
TABLE: list[Row] = [
    # 205 has an occupancy of 50/255 = 0.19608
    ("L", 205, "trinary", False, OLD, -1, -1),
    ("L", 205, "trinary", False, NEW, 0, 0),
    ("L", 0, "trinary", False, OLD, 100, 100),
    ("L", 254, "trinary", False, OLD, 0, 0),
    ("L", 254, "trinary", True, OLD, 100, 100),
    ("L", 0, "trinary", True, OLD, 0, 0),
    ("L", 51, "trinary", False, (0.8, 0.2), -1, 100),  # equals a threshold: 0.8 is occupied since 2025
    ("L", 204, "trinary", False, (0.8, 0.2), 0, 0),  # 1.0 - 0.8 is below 0.2 by a rounding
    ("L", 0, "trinary", False, (1.0, 0.2), -1, 100),  # 1.0 is not above 1.0
    ("L", 255, "trinary", False, (0.65, 0.0), -1, 0),
    ("RGB", (255, 0, 0), "trinary", False, OLD, 100, 100),  # occupancy 2/3; by luma 1 - 76/255 = 0.70
    ("RGB", (255, 255, 0), "trinary", False, OLD, -1, 0),  # 1/3; by luma 1 - 226/255 = 0.11
    ("RGB", (0, 255, 0), "trinary", False, OLD, 100, -1),  # 2/3; by luma 1 - 150/255 = 0.41
    ("RGB", (0, 0, 255), "trinary", False, OLD, 100, 100),
    ("RGBA", (0, 0, 0, 255), "trinary", False, (0.8, 0.25), -1, 100),  # alpha averaged in: 3/4; since, it is opaque
    ("RGBA", (255, 255, 255, 0), "trinary", False, (0.65, 0.25), -1, -1),  # occupancy 1/4; since, transparent
    ("RGBA", (255, 255, 255, 254), "trinary", False, OLD, 0, -1),
    ("RGBA", (0, 0, 0, 0), "trinary", False, OLD, 100, -1),
    ("LA", (255, 255), "trinary", False, OLD, 0, 0),
    ("1", 1, "trinary", False, OLD, 0, 0),
    ("I;16", 20, "trinary", False, OLD, 100, 100),  # 20 of 65535, nearly black
    ("I;16", 65535, "trinary", False, OLD, 0, 0),
    ("I;16", 52600, "trinary", False, OLD, -1, -1),  # occupancy 0.1974
    ("L", 128, "scale", False, (0.9, 0.1), 50, 50),  # (127/255 - 0.1) / 0.8 = 0.4975
    ("L", 205, "scale", False, OLD, 0, 0),  # (0.19608 - 0.196) / 0.454 rounds to 0
    ("L", 0, "scale", False, OLD, 100, 100),
    ("L", 0, "scale", True, OLD, 0, 0),
    ("LA", (255, 254), "scale", False, OLD, -1, -1),  # not wholly opaque
    ("LA", (0, 255), "scale", False, OLD, 100, 100),
    ("L", 0, "raw", False, OLD, 0, 0),
    ("L", 100, "raw", False, OLD, 100, 100),
    ("L", 101, "raw", False, OLD, -1, -1),
    ("L", 200, "raw", False, OLD, -1, -1),
    ("L", 255, "raw", False, OLD, -1, -1),
    ("L", 100, "raw", True, OLD, 100, 100),  # negate has no effect
    ("I;16", 100 * 257, "raw", False, OLD, 100, 100),
]


@pytest.mark.parametrize(("kind", "pixel", "mode", "negate", "thresholds", "value", "since_2025"), TABLE)
def test_a_pixel_has_the_value_that_map_server_gives_it(
    kind: str,
    pixel: object,
    mode: MapMode,
    negate: bool,
    thresholds: tuple[float, float],
    value: int,
    since_2025: int,
    tmp_path: Path,
) -> None:
    picture = Image.new(kind, (1, 1))
    picture.putpixel((0, 0), pixel)  # pyright: ignore[reportArgumentType]
    picture.save(tmp_path / "map.png")
    rules = PixelRules(mode=mode, negate=negate, occupied_thresh=thresholds[0], free_thresh=thresholds[1])
    with Image.open(tmp_path / "map.png") as read:
        assert cell_values(grey_pixels(read), rules).tolist() == [[value]]
        assert cell_values_since_2025(grey_pixels(read), rules).tolist() == [[since_2025]]


def test_cells_that_releases_read_differently_are_counted(tmp_path: Path) -> None:
    """One of six pixels is transparent: for an older map_server a bright grey, for a newer one unknown."""
    picture = Image.new("RGBA", (3, 2), (255, 255, 255, 255))
    picture.putpixel((1, 1), (255, 255, 255, 100))
    file = written(tmp_path)
    picture.save(tmp_path / "map.png")
    file.write_text(file.read_text().replace("map.pgm", "map.png"))
    assert read_survey_map(file).read_otherwise == 1
    assert read_survey_map(written(tmp_path)).read_otherwise == 0


def test_indexed_images_are_read_by_their_colours_not_their_indices(tmp_path: Path) -> None:
    picture = Image.new("P", (2, 1))
    picture.putpalette([255, 255, 255, 0, 0, 0])
    picture.putpixel((1, 0), 1)
    picture.save(tmp_path / "map.png")
    rules = PixelRules(mode="trinary", negate=False, occupied_thresh=0.65, free_thresh=0.196)
    with Image.open(tmp_path / "map.png") as read:
        assert read.mode == "P"
        assert cell_values(grey_pixels(read), rules).tolist() == [[0, 100]]


def written(folder: Path, **changes: str) -> Path:
    """A map of 2 rows and 3 columns: all free but the upper left pixel, at 1 m a cell."""
    pixels = bytes((0, 254, 254, 254, 254, 254))
    (folder / "map.pgm").write_bytes(b"P5\n3 2\n255\n" + pixels)
    fields = {"origin": "[10, 20, 0]", "negate": "0", "mode": "trinary", **changes}
    (folder / "map.yaml").write_text(
        "image: map.pgm\nresolution: 1.0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        + "".join(f"{name}: {value}\n" for name, value in fields.items())
    )
    return folder / "map.yaml"


@pytest.mark.parametrize("negate", ["1", "true", "True", '"1"'])
def test_negate_is_a_number_or_a_truth_value(negate: str, tmp_path: Path) -> None:
    assert read_map(written(tmp_path, negate=negate)).occupied.sum() == 5
    assert (
        read_map(written(tmp_path, negate=negate.lower().replace("1", "0").replace("true", "false"))).occupied.sum()
        == 1
    )


def test_unknown_modes_and_values_of_negate_are_refused(tmp_path: Path) -> None:
    assert read_map(written(tmp_path, mode="Scale")).occupied.sum() == 1
    with pytest.raises(MalformedFile, match="trinary, scale or raw"):
        read_map(written(tmp_path, mode="binary"))
    with pytest.raises(MalformedFile, match="negate 'perhaps'"):
        read_map(written(tmp_path, negate="perhaps"))


def test_a_map_turned_by_a_right_angle_lies_where_ros_puts_it(tmp_path: Path) -> None:
    """The occupied pixel is at x 0..1, y 1..2 of the image's own frame; turned by 90 degrees, at x -2..-1, y 0..1."""
    grid = read_map(written(tmp_path, origin="[10, 20, 1.5707963267948966]"))
    assert grid.occupied.shape == (3, 2)
    assert np.allclose(grid.origin, (8, 20))
    assert np.argwhere(grid.occupied).tolist() == [[0, 0]]


def test_a_map_turned_by_any_angle_keeps_its_cells_and_the_rest_is_unknown(tmp_path: Path) -> None:
    from math import cos, sin

    yaw = 0.5
    grid = read_map(written(tmp_path, origin=f"[10, 20, {yaw}]"))

    def at(x: float, y: float) -> bool:
        row, column = grid.cell_at((10 + cos(yaw) * x - sin(yaw) * y, 20 + sin(yaw) * x + cos(yaw) * y))
        return bool(grid.occupied[row, column])

    assert not at(1.5, 0.9)
    assert at(0.2, 1.8)
    assert grid.occupied[0, 0], "outside the image nothing was surveyed"
