"""Writes the exact JSON Schema of every event of the log into this folder: python docs/schemas/make.py."""

from __future__ import annotations

import json
from pathlib import Path

from recorders.mcap_io.channels import json_schema
from workbench.log_schema.events import TOPICS, schema_name


def main() -> None:
    for event_class in TOPICS.values():
        path = Path(__file__).parent / f"{schema_name(event_class)}.json"
        path.write_text(json.dumps(json_schema(event_class), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
