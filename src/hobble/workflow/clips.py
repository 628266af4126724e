"""Finds the clips of each data set, the files that they come from, and the values of their channels.

Besides the clips that the user gives, a data set can have two kinds of clips that Hobble makes from them. A
mirror is the mirror image of a clip. A hurt version is a copy of a healthy clip in which some links of the
body are injured. The clip from which they are made is their original. A channel is an input of the network
besides motion and ground; its values are 0 or more.
"""

from __future__ import annotations

import functools
import math
import os
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

from hobble.channels import CHANNEL_NAMES, channel
from hobble.config.load_configuration import Catalogue
from hobble.config.models import ClipEntry
from hobble.core.clip_files import (
    CLIP_NAME_RULE,
    find_clips,
    is_valid_clip_name,
    require_single_file,
    unused_file_notes,
)
from hobble.core.errors import HobbleError, InputError
from hobble.core.untrusted import check_regular, read_text
from hobble.hurt.options import HURT_CHANNEL, Hurt
from hobble.synthetic.options import WRITTEN_LABEL_SUFFIXES

HEADER_BYTES = 1 << 18  # enough for the joints of a BVH file; 191 joints take 40 kB
# The line of a joint in a BVH file, with its name. The `{` that should follow may be on the same line.
JOINT = re.compile(r"^\s*(?:ROOT|JOINT)\s+(.*?)\s*\{?\s*$", re.MULTILINE | re.IGNORECASE)
CHECKSUM_LINE = re.compile(r"([0-9a-fA-F]{64}) [ *](\S+)\.bvh")


def joint_names(path: Path) -> set[str]:
    """The names of a BVH file's joints, without prefixes such as `mixamorig:`; empty if it cannot be read."""
    try:
        with open(path, "rb") as file:
            header = file.read(HEADER_BYTES).partition(b"MOTION")[0].decode("latin-1")
    except OSError:
        return set()
    return {name.rpartition(":")[2].strip() for name in JOINT.findall(header)}


def nearest_rig(joints: set[str], known: Mapping[str, Collection[str]], target: str) -> str | None:
    """The name of the known skeleton that has the most of `joints`; None if no one has more than `target`.

    joints: names of a clip's joints. known: name of a skeleton -> names of its joints. target: name of the
    data set's skeleton.
    """
    most, nearest = len(joints & set(known[target])), None
    for name in sorted(known):
        if len(joints & set(known[name])) > most:
            most, nearest = len(joints & set(known[name])), name
    return nearest


def read_checksums(path: Path) -> dict[str, str]:
    """Clip -> SHA-256, from a file with lines `<hash>  <clip>.bvh`, as `sha256sum *.bvh` writes them.

    Raises InputError with the line's number if a line has another form.
    """
    checksums: dict[str, str] = {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        match = CHECKSUM_LINE.fullmatch(line.strip())
        if match is None:
            raise InputError(path, "expected a SHA-256, two spaces and the name of a .bvh file", line=number)
        checksums[match[2]] = match[1].lower()
    return checksums


DATASETS = "results/datasets"
MIRROR_SUFFIX = "_mirror"
HURT_SUFFIX = re.compile(r"_hurt([1-9])$")  # at the end of the name of a hurt version
MAX_NOTES = 10  # at most this many notes are shown for a folder
LABEL_SUFFIXES = (".phase", ".gait", "_footsteps.txt", "_gait.txt")  # of hand-made files <clip><suffix>


def original(clip: str) -> str:
    """The clip from which a mirror or a hurt version is made; for other clips the clip itself."""
    return HURT_SUFFIX.sub("", clip.removesuffix(MIRROR_SUFFIX))


class Clips:
    """The clips of all data sets, and their files.

    base: the folder of the checkout of Hobble. mocap: the folder with the user's clips. catalogue: reads the
    files of the data sets.
    """

    def __init__(self, base: Path, mocap: Path, catalogue: Catalogue) -> None:
        self.base, self.mocap, self.catalogue = base, mocap, catalogue
        self.channel_sources = ChannelSources(catalogue, self)

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def entries(self, dataset: str) -> dict[str, ClipEntry]:
        """Name -> entry of the clips and hurt versions of a data set, without mirrors.

        Raises HobbleError if a name is reserved, InputError if there are no clips.
        """
        entries = self.listed_entries(dataset)
        return {**entries, **{version: entries[original(version)] for version in self.hurt_versions(dataset)}}

    @functools.cache  # noqa: B019
    def listed_entries(self, dataset: str) -> dict[str, ClipEntry]:
        """Name -> entry of the data set's listed clips or, if it lists none, of those in its folder."""
        listed = self.catalogue.dataset(dataset).clips or dict.fromkeys(self._scanned(dataset))
        if reserved := [name for name in listed if name.endswith(MIRROR_SUFFIX)]:
            raise HobbleError(
                f"data set {dataset}: {', '.join(reserved)}: names that end in _mirror are reserved for "
                "mirrors, which `mirror: true` makes. List the original clip instead, or rename the file."
            )
        if reserved := [name for name in listed if HURT_SUFFIX.search(name)]:
            raise HobbleError(
                f"data set {dataset}: {', '.join(reserved)}: names that end in _hurt1 to _hurt9 are reserved "
                "for the hurt versions that `hurt` makes. Take the clip out, or rename its file."
            )
        return {name: entry or ClipEntry() for name, entry in listed.items()}

    @staticmethod
    def is_hurt_version(clip: str) -> bool:
        """Whether a clip is a hurt version, or the mirror of one."""
        return HURT_SUFFIX.search(clip.removesuffix(MIRROR_SUFFIX)) is not None

    @functools.cache  # noqa: B019
    def hurt_versions(self, dataset: str) -> dict[str, int]:
        """Name of each hurt version -> its number among all hurt versions of the data set, from 0.

        The numbers go first through the first versions of all clips, then through their second versions, ...
        Only clips in which the values of the channel HURT_CHANNEL are 0 get hurt versions.
        """
        options = self.catalogue.dataset(dataset).hurt
        healthy = (
            [
                clip
                for clip in self.listed_entries(dataset)
                if self.channel_sources.is_neutral(dataset, clip, HURT_CHANNEL)
            ]
            if options
            else []
        )
        counts = {clip: self.hurt_options(dataset, clip).versions for clip in healthy}
        names = [
            f"{clip}_hurt{version + 1}"
            for version in range(max(counts.values(), default=0))
            for clip in healthy
            if version < counts[clip]
        ]
        return {name: number for number, name in enumerate(names)}

    def hurt_options(self, dataset: str, clip: str) -> Hurt:
        """Options of a clip's hurt versions: the data set's section `hurt`, changed by the clip's entry."""
        options, amount = self.catalogue.dataset(dataset).hurt, self.entry(dataset, clip).hurt
        assert options is not None
        if amount is None:
            return options
        # The entry gives the total length of all versions, as a multiple of the clip's length. `longest` is
        # the length of one version.
        versions = math.ceil(amount)
        return options.model_copy(update={"versions": versions, "longest": amount / max(versions, 1)})

    def entry(self, dataset: str, clip: str) -> ClipEntry:
        """The entry of a clip. For a mirror or a hurt version it is the entry of its original."""
        clips = self.listed_entries(dataset)
        name = original(clip)
        if name not in clips:
            raise HobbleError(f"data set {dataset} has no clip {name!r}; it has: {', '.join(clips)}")
        return clips[name]

    def folder(self, dataset: str) -> Path:
        """The folder of the data set's BVH files.

        Raises InputError if the user's folder cannot be read. A missing folder is an error only if its clips
        cannot be downloaded.
        """
        settings = self.catalogue.dataset(dataset)
        if settings.synthetic is not None:
            return Path(DATASETS, settings.source or dataset, "synthetic")
        path = self.mocap / (settings.folder or "")
        if settings.download is not None and not path.exists():
            return path
        if not path.is_dir():
            raise InputError(
                path,
                f"no such folder, but data set {dataset} reads its clips from it",
                fix="Put the clips there, or give the folder that contains it with --config mocap=FOLDER.",
            )
        if not os.access(path, os.R_OK | os.X_OK):
            raise InputError(path, "no permission to read this folder", fix="Check who owns it.")
        return path

    def source(self, dataset: str, clip: str) -> str:
        """Path of the clip's BVH file. Raises HobbleError if there is no such clip or no file."""
        name = self.entry(dataset, clip).file or clip  # raises HobbleError for an unknown clip
        settings = self.catalogue.dataset(dataset)
        if settings.synthetic is not None:
            return str(self.folder(dataset) / f"{clip}.bvh")
        if name in (files := self._files(dataset)):
            return str(require_single_file(name, files[name]))
        if name in (downloads := self._checksums(dataset)):
            return self.download_path(settings.source or dataset, name)
        path = self.folder(dataset) / f"{name}.bvh"
        nor = f", and it is not in the download list {self._download_list(dataset)}" if downloads else ""
        raise InputError(
            path,
            f"no such file, but data set {dataset} lists this clip{nor}",
            fix="Put the file there, or take the clip out of the data set.",
        )

    def download_path(self, dataset: str, clip: str) -> str:
        """Path to which a clip is downloaded."""
        return str(self.base / "data" / "downloaded" / dataset / f"{clip}.bvh")

    def download(self, dataset: str, clip: str) -> dict[str, str]:
        """How to download a clip, as a mapping with three keys.

        url: the address of its BVH file. sha256: the checksum of this file. folder: the user's folder, which
        does not hold this clip.
        """
        settings = self.catalogue.dataset(dataset)
        if settings.download is None or clip not in self._checksums(dataset):
            raise HobbleError(
                f"data set {dataset}: clip {clip} cannot be downloaded, because it is not in a download list"
            )
        return {
            "url": settings.download.url.format(clip=quote(clip), subject=quote(clip.partition("_")[0])),
            "sha256": self._checksums(dataset)[clip],
            "folder": str(self.mocap / (settings.folder or "")),
        }

    @functools.cache  # noqa: B019
    def label_files(self, dataset: str, clip: str) -> list[str]:
        """Paths of the label files beside the clip: hand-made files, or the files of a synthetic clip."""
        if self.catalogue.dataset(dataset).synthetic is not None:
            return self.side_files(dataset, clip, ("_footsteps.txt", "_gait.txt"))
        reads = self.catalogue.dataset(dataset).labels.files
        return self.side_files(dataset, clip, LABEL_SUFFIXES) if reads else []

    def side_files(self, dataset: str, clip: str, suffixes: Iterable[str]) -> list[str]:
        """Paths of the existing files <clip><suffix> beside a clip, for the given suffixes.

        Files of a synthetic clip need not exist yet, because a rule makes them.
        """
        synthetic = self.catalogue.dataset(dataset).synthetic is not None
        if synthetic:
            suffixes = [suffix for suffix in suffixes if suffix in WRITTEN_LABEL_SUFFIXES]
        stem = self.folder(dataset) / clip  # the path without suffix
        if not synthetic and clip in (files := self._files(dataset)):
            stem = files[clip][0].with_suffix("")
        files_of_clip = (f"{stem}{suffix}" for suffix in suffixes)
        return [file for file in files_of_clip if synthetic or Path(file).is_file()]

    def heightmap_files(self, dataset: str) -> list[str]:
        """Paths of the heightmaps of kind `file`, in the order of the data set."""
        maps = self.catalogue.dataset(dataset).terrain.heightmaps
        files = [self.mocap / m.path for m in maps if m.path]
        for file in filter(Path.exists, files):
            check_regular(file)
        return [str(file) for file in files]

    def skeleton_file(self, dataset: str) -> str:
        """Path of the data set's skeleton."""
        return self._skeleton(self.catalogue.dataset(dataset).skeleton)

    @functools.cache  # noqa: B019
    def clip_skeleton_files(self, dataset: str, clip: str) -> list[str]:
        """The file of the clip's own skeleton, in a list; [] if this is the data set's skeleton.

        A clip's own skeleton (its rig) is the known one that has the most joints of the clip's BVH file.
        """
        settings = self.catalogue.dataset(dataset)
        if settings.synthetic is not None:
            name: str | None = self.catalogue.dataset(settings.source or dataset).skeleton
        else:
            rigs = sorted(path.stem for path in Path(self.skeleton_folder).glob("*.yaml"))
            known = {rig: self.catalogue.skeleton(rig).joints for rig in rigs}
            name = nearest_rig(joint_names(Path(self.source(dataset, clip))), known, settings.skeleton)
        return [self._skeleton(name)] if name is not None and name != settings.skeleton else []

    @property
    def skeleton_folder(self) -> str:
        """The folder of the skeletons."""
        return str(self.base / "config" / "skeletons")

    def _skeleton(self, name: str) -> str:
        return str(Path(self.skeleton_folder) / f"{name}.yaml")

    def _scanned(self, dataset: str) -> list[str]:
        """The names of the clips in the user's folder.

        A mirror is left out if its original is in the folder. Raises InputError if there are no clips, or if
        a clip has a bad name or two files.
        """
        folder, files = self.folder(dataset), self._files(dataset)
        for name in sorted(files):
            if not is_valid_clip_name(name):
                fix = f"Rename it. Allowed: {CLIP_NAME_RULE}."
                raise InputError(folder, f"a clip is called {name!a:.80}", fix=fix)
            require_single_file(name, files[name])
        if not files:
            raise InputError(folder, "no .bvh files here", fix="Put clips there.")
        return sorted(set(files) - set(self._mirrors(dataset)))

    def _mirrors(self, dataset: str) -> list[str]:
        """Names of files NAME_mirror.bvh for which there is a NAME.bvh."""
        files = self._files(dataset)
        return sorted(name + MIRROR_SUFFIX for name in files if name + MIRROR_SUFFIX in files)

    def notes_on_unused_files(self, dataset: str) -> list[str]:
        """Sentences that say which files in the user's folder are not used, and why."""
        settings = self.catalogue.dataset(dataset)
        if settings.synthetic is not None or not (folder := self.folder(dataset)).is_dir():
            return []
        notes = unused_file_notes(folder, {*self._files(dataset), *self._checksums(dataset)})
        mirrors = [] if settings.clips or settings.mirror else self._mirrors(dataset)
        if mirrors:
            notes.insert(
                0,
                f"{len(mirrors)} files in {folder} are not used, because they are mirrors of other clips "
                f"({mirrors[0]}.bvh, ...). With `mirror: true` Hobble makes mirrors of all clips, with "
                "labels.",
            )
        not_shown = len(notes) - MAX_NOTES
        last = [f"{not_shown} more files belong to no clip."] if not_shown > 0 else []
        return [*notes[:MAX_NOTES], *last]

    def _download_list(self, dataset: str) -> Path:
        """Path of the data set's download list."""
        options = self.catalogue.dataset(dataset).download
        return self.base / "config" / "datasets" / ((options and options.checksums) or f"{dataset}.yaml")

    @functools.cache  # noqa: B019
    def _checksums(self, dataset: str) -> dict[str, str]:
        """Clip -> SHA-256 from the download list; {} if the data set has no downloads.

        Without a list, all clips of the data set can be downloaded, and their sums are "".
        """
        settings = self.catalogue.dataset(dataset)
        if settings.download is None:
            return {}
        if settings.download.checksums is None:
            return dict.fromkeys(
                (entry.file or clip if entry else clip for clip, entry in settings.clips.items()), ""
            )
        return read_checksums(self._download_list(dataset))

    @functools.cache  # noqa: B019
    def _files(self, dataset: str) -> dict[str, list[Path]]:
        """Clip -> its BVH files in the user's folder."""
        folder = self.folder(dataset)
        return find_clips(folder) if folder.is_dir() else {}


NO_CHANNEL = "plain"  # name of the folder of a database without channels


class ChannelSources:
    """The channels of a project's data sets, and the sources of their values."""

    def __init__(self, catalogue: Catalogue, clips: Clips) -> None:
        self.catalogue, self.clips = catalogue, clips

    def channels(self, dataset: str) -> tuple[str, ...]:
        """The channels of a data set: those with a section in its file, and those that need no section."""
        sections = self.catalogue.dataset(dataset).channels
        return tuple(name for name in CHANNEL_NAMES if name in sections or channel(name).Options is None)

    def files(self, dataset: str, clip: str, name: str) -> list[str]:
        """The files that channel `name` reads for a clip.

        They are the file beside the clip, and the tables of all clips that the channel's options name. The
        file beside the clip is left out if the clip's entry in the data set has a value for the channel.
        """
        suffix, has_value = channel(name).suffix, self._value(dataset, clip, name) is not None
        files = self.clips.side_files(dataset, clip, (suffix,)) if suffix and not has_value else []
        return [*files, *self._tables(dataset, name)]

    def source(self, dataset: str, clip: str, name: str) -> dict[str, Any]:
        """What the data set says about the values of channel `name` in a clip, as plain data.

        The keys are the fields of `hobble.channels.channel.ClipSource`, without `files`.
        """
        return {
            "clip": original(clip),
            "entry": self.clips.entry(dataset, clip).model_dump(
                mode="json", exclude={"channels", "hurt", "person"}
            ),
            "value": self._value(dataset, clip, name),
            "options": self.catalogue.dataset(dataset).channels.get(name, {}),
        }

    @functools.cache  # noqa: B019 - one project lives as long as the process
    def is_neutral(self, dataset: str, clip: str, name: str) -> bool:
        """Whether all values of channel `name` are 0 in a clip."""
        if self.clips.is_hurt_version(clip) and name == HURT_CHANNEL:
            return False
        # The file beside a synthetic clip is not read, because it need not exist yet.
        synthetic = self.catalogue.dataset(dataset).synthetic is not None
        files = self._tables(dataset, name) if synthetic else self.files(dataset, clip, name)
        definition = channel(name)
        return definition.is_neutral(definition.make_source(self.source(dataset, clip, name), files))

    def check(self, dataset: str) -> None:
        """Raise HobbleError if the data set's clip entries or options are wrong about channels."""
        settings = self.catalogue.dataset(dataset)
        rig = self.catalogue.skeleton(settings.skeleton)
        for clip, entry in self.clips.listed_entries(dataset).items():
            if unknown := set(entry.channels) - set(self.channels(dataset)):
                raise HobbleError(
                    f"data set {dataset}: clips.{clip}.channels: the data set has no channel "
                    f"{', '.join(sorted(unknown))}; it has {', '.join(self.channels(dataset)) or 'none'}"
                )
            for name in self.channels(dataset):
                # Error messages show "clip", so it names the place in the data set's file.
                fields = self.source(dataset, clip, name) | {"clip": f"data set {dataset}: clips.{clip}"}
                definition = channel(name)
                definition.check(definition.make_source(fields, self._tables(dataset, name)), rig)

    def _value(self, dataset: str, clip: str, name: str) -> Any:
        """The value of channel `name` in the clip's entry, or None."""
        return self.clips.entry(dataset, clip).channels.get(name)

    def _tables(self, dataset: str, name: str) -> list[str]:
        """Paths of the tables in the options of channel `name`. Raises InputError if a table is missing."""
        definition, section = channel(name), self.catalogue.dataset(dataset).channels.get(name, {})
        tables = definition.table_files(definition.options_of(section))
        files = [self.clips.mocap / file for file in tables]
        for file in files:
            if not file.is_file():
                fix = "Put it there, or name the folder that holds it with --config mocap=FOLDER."
                raise InputError(file, f"no such file, but data set {dataset} reads it", fix=fix)
        return [str(file) for file in files]


def database_folder(channels: Sequence[str]) -> str:
    """The name of the folder that holds the database with these channels."""
    return "+".join(channels) or NO_CHANNEL


def channels_of_folder(folder_name: str) -> tuple[str, ...]:
    """The channels of the database in a folder, from the folder's name: the inverse of `database_folder`.

    Raises HobbleError for a name that no database can have.
    """
    names = () if folder_name == NO_CHANNEL else tuple(folder_name.split("+"))
    if any(name not in CHANNEL_NAMES for name in names) or list(names) != sorted(
        set(names), key=CHANNEL_NAMES.index
    ):
        raise HobbleError(
            f"no database can be called {folder_name}. A database without channels is called `{NO_CHANNEL}`. "
            f"Any other is called by its channels with + between them, in the order "
            f"{', '.join(CHANNEL_NAMES)}"
        )
    return names
