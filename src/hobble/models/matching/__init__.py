"""Motion matching: plays recorded poses instead of predicting them (Clavet 2016; Holden et al. 2020)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.skeleton import Skeleton
from hobble.models.model import BuiltModel
from hobble.rows.layout import RowLayout

if TYPE_CHECKING:
    from hobble.models.matching.build import Tables
    from hobble.models.matching.network import Matching
    from hobble.models.matching.options import MatchingOptions


class _Matching(BuiltModel):
    def options_class(self) -> type[MatchingOptions]:
        from hobble.models.matching.options import MatchingOptions

        return MatchingOptions

    def build(
        self, options: MatchingOptions, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton
    ) -> Tables:
        from hobble.models.matching.build import build

        return build(options, clips, layout, skeleton)

    def read(self, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Matching:
        """As in `Model`. shared_fields: those that networks of all kinds have."""
        from hobble.models.matching.network import Matching

        return Matching.read(path, arrays, shared_fields)


MODEL = _Matching()
