"""Charts and tables of the measurements: each number of the JSON is in its place."""

from __future__ import annotations

from hobble.measures import injury as injury_page
from hobble.measures import responsivity as lap_charts
from hobble.report.gather import ReportMaterial
from hobble.report.parts import ChartGroup, ChartPair


def test_links_never_hurt_in_training_are_told_from_the_others(material: ReportMaterial) -> None:
    responses = [
        {**r, "trained": r["link"].startswith("Left")} for r in material.measurements["injury"]["responses"]
    ]
    rows = [
        {"link": link, "severity": v, "jog_from_healthy_cm": 0.1 * v}
        for link in {r["link"]: None for r in responses}
        for v in (5.0, 10.0)
    ]
    injury = {**material.measurements["injury"], "responses": responses, "into_a_jog": rows}
    parts = [part.content for part in injury_page.section(injury, material).parts]
    (curves,) = [content for content in parts if isinstance(content, ChartGroup)]
    overview, (_, into_a_jog) = [content.charts for content in parts if isinstance(content, ChartPair)]
    never = {"right shank", "lower back, part 1 of 2"}
    for chart in overview:
        hollow = [t for t in chart.traces if t["name"].endswith(", never hurt in training")]
        assert [set(t["y"]) for t in hollow] == [never, never]
        assert set(chart.layout["yaxis"]["categoryarray"][: len(never)]) == never
    marked = [o.endswith("(never hurt in training)") for o in curves.charts[0].options]
    assert marked == sorted(marked)
    assert sum(marked) == 2 * len(never)
    names = [trace["name"] for trace in into_a_jog.options["pose, cm per joint"]]
    assert not never & set(names)
    assert names[-1] == "never hurt in training"


def test_runs_are_drawn_over_the_track_in_red_where_they_left_it() -> None:
    track = {"x": [0.0, 10.0, 10.0], "z": [0.0, 0.0, 5.0], "gaits": ["walk", "jog", "crouch"]}
    near = {"lap": 1, "x": [0.0, 5.0], "z": [0.0, 0.1], "off_cm": [0.0, 10.0]}
    far = {"lap": 2, "x": [0.0, 5.0, 9.0], "z": [0.0, -2.0, 0.0], "off_cm": [0.0, 200.0, 3.0]}
    chart = lap_charts.track_chart({"track": track, "runs": [near, far]})
    assert chart is not None
    by_name = {trace["name"]: trace for trace in chart.traces}
    assert by_name["track"]["x"] == [0.0, 10.0, 10.0, 0.0], "it is closed"
    assert by_name["waypoints"]["text"] == ["0, walk", "1, jog", "2, crouch"]
    left = by_name["more than 100 cm off"]
    assert (left["x"], left["y"], left["customdata"]) == ([5.0], [-2.0], [[200.0, 2]])
    assert "On these laps, the largest distance from the track was 200 cm" in chart.caption
    kept = lap_charts.track_chart({"track": track, "runs": [near]})
    assert kept is not None
    assert "On these laps, the largest distance from the track was 10 cm" in kept.caption
    assert lap_charts.track_chart({"track": {"waypoints": 6}}) is None
