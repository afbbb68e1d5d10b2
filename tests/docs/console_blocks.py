"""Runs the console and Python blocks of a documentation page and compares what they print with what the page shows.

A block is ```console with lines "$ command" and, below each, what it prints; or ```python, a program of its own,
where `<!-- run: python -->` stands before it.
All blocks of a page run in order, in one folder that has `logs/`, `examples/` and `tools/` of the checkout in it, and
`procthor/` where the real houses are at hand. A comment before a block changes that:

    <!-- run: loose -->          the numbers that are printed change from run to run and are not compared
    <!-- run: exits 3 -->        the exit code that the last command must have
    <!-- run: serves -->         runs until it says an address, which is fetched; then it is stopped
    <!-- run: slow -->           too long for `make test`
    <!-- run: no, because ... -->

Printed lines are compared one by one; "..." stands for any text, alone on a line for any lines.

`python tests/docs/console_blocks.py PAGE...` runs pages and writes into them what their commands print.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from urllib.request import urlopen

ROOT = Path(__file__).resolve().parents[2]
PROCTHOR = Path(os.environ.get("LIOS_PROCTHOR", ROOT.parent / "shared" / "procthor"))
_BLOCK = re.compile(
    r"(?:<!-- run: (?P<how>[^>]*?) -->\n)?^```(?P<kind>console|python)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL
)
_NUMBER, _RULE = re.compile(r"[-+]?[0-9][0-9,]*(?:\.[0-9]+)?"), re.compile(r"([━─])\1+")
PATIENCE_S = 1200.0


@dataclass(kw_only=True)
class Command:
    """One command and what the page says that it prints."""

    text: str
    shown: list[str] = field(default_factory=list)


@dataclass(kw_only=True)
class Block:
    """One block of a page; `span` is where its body stands in the page."""

    kind: str
    how: tuple[str, ...]
    body: str
    span: tuple[int, int]
    commands: list[Command]

    @property
    def skipped(self) -> bool:
        return bool(self.how) and self.how[0] == "no"

    @property
    def exit_code(self) -> int:
        codes = [int(word.split()[1]) for word in self.how if word.startswith("exits ")]
        return codes[0] if codes else 0


def blocks_of(page: Path) -> list[Block]:
    """All runnable blocks of a page, in order."""
    found = []
    for match in _BLOCK.finditer(page.read_text(encoding="utf-8")):
        how = tuple(word.strip() for word in (match["how"] or "").split(",") if word.strip())
        if match["kind"] == "python" and "python" not in how:
            continue
        commands = _commands(match["body"]) if match["kind"] == "console" else []
        found.append(
            Block(kind=match["kind"], how=how, body=match["body"], span=match.span("body"), commands=commands)
        )
    return found


def _commands(body: str) -> list[Command]:
    found: list[Command] = []
    lines = iter(body.splitlines())
    for line in lines:
        if line.startswith("$ "):
            text = line[2:]
            while text.endswith("\\"):
                text += "\n" + next(lines)
            found.append(Command(text=text))
        elif found:
            found[-1].shown.append(line)
    return found


def is_slow(page: Path) -> bool:
    return any("slow" in block.how for block in blocks_of(page))


def needs_procthor(page: Path) -> bool:
    return any("procthor/" in block.body for block in blocks_of(page) if not block.skipped)


def prepare(folder: Path) -> None:
    """What a page finds in its folder."""
    for name in ("logs", "examples", "tools"):
        (folder / name).symlink_to(ROOT / name)
    if PROCTHOR.exists():
        (folder / "procthor").symlink_to(PROCTHOR)


def run_page(page: Path, folder: Path) -> list[str]:
    """Runs a page's blocks in a prepared folder; returns what is not as the page says."""
    wrong: list[str] = []
    for block in blocks_of(page):
        if block.skipped:
            continue
        if block.kind == "python":
            code, printed = _run([sys.executable, "-c", block.body], folder)
            if code:
                wrong.append(f"python block exits with {code}:\n{block.body}\n{printed}")
            continue
        for number, command in enumerate(block.commands):
            if "serves" in block.how:
                wrong += _serves(command.text, folder)
                continue
            code, printed = _run(["bash", "-c", command.text], folder)
            expected = block.exit_code if number == len(block.commands) - 1 else 0
            if code != expected:
                wrong.append(f"$ {command.text}\nexits with {code}, not {expected}:\n{printed}")
            else:
                wrong += [
                    f"$ {command.text}\ndoes not print: {line}\nbut:\n{printed}"
                    for line in missing(command, printed, loose="loose" in block.how)
                ]
    return wrong


def missing(command: Command, printed: str, *, loose: bool) -> list[str]:
    """Lines that the page shows and the command does not print; with `loose`, any number stands for any other."""
    actual = [_words(line, loose=loose) for line in printed.splitlines()]
    lacks = []
    for line in command.shown:
        words = _words(line, loose=loose)
        pattern = re.compile(".*".join(re.escape(part) for part in words.split("...")))
        if words and words != "..." and not any(pattern.fullmatch(other) for other in actual):
            lacks.append(line)
    return lacks


def _words(line: str, *, loose: bool) -> str:
    if loose:
        line = _RULE.sub(r"\1", _NUMBER.sub("0", line))
    return " ".join(line.split())


def environment() -> dict[str, str]:
    """As in a plain terminal of a hundred columns, with this environment's commands on the path."""
    scripts = str(Path(sys.executable).parent)
    plain = {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb", "PYTHONWARNINGS": "error", "MPLBACKEND": "agg"}
    return os.environ | plain | {"PATH": scripts + os.pathsep + os.environ.get("PATH", "")}


def _run(words: list[str], folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        words,
        cwd=folder,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    return done.returncode, done.stdout


def _serves(command: str, folder: Path) -> list[str]:
    """Starts what serves until it is stopped, on a free port, and fetches its page."""
    said = folder / ".said"
    with said.open("w", encoding="utf-8") as out:
        server = subprocess.Popen(
            ["bash", "-c", f"exec {command} --port 0"],
            cwd=folder,
            env=environment(),
            stdout=out,
            stderr=out,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    try:
        until = time.monotonic() + 120
        while time.monotonic() < until and server.poll() is None:
            found = re.search(r"http://[^\s()]+", said.read_text(encoding="utf-8"))
            if found:
                with urlopen(found[0].rstrip("."), timeout=30) as answer:
                    return [] if answer.status == 200 else [f"{found[0]} answers {answer.status}"]
            time.sleep(0.5)
        return [f"$ {command}\nserved nothing:\n{said.read_text(encoding='utf-8')}"]
    finally:
        if server.poll() is None:
            os.killpg(server.pid, signal.SIGTERM)
            server.wait(30)


def refill(page: Path, folder: Path) -> None:
    """Writes into a page what its commands print; "..." lines keep standing for what follows them."""
    page_text = page.read_text(encoding="utf-8")
    pieces, at = [], 0
    for block in blocks_of(page):
        if block.skipped or block.kind == "python" or "serves" in block.how:
            if not block.skipped:
                print(_python_of(block, folder))
            continue
        lines: list[str] = []
        for command in block.commands:
            code, printed = _run(["bash", "-c", command.text], folder)
            print(f"$ {command.text}\n{printed}[{code}]", flush=True)
            shown = [line.rstrip() for line in printed.rstrip().splitlines()]
            if "..." in command.shown:
                shown = [*shown[: command.shown.index("...")], "..."]
            lines += [f"$ {command.text}", *shown]
        pieces += [page_text[at : block.span[0]], "\n".join(lines) + "\n"]
        at = block.span[1]
    page.write_text("".join(pieces) + page_text[at:], encoding="utf-8")


def _python_of(block: Block, folder: Path) -> str:
    if block.kind == "python":
        return "{1}[{0}]".format(*_run([sys.executable, "-c", block.body], folder))
    return ""


if __name__ == "__main__":
    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory(prefix="lios-page-") as scratch:
            prepare(Path(scratch))
            refill(Path(name), Path(scratch))
