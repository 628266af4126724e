"""The section `evaluation` of a configuration. Each measurement defines some of its keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import create_model

from hobble.core.section import Section
from hobble.measures.registry import MEASURES


def joined_sections(sections: list[type[Section]]) -> type[Section]:
    """A new section class that has the keys of all `sections`.

    Raises TypeError if two of the classes define the same key, unless they inherit it from the same base.
    """
    defined_in: dict[str, type] = {}  # key -> the class that defines it
    for section in sections:
        for key in section.model_fields:
            # The last class in the order of inheritance: an inherited key counts as the base's.
            definer = [c for c in section.__mro__ if key in getattr(c, "model_fields", {})][-1]
            if defined_in.setdefault(key, definer) is not definer:
                first, second = defined_in[key].__module__, definer.__module__
                raise TypeError(f"{key} is a key of {first} and of {second}: rename one of them")
    unique = list(dict.fromkeys(sections))
    # Leave out a class from which another inherits. Python refuses it as a base in front of that other class.
    bases = [s for s in unique if not any(other is not s and issubclass(other, s) for other in unique)]
    # Reversed, because pydantic puts the fields of the last base first.
    return create_model("Evaluation", __base__=tuple(bases[::-1]) or Section, __doc__="The measurements.")


if TYPE_CHECKING:  # a type checker cannot follow the class that is made below
    Evaluation = Section
else:
    Evaluation = joined_sections([measure.options for measure in MEASURES])
