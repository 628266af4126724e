"""What the body is told beside where to go: each channel in a folder of its own, named in the list below."""

# Every channel that there is: the folder NAME beside this file.
NAMES = ("injury",)
