"""Files of many programs are read; broken files are refused with file and line."""

import re

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.motion.read import check_angles, read_bvh

SMALL = """HIERARCHY
ROOT Hips
{
	OFFSET 0 0 0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
	JOINT mixamorig:Left Leg
	{
		OFFSET 1 -2e1 3.5
		CHANNELS 3 Yrotation Xrotation Zrotation
		End Site
		{
			OFFSET 0 -10 0
		}
		End Site
		{
			OFFSET 0 0 10
		}
	}
}
MOTION
Frames: 2
Frame Time: 0.0333333
1 2 3 4 5 6 7 8 9
1.5e1 -2 3 4 5 6 7 8 -9
"""


@pytest.fixture
def written(tmp_path):
    def write(text: str | bytes):
        (tmp_path / "clip.bvh").write_bytes(text if isinstance(text, bytes) else text.encode())
        return tmp_path / "clip.bvh"

    return write


def test_reads_names_offsets_channels_and_values(written):
    clip = read_bvh(written(SMALL))
    assert clip.names == ("Hips", "mixamorig:Left Leg")
    assert clip.parents == (-1, 0)
    np.testing.assert_array_equal(clip.offsets[1], [1, -20, 3.5])
    assert clip.channels[1] == ("Yrotation", "Xrotation", "Zrotation")
    assert clip.end_sites == {"mixamorig:Left Leg": [(0, -10, 0), (0, 0, 10)]}
    np.testing.assert_array_equal(clip.values, [[1, 2, 3, 4, 5, 6, 7, 8, 9], [15, -2, 3, 4, 5, 6, 7, 8, -9]])
    assert clip.frame_time == 0.0333333


VARIANTS = {
    "crlf": lambda s: s.replace("\n", "\r\n"),
    "carriage returns only": lambda s: s.replace("\n", "\r"),
    "byte order mark": lambda s: "\ufeff" + s,
    "tabs": lambda s: s.replace(" ", "\t").replace("\tLeg", " Leg").replace("End\tSite", "End Site"),
    "braces on the line": lambda s: s.replace("ROOT Hips\n{", "ROOT Hips {").replace("Leg\n\t{", "Leg {"),
    "lower case": lambda s: s.replace("Xposition", "xposition").replace("MOTION", "motion"),
    "frames over several lines": lambda s: s.replace(" 5 6", "\n5 6"),
    "a frame fewer than declared": lambda s: s.replace("Frames: 2", "Frames: 3"),
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_variants_of_the_format_are_read_alike(written, variant):
    plain, other = read_bvh(written(SMALL)), read_bvh(written(VARIANTS[variant](SMALL)))
    assert (other.names, other.channels) == (plain.names, plain.channels)
    np.testing.assert_array_equal(other.values, plain.values)


def swap(old: str, new: str):
    return lambda text: text.replace(old, new)


XYZ = "3 Xposition Yposition Zposition"
BROKEN = {
    "empty": (lambda s: "", "empty", None),
    "binary": (lambda s: b"HIERARCHY\n\0\1\2" + s.encode(), "binary", None),
    "fbx": (lambda s: b"Kaydara FBX Binary  \0", "FBX", None),
    "something else": (lambda s: "name,age\n1,2\n", "HIERARCHY", 1),
    "cut in the hierarchy": (lambda s: s[:150], "truncated", 8),
    "cut in a row": (lambda s: s[:-6], "7 values", 24),
    "no frame time": (lambda s: s[: s.index("Frame Time")], "Frame Time", None),
    "half the frames": (swap("Frames: 2", "Frames: 4"), "declares 4 frames", None),
    "two billion frames": (swap("Frames: 2", "Frames: 2000000000"), "2000000000 frames", 21),
    "nan": (swap(" 5 6 7 8 -9", " nan 6 7 8 -9"), "NaN", 24),
    "python's underscores": (swap("1.5e1", "1_5"), "'1_5' is not a number", 24),
    "decimal comma": (swap("1.5e1", "1,5"), "decimal comma", 24),
    "a value missing": (swap("7 8 9\n", "7 8\n"), "8 values, but the joints have 9", 23),
    "duplicate joints": (swap("mixamorig:Left Leg", "Hips"), "'Hips' occurs twice", 6),
    "second root": (swap("MOTION", "ROOT Two\n{\nOFFSET 0 0 0\nCHANNELS 0\n}\nMOTION"), "second root", 20),
    "unknown channel": (swap("Yrotation Xrotation Z", "Wrotation Xrotation Z"), "Wrotation", 9),
    "bad offset": (swap("OFFSET 1 -2e1 3.5", "OFFSET 1 -2e1"), "OFFSET needs three numbers", 8),
    "no offset": (swap("\t\tOFFSET 1 -2e1 3.5\n", ""), "no OFFSET", 17),
    "frame time nought": (swap("0.0333333", "0"), "Frame Time is 0 s; it must be", 22),
    "moved only": (lambda s: re.sub(" 7 8 .*", "", re.sub("6 X.*|3 Y.*", XYZ, s)), "no joint has rot", None),
    "strange word": (swap("OFFSET 0 0 0", "OFSET 0 0 0"), "'OFSET'", 4),
}  # fmt: skip


@pytest.mark.parametrize("what", BROKEN)
def test_a_malformed_file_is_refused_with_its_line(written, what):
    change, message, line = BROKEN[what]
    path = written(change(SMALL))
    with pytest.raises(InputError) as raised:
        check_angles(read_bvh(path))
    assert message in str(raised.value)
    assert str(path) in str(raised.value)
    assert line in (None, raised.value.line)
