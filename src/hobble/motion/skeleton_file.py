"""Skeleton files (`config/skeletons/<name>.yaml`): reads and checks them, and drafts one for a strange rig.

The file lists the joints of a rig, and tells which joint has which role. A role names a part of the body.
Users write these files by hand, so each error names the line of the mistake.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import ValidationError

from hobble.core.errors import InputError
from hobble.core.files import printable, read_text, read_yaml
from hobble.core.skeleton import Skeleton, SkeletonData, common_ancestor, path_between, path_to_root
from hobble.motion.body import ARM, LEG, SIDES, TRUNK
from hobble.motion.names import side_of

# The roles of each limb, from the trunk outward, and all roles that there are.
LIMBS = [tuple(f"{side}_{part}" for part in limb) for side in SIDES for limb in (ARM, LEG)]
ROLES = (*TRUNK, *(role for limb in LIMBS for role in limb))
OPTIONAL = ("spine", "chest", "neck", "left_toe", "right_toe")  # roles that a file may leave out
ORDER = (  # advice in error messages
    "The order in the trunk is hips, spine, chest, neck, head; in an arm shoulder, elbow, wrist; in a leg "
    "hip, knee, heel, toe."
)
APART = 0.25  # leg lengths: the joint from which the legs hang may be at most this far from the hips


# A mistake in a file: the section and the key where it is, what is wrong, and what to do (None if plain).
Mistake = tuple[str, str, str, str | None]


@dataclass(frozen=True)
class KnownSkeleton:
    """A skeleton that has a file in `config/skeletons`, with its maps to other skeletons.

    maps: name of another skeleton -> {joint of this skeleton: joint of the other}.
    """

    skeleton: Skeleton
    maps: Mapping[str, Mapping[str, str]]


def load_skeleton(path: str | Path, name: str | None = None) -> KnownSkeleton:
    """Read a skeleton file. Raises InputError if it is missing or wrong."""
    path = Path(path)
    if not path.is_file():
        raise InputError(path, "no such skeleton file")
    state = path.stat()
    return _load(path, name or path.stem, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=32)
def _load(path: Path, name: str, changed: int, size: int) -> KnownSkeleton:
    """Read a skeleton file, once as long as its time of change and its size stay the same."""
    data: Any = read_yaml(path)
    for section, key, problem, fix in _mistakes(data):
        line = _line_of(read_text(path), section, key)
        raise InputError(path, printable(problem, 400), line=line, fix=fix)
    return KnownSkeleton(Skeleton.from_dict({**data, "name": name}), data.get("maps") or {})


def _line_of(text: str, section: str, key: str) -> int | None:
    """The line of a key in a section of a skeleton file, or of the section itself if the key is empty."""
    found, inside = None, False
    wanted = re.compile(rf"""^\s+(['"]?){re.escape(key)}\1\s*:""")
    for number, line in enumerate(text.split("\n"), 1):
        if re.match(r"\w", line):
            inside = bool(section) and line.startswith(f"{section}:")
        if found is None and inside and (not key or wanted.match(line)):
            found = number
    return found


def _mistakes(data: Any) -> Iterator[Mistake]:
    """The mistakes in a skeleton file's content. What comes after the first one may fail or be wrong.

    `SkeletonData` says what each section holds. Only the roles in ROLES are allowed, and no two roles may
    have the same joint (except spine and chest). The joints of the roles must be in order from the trunk
    outward, and a name that says a side must say the side of the joint's role. All roles but those in
    OPTIONAL are required, and both toes or none. The legs must hang from a joint at or near the hips. If
    there is a chest, the arms must hang from it or from the neck.
    """
    sections: dict[str, Any] = data if isinstance(data, dict) else {}
    roles: Any = sections.get("roles")
    if not isinstance(roles, dict):
        yield "", "", "a skeleton file needs a section `roles`", "config/skeletons/README.md describes it."
    try:
        known = {key: value for key, value in sections.items() if key not in ("name", "maps")}
        joints = SkeletonData.model_validate({**known, "roles": {}}).joints
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = [str(part) for part in first["loc"]]
        section, key = [*place, "", ""][:2]
        problem = first["msg"].removeprefix("Value error, ")
        yield section, key, f"{' '.join(place)}: {problem}" if place else problem, None
    names = list(joints)
    yield from _role_mistakes(names, roles)
    parents = [-1 if joint.parent is None else names.index(joint.parent) for joint in joints.values()]
    yield from _order_mistakes(names, parents, roles)
    yield from _hub_mistakes(names, parents, roles, [joint.offset for joint in joints.values()])


def _role_mistakes(names: list[str], roles: Mapping[Any, Any]) -> Iterator[Mistake]:
    role_of: dict[str, str] = {}
    for role, joint in roles.items():
        if role not in ROLES:
            yield "roles", str(role), f"there is no role {role}{_guess(role, ROLES, '{}')}", None
        if not isinstance(joint, str) or joint not in names:
            yield "roles", role, f"{role}: there is no joint {joint!r}{_guess(joint, names, '{!r}')}", None
        if joint in role_of and {role, role_of[joint]} != {"spine", "chest"}:
            yield "roles", role, f"{role} and {role_of[joint]} are the same joint, {joint}", None
        role_of[joint] = role
    toes = {"left_toe", "right_toe"}
    needed = [role for role in ROLES if role not in OPTIONAL or (role in toes and toes & set(roles))]
    if missing := [role for role in needed if role not in roles]:
        yield "roles", "", f"these roles are missing: {', '.join(missing)}", None


def _order_mistakes(names: list[str], parents: list[int], roles: Mapping[str, str]) -> Iterator[Mistake]:
    """Each joint hangs from the one before it, the hips from no role, and names say no other side."""
    above = {role: [names[j] for j in path_to_root(parents, names.index(of))] for role, of in roles.items()}
    for chain in (*LIMBS, TRUNK[1:]):
        for first, second in pairwise(role for role in chain if role in roles):
            if roles[first] not in above[second]:
                problem = f"which does not hang from {roles[first]}, the {first}"
                yield "roles", second, f"{second} is {roles[second]}, {problem}", ORDER
    for role, joint in roles.items():
        if joint in above["hips"][1:]:
            yield "roles", "hips", f"hips is {roles['hips']}, which hangs from {joint}, the {role}", ORDER
        side, named = role.partition("_")[0], side_of(joint)
        if side in SIDES and named not in (None, side):
            fix = "Swap left and right. If the name is wrong, rename the joint here and in the clips."
            yield "roles", role, f"{role} is {joint}, whose name says {named}", fix


def _hub_mistakes(
    names: list[str], parents: list[int], roles: Mapping[str, str], offsets: Any
) -> Iterator[Mistake]:
    """The arms hang from the chest or the neck, and the legs from a joint near the hips."""
    index = {role: names.index(joint) for role, joint in roles.items()}
    arms, legs = (
        common_ancestor(parents, [index[f"{side}_{part}"] for side in SIDES]) for part in ("shoulder", "hip")
    )
    if "chest" in index and arms not in (index["chest"], index.get("neck")):
        yield "roles", "chest", f"chest is {roles['chest']}, but the arms hang from {names[arms]}", None
    lengths = np.linalg.norm(np.array(offsets, float), axis=-1)
    # A bone's length is the offset of its lower joint, which may be either end: the path may go up.
    bones = pairwise(path_between(parents, index["hips"], legs))
    distance = sum(lengths[a if parents[a] == b else b] for a, b in bones)
    if distance > APART * (lengths[index["left_knee"]] + lengths[index["left_heel"]]):
        yield "roles", "hips", f"hips is {roles['hips']}, but the legs hang from {names[legs]}", None


def _guess(word: Any, known: Any, shown: str) -> str:
    """A question that names the known word nearest to a wrong one, or nothing if none is near."""
    near = get_close_matches(str(word), known, 1)
    return f" (is it {shown.format(near[0])}?)" if near else ""


def draft_skeleton_file(rig: Skeleton, roles: Mapping[str, str]) -> str:
    """The text of a skeleton file (YAML): the rig's joints and their roles.

    roles: role -> name of its joint. The roles that are not in `roles` are left out if they are optional.
    Otherwise they get `?` as their joint.
    """
    known = {role: "?" for role in ROLES if role not in OPTIONAL} | dict(roles)
    lines = {"roles": {role: known[role] for role in ROLES if role in known}}
    advice = "# Role: joint. Fill in each ?. Leave out roles that the rig does not have.\n"
    how: dict[str, Any] = {"sort_keys": False, "allow_unicode": True, "width": 1000}
    joints = yaml.safe_dump({"joints": rig.to_dict()["joints"]}, default_flow_style=None, **how)
    return advice + yaml.safe_dump(lines, **how) + joints


def skeleton_folder() -> Path:
    """The folder of the skeleton files, in the repository or else in the installed package."""
    package = Path(__file__).resolve().parents[1]
    in_repository = package.parents[1] / "config" / "skeletons"
    return in_repository if in_repository.is_dir() else package / "skeletons"


def find_skeleton(name: str) -> Path:
    """The path of a skeleton file. name: a skeleton's name, or a path to a YAML file.

    Raises InputError if there is no skeleton of that name.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    path = skeleton_folder() / f"{name}.yaml"
    if not path.is_file():
        known = ", ".join(sorted(other.stem for other in path.parent.glob("*.yaml")))
        raise InputError(path, "no such skeleton", fix=f"Use {known}, or the path of a YAML file.")
    return path
