"""Derives people.json (how impaired and normal walks differ): python -m hobble.hurt IMPAIRED_WALKS.npz"""

import sys

from hobble.hurt.impairment_profiles import PROFILES_FILE, derive_profiles

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    derive_profiles(sys.argv[1])
    print(PROFILES_FILE)
