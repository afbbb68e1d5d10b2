"""People's votes for where objects belong (Housekeep, Kant et al. 2022), as shares over places in a weights file.

The source is a table with a row for each object, room and receptacle: how many of ten people called it tidy, untidy
or implausible to find the object there. What is kept are two shares for each object and place, and the vectors of
all names, so that other names can be compared with them.
"""

from __future__ import annotations

import csv
import gzip
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.arrays import Floats, Floats32
from workbench.beliefs.encoder import TextEncoder, generic_name, half_vectors, header_without_houses
from workbench.beliefs.weights import Weights, write_weights
from workbench.errors import FileMissing, MalformedFile

COLUMNS = ("object", "room", "receptacle", "tidy_votes", "untidy_votes", "implausible_votes")
MAX_ROWS = 1_000_000
SOURCE = "Housekeep (Kant et al. 2022), placements by people; MIT licence"


@dataclass(frozen=True, slots=True, kw_only=True)
class Votes:
    """Shares of votes.

    Attributes:
        objects: readable names, axis 0. rooms, receptacles: readable names of each place, axis 1.
        tidy, untidy: shares in [0, 1], shape (objects, places), read-only.
        names: all of these names, sorted. vectors: of these, float32, of length 1, shape (names, dimensions).
        encoder: the name of the text encoder that made the vectors.
    """

    objects: tuple[str, ...]
    rooms: tuple[str, ...]
    receptacles: tuple[str, ...]
    tidy: Floats
    untidy: Floats
    names: tuple[str, ...]
    vectors: Floats32
    encoder: str


def write_votes(table: Path, path: Path, encoder: TextEncoder) -> Weights:
    """Write the weights of the estimator `people` from a table of votes (.csv, .csv.gz).

    Raises:
        FileMissing, MalformedFile: no such table, or none of votes.
        NameNotShipped: a name cannot be encoded.
    """
    counts = {(o, r, c): votes for o, r, c, votes in _rows(table)}
    objects = sorted({key[0] for key in counts})
    places = sorted({key[1:] for key in counts})
    shares = np.zeros((2, len(objects), len(places)))
    for i, name in enumerate(objects):
        for j, place in enumerate(places):
            tidy, untidy, all_votes = counts.get((name, *place), (0.0, 0.0, 0.0))
            shares[:, i, j] = (tidy / all_votes, untidy / all_votes) if all_votes else 0.0
    names = sorted({*objects, *(name for place in places for name in place)})
    settings = {
        "objects": objects,
        "places": [" | ".join(place) for place in places],
        "names": names,
        "source": SOURCE,
    }
    tidy, untidy = shares.astype(np.float16)
    tensors = {"tidy": tidy, "untidy": untidy, "vectors": half_vectors(names, encoder)}
    return write_weights(path, header_without_houses("people", encoder, settings), tensors)


def votes_from(weights: Weights) -> Votes:
    """The votes of a weights file. Raises MalformedFile."""
    objects, places, names = weights.names("objects"), weights.names("places"), weights.names("names")
    split = [place.partition(" | ") for place in places]
    rooms, receptacles = tuple(s[0] for s in split), tuple(s[2] for s in split)
    if not {*objects, *rooms, *receptacles} <= set(names):
        raise MalformedFile(weights.path, "has objects or places without a vector", "Train it again with lios train")
    shares = [weights.tensor(name, len(objects), len(places)).astype(np.float64) for name in ("tidy", "untidy")]
    if any(share.min() < 0 or share.max() > 1 for share in shares):
        raise MalformedFile(weights.path, "has shares outside 0 to 1", "Train it again with lios train")
    for share in shares:
        share.flags.writeable = False
    return Votes(
        objects=objects,
        rooms=rooms,
        receptacles=receptacles,
        tidy=shares[0],
        untidy=shares[1],
        names=names,
        vectors=weights.tensor("vectors", len(names), None).astype(np.float32),
        encoder=weights.header.encoder,
    )


def _rows(path: Path) -> Iterator[tuple[str, str, str, tuple[float, float, float]]]:
    """Object, room and receptacle by their readable names, and (tidy, untidy, all) votes."""
    if not path.is_file():
        raise FileMissing(path)
    opened = gzip.open if path.suffix == ".gz" else open
    number = 1
    try:
        with opened(path, "rt", encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            if not set(COLUMNS) <= set(reader.fieldnames or ()):
                raise ValueError(f"its columns are not {', '.join(COLUMNS)}")
            for number, row in enumerate(reader, start=2):
                if number > MAX_ROWS:
                    raise ValueError(f"more than {MAX_ROWS} rows")
                tidy, untidy, implausible = (float(row[name]) for name in COLUMNS[3:])
                if not (min(tidy, untidy, implausible) >= 0 and tidy + untidy + implausible < float("inf")):
                    raise ValueError("votes that are not counts")
                object_name, room, receptacle = (generic_name(row[name]) for name in COLUMNS[:3])
                yield object_name, room, receptacle, (tidy, untidy, tidy + untidy + implausible)
    except (ValueError, TypeError, AttributeError, OSError, EOFError, csv.Error, zlib.error) as error:
        what = f"line {number} holds no votes ({error})"
        raise MalformedFile(path, what, f"Give a table with the columns {', '.join(COLUMNS)}") from None
    if number < 2:
        raise MalformedFile(path, "holds no votes", f"Give a table with the columns {', '.join(COLUMNS)}")
