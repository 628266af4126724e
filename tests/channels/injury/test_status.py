"""The status file: valid and invalid content, and writing and reading it without loss."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.channels.injury.status import InjurySpell, Status, read_status, write_status
from hobble.core.errors import InputError

LINKS = ("Hips-LHipJoint", "LeftUpLeg-LeftLeg", "RightUpLeg-RightLeg", "LeftShoulder-LeftArm")


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("", None, "empty"),
        ("1-5 LeftUpLeg-LeftLeg[3];\n", 1, "frame count"),
        ("frames:10\n1-5 LeftLeg-Moon[3];\n", 2, "no such link: LeftLeg-Moon"),
        ("frames:10\n1-5 LeftUpLeg-LeftLeg[11];\n", 2, "severity 11"),
        ("frames:10\n1-5 LeftUpLeg-LeftLeg[nan];\n", 2, "severity nan"),
        ("frames:10\n\n5-1 LeftUpLeg-LeftLeg[3];\n", 3, "backwards"),
        ("frames:10\n1-5 LeftUpLeg-LeftLeg\n", 2, "does not read as"),
        ("frames:10\n1-5 ;\n", 2, "names no link"),
    ],
)
def test_a_malformed_status_file_is_refused_with_its_line(tmp_path, text, line, word):
    path = tmp_path / "walk_injuries.txt"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_status(path, LINKS)
    assert caught.value.line == line
    assert caught.value.path == path
    assert word in str(caught.value)


severities = st.integers(0, 100).map(lambda n: n / 10)
spells = st.builds(
    lambda first, length, links: InjurySpell(first, first + length, tuple(links.items())),
    st.integers(0, 500),
    st.integers(0, 500),
    st.dictionaries(st.sampled_from(LINKS), severities, min_size=1),
)


@given(st.builds(Status, st.integers(1, 1000), st.lists(spells, max_size=4).map(tuple)))
@settings(max_examples=40, deadline=None)
def test_a_written_status_reads_back_unchanged(tmp_path_factory, status):
    path = tmp_path_factory.mktemp("status") / "clip_injuries.txt"
    write_status(path, status)
    read = read_status(path, LINKS)
    assert read.frames == status.frames
    assert [(s.first, s.last, s.links) for s in read.spells] == [
        (s.first, s.last, s.links) for s in status.spells
    ]
