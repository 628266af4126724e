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
            definer = [c for c in section.__mro__ if key in getattr(c, "model_fields", {})][-1]
            if owner.setdefault(key, definer) is not definer:
                raise TypeError(f"{key} is a key of {owner[key].__module__} and of {definer.__module__}")
    unique = list(dict.fromkeys(sections))
    # Python refuses a base that another base inherits from.
    bases = [s for s in unique if not any(o is not s and issubclass(o, s) for o in unique)]
    # The bases are reversed, because pydantic puts the fields of the last base first.
    return create_model("Evaluation", __base__=tuple(bases[::-1]) or Section, __doc__="The measurements.")


if TYPE_CHECKING:
    Evaluation = Section
else:
    Evaluation = joined_sections([measure.options for measure in MEASURES])
