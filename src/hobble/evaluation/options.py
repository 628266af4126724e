"""The keys of a configuration's `evaluation` section, collected from all measurements."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import create_model

from hobble.core.section import Section
from hobble.measures.registry import MEASURES


def joined_sections(sections: list[type[Section]]) -> type[Section]:
    """A section that has the keys of all `sections`.

    Raises TypeError if two of them define the same key, unless they inherit it from the same base.
    """
    owner: dict[str, type] = {}
    for section in sections:
        for key in section.model_fields:
            defines = [c for c in section.__mro__ if key in getattr(c, "model_fields", {})][-1]
            if owner.setdefault(key, defines) is not defines:
                raise TypeError(f"{key} is a key of {owner[key].__module__} and of {defines.__module__}")
    # pydantic takes the fields of the last base first.
    different = list(dict.fromkeys(sections))
    bases = [s for s in different if not any(o is not s and issubclass(o, s) for o in different)]
    return create_model("Evaluation", __base__=tuple(bases[::-1]) or Section, __doc__="The measurements.")


if TYPE_CHECKING:
    Evaluation = Section
else:
    Evaluation = joined_sections([one.options for one in MEASURES])
