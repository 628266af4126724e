"""Shows whether moods can be seen."""

from __future__ import annotations

from hobble.channels.mood.response.run import EFFECTS
from hobble.measures.given import Json
from hobble.report.charts import Chart
from hobble.report.gather import Material
from hobble.report.parts import Part, Section, Words

UNITS = {"speed": "m/s", "stride": "cm", "trunk": "° forward", "arms": "° of swing", "head": "° forward"}


def section(found: Json, material: Material) -> Section:
    """How often each mood is recognised and how much it changes the walk.

    Empty for a network without moods.
    """
    if not found.get("applies"):
        return Section("mood", [])
    shares = found["right_at_1"], found["captured"]["right"]
    right, left_out = (f"{100 * (share or 0):.0f} %" for share in shares)
    words = (
        f"A classifier trained on captured clips finds the right mood in {right} of the windows of generated "
        f"walks with a mood at 1, and in {left_out} of the windows of captured clips that it was not trained "
        f"on. All generated walks had the same three target speeds around "
        f"{found['speed_asked']:.2f} m/s."
    )
    charts = [effect_chart(found, effect) for effect in EFFECTS]
    parts = [Part(0, Words(words)), *(Part(10 + i, chart) for i, chart in enumerate(charts))]
    return Section("mood", parts, title="Moods", at=21)


def effect_chart(found: Json, effect: str) -> Chart:
    """One effect of all moods, captured and generated."""
    rows = [row for row in found["effects"] if row["effect"] == effect]
    of = (("captured", "captured", "@muted"), ("generated", "generated at 1", "@accent"))
    traces = [
        {
            "type": "bar",
            "name": label,
            "x": [row["mood"] for row in rows],
            "y": [row[key] for row in rows],
            "marker": {"color": colour},
        }
        for key, label, colour in (*of, ("generated_at_half", "generated at .5", "@predicted"))
    ]
    caption = f"How much each mood changes {effect} ({UNITS[effect]}), relative to the neutral walk."
    return Chart(
        f"mood-{effect}", effect.capitalize(), caption, traces, {"yaxis": {"title": UNITS[effect]}}, 260
    )
