"""Play on a phone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

WIDTH, HEIGHT = 390, 844  # of a phone, CSS pixels
MORE_PARTS = """
  const add = (box, times) => {
    for (let i = 0; i < times; i++) box.append(box.lastElementChild.cloneNode(true));
  };
  add(document.querySelector("#gallery-cards"), 20);
  add(document.querySelector("#play-sliders"), 20);"""


@pytest.mark.slow
def test_play_on_a_phone_is_four_screens_high_however_many_parts_can_be_hurt(
    tab: Any, pictures: Path
) -> None:
    tab.send(
        "Emulation.setDeviceMetricsOverride", width=WIDTH, height=HEIGHT, deviceScaleFactor=1, mobile=True
    )
    tab.send("Emulation.setTouchEmulationEnabled", enabled=True)
    try:
        tab.run("location.hash = '#play'")
        tab.picture(pictures / "phone-play.png", "#play-page")
        size = "[document.documentElement.scrollHeight, document.documentElement.scrollWidth]"
        tab.run(f"(() => {{ {MORE_PARTS} }})()")
        high, wide = tab.run(size)
        assert wide == WIDTH
        assert high <= 4 * HEIGHT
    finally:
        tab.send("Emulation.clearDeviceMetricsOverride")
        tab.send("Emulation.setTouchEmulationEnabled", enabled=False)
