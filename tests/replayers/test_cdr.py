"""Only plain CDR passes: every other encapsulation is refused by its name."""

from __future__ import annotations

import pytest

from replayers.mcap_io.cdr import NotPlainCdr, require_plain_cdr


def test_every_first_byte_pair_but_two_is_refused() -> None:
    passed: list[int] = []
    for number in range(1 << 16):
        try:
            require_plain_cdr(number.to_bytes(2, "big") + b"\0\0")
        except NotPlainCdr as refused:
            named = f"{number:#06x}" in str(refused)
        else:
            named = passed.append(number) is None
        assert named, number
    assert passed == [0, 1]


def test_a_message_without_a_whole_head_is_refused() -> None:
    with pytest.raises(NotPlainCdr, match="3 bytes"):
        require_plain_cdr(b"\0\x01\0")
