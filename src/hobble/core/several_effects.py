"""How several effects of one kind add up, such as those of two injuries on the speed: as a p-norm."""

from __future__ import annotations

# The p of the norm: 1 would be the sum, infinity the largest effect alone. Hurt versions of clips and the
# speed limits that are learnt from them use the same p.
SUM_NORM = 3.0
