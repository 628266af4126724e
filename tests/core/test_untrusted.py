"""Files that may be hostile are read whole or not at all."""

from __future__ import annotations

import os

import pytest

from hobble.core import untrusted
from hobble.core.errors import InputError


@pytest.mark.parametrize("size_before", [2, 6])
def test_a_file_whose_size_changes_while_it_is_read_is_refused(tmp_path, monkeypatch, size_before):
    before, now = tmp_path / "before", tmp_path / "now"
    before.write_bytes(b"x" * size_before)
    now.write_bytes(b"x" * 4)
    assert untrusted.read_bytes(now, 10) == b"xxxx"
    monkeypatch.setattr(untrusted, "check_regular", lambda path: os.stat(before))
    with pytest.raises(InputError, match="now: its size changed while it was read"):
        untrusted.read_bytes(now, 10)
