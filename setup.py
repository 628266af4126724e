"""The skeleton files of the checkout become package data, so that an installed `hobble` has them too."""

from setuptools import find_packages, setup

setup(
    packages=[*find_packages("src"), "hobble.skeletons"],
    package_dir={"": "src", "hobble.skeletons": "config/skeletons"},
)
