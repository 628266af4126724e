"""Tells the rules about a data set: its clips and their files, its options, its batches, and its splits.

Besides the clips that the user gives, a data set can have two kinds of clips that Hobble makes from them. A
mirror is the mirror image of a clip. A hurt version is a copy of a healthy clip in which some links of the
body are injured. The clip from which they are made is their original. A channel is an input of the network
besides motion and ground; its values are 0 or more.

Each stage of the workflow (motion, labels, ...) has one job for each batch instead of one for each clip,
because a job takes time to start. A data set of up to LEAST_BATCHES clips has a batch for each clip. A larger
data set has LEAST_BATCHES batches, and this number is doubled until a batch holds at most
MOST_CLIPS_OF_A_BATCH clips on average. A hash of a clip's name decides its batch. So a new clip changes only
one batch if the number of batches stays the same. The hurt versions of a batch's clips are a batch, too.

The output of a job is a folder, results/datasets/<dataset>/batches/<stage>/<batch>/. Snakemake plans 500
folders in seconds; listing the 25,000 files in them took five times as long.
"""

import functools
import hashlib
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import quote

from hobble.channels import CHANNEL_NAMES, channel
from hobble.config.load_configuration import Catalogue
from hobble.config.models import ClipEntry
from hobble.core.clip_files import (
    CLIP_NAME_RULE,
    HURT_SUFFIX,
    MIRROR_SUFFIX,
    find_clips,
    is_hurt_version,
    is_valid_clip_name,
    original,
    require_single_file,
    unused_file_notes,
)
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import check_regular, read_text
from hobble.core.section import Section
from hobble.hurt import HURT_CHANNEL, Hurt
from hobble.synthetic.generate_clip import WRITTEN_LABEL_SUFFIXES

LEAST_BATCHES = 12  # a data set with more clips than this has at least this many batches
MOST_CLIPS_OF_A_BATCH = 32  # a batch holds at most this many clips on average
DATASETS = "results/datasets"
LABEL_SUFFIXES = (".phase", ".gait", "_footsteps.txt", "_gait.txt")  # of hand-made files <clip><suffix>
MAX_NOTES = 10  # at most this many notes are shown for a folder
HEADER_BYTES = 1 << 18  # enough for the joints of a BVH file; 191 joints take 40 kB
# The line of a joint in a BVH file, with its name. The `{` that should follow may be on the same line.
JOINT = re.compile(r"^\s*(?:ROOT|JOINT)\s+(.*?)\s*\{?\s*$", re.MULTILINE | re.IGNORECASE)
CHECKSUM_LINE = re.compile(r"([0-9a-fA-F]{64}) [ *](\S+)\.bvh")
NO_CHANNEL = "plain"  # name of the folder of a database without channels


def joint_names(path: Path) -> set[str]:
    """The names of a BVH file's joints, without prefixes such as `mixamorig:`; empty if it cannot be read."""
    try:
        with open(path, "rb") as file:
            header = file.read(HEADER_BYTES).partition(b"MOTION")[0].decode("latin-1")
    except OSError:
        return set()
    return {name.rpartition(":")[2].strip() for name in JOINT.findall(header)}


def read_checksums(path: Path) -> dict[str, str]:
    """Clip -> SHA-256, from a file with lines `<hash>  <clip>.bvh`, as `sha256sum *.bvh` writes them.

    Raises InputError with the line's number if a line has another form.
    """
    checksums: dict[str, str] = {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        match = CHECKSUM_LINE.fullmatch(line.strip())
        if match is not None:
            checksums[match[2]] = match[1].lower()
        elif line.strip():
            raise InputError(path, "expected a SHA-256, two spaces and the name of a .bvh file", line=number)
    return checksums


def plain(settings: Section, section: str, keys: Iterable[str] | None = None) -> dict[str, Any]:
    """Key -> value of a section of the settings as plain data, for `keys` or, with None, for all keys."""
    values: Section = getattr(settings, section)
    return values.model_dump(mode="json", include=None if keys is None else set(keys))


@dataclass(frozen=True)
class ClipBatch:
    """Some clips of a data set, or hurt versions of clips, that one job processes one after another.

    name: the clip's name if each clip has a batch of its own, else a number; with `_hurt` for hurt versions.
    mirrored: whether each clip has a mirror. channels: those whose values the stage `channels` reads.
    """

    name: str
    clips: tuple[str, ...]
    mirrored: bool
    channels: tuple[str, ...]
    hurt: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the clips, then of their mirrors, if there are any."""
        return (*self.clips, *(clip + MIRROR_SUFFIX for clip in self.clips if self.mirrored))

    @property
    def originals(self) -> tuple[str, ...]:
        """The clips from which these hurt versions are made, each once."""
        return tuple(dict.fromkeys(map(original, self.clips)))


class NamedDataset:
    """What the rules ask about one data set.

    name: that of the data set. base: the folder of the checkout of Hobble. mocap: the folder with the user's
    clips. catalogue: reads the files of the data sets.
    """

    def __init__(self, name: str, base: Path, mocap: Path, catalogue: Catalogue) -> None:
        self.name, self.base, self.mocap, self.catalogue = name, base, mocap, catalogue
        self.settings = catalogue.dataset(name)
        self.source_name = self.settings.source or name  # the data set that generates or downloads the files
        self.root = f"{DATASETS}/{name}"

    @property
    def entries(self) -> list[str]:
        """Names of the clips and hurt versions, without mirrors.

        Raises HobbleError if a name is reserved, InputError if there are no clips.
        """
        return [*self.listed, *self.hurt_versions]

    @cached_property
    def listed(self) -> dict[str, ClipEntry]:
        """Name -> entry of the listed clips or, if the data set lists none, of those in its folder."""
        listed = self.settings.clips or dict.fromkeys(self._scanned())
        if reserved := [name for name in listed if name.endswith(MIRROR_SUFFIX) or HURT_SUFFIX.search(name)]:
            raise HobbleError(
                f"data set {self.name}: {', '.join(reserved)}: names that end in _mirror, or in _hurt1 to "
                "_hurt9, are reserved for what `mirror: true` and `hurt` make. List the original clip, or "
                "rename the file."
            )
        return {name: entry or ClipEntry() for name, entry in listed.items()}

    @cached_property
    def hurt_versions(self) -> dict[str, int]:
        """Name of each hurt version -> its number among all hurt versions of the data set, from 0.

        Only clips in which the values of the channel HURT_CHANNEL are 0 get hurt versions. Those of a clip
        have successive numbers, so that the links that hurt in them are spread evenly
        (`hobble.hurt.version.schedule_severities`).
        """
        if self.settings.hurt is None:
            return {}
        healthy = [clip for clip in self.listed if self.is_neutral(clip, HURT_CHANNEL)]
        versions = ((clip, 1 + k) for clip in healthy for k in range(self.hurt_options(clip).versions))
        return {f"{clip}_hurt{turn}": number for number, (clip, turn) in enumerate(versions)}

    def hurt_options(self, clip: str) -> Hurt:
        """Options of a clip's hurt versions: the section `hurt`, changed by the clip's entry."""
        options, entry = self.settings.hurt, self.entry(clip)
        assert options is not None
        changes: dict[str, float] = {"every": entry.hurt_every or options.every}
        if entry.hurt is not None:
            # The entry gives the total length of all versions, as a multiple of the clip's length. `longest`
            # is the length of one version.
            versions = math.ceil(entry.hurt)
            changes |= {"versions": versions, "longest": entry.hurt / max(versions, 1)}
        return options.model_copy(update=changes)

    def entry(self, clip: str) -> ClipEntry:
        """The entry of a clip. For a mirror or a hurt version it is the entry of its original."""
        name = original(clip)
        if name not in self.listed:
            raise HobbleError(f"data set {self.name} has no clip {name!r}; it has: {', '.join(self.listed)}")
        return self.listed[name]

    def is_generated(self, clip: str) -> bool:
        """Whether the clip is one of the generated walker, and not one of the folder."""
        return self.settings.folder is None or self.entry(clip).recipe is not None

    @property
    def folder(self) -> Path:
        """The folder of the data set's captured BVH files.

        Raises InputError if there is no such folder and its clips cannot be downloaded.
        """
        path = self.mocap / (self.settings.folder or "")
        if self.settings.download is not None and not path.exists():
            return path
        if not path.is_dir():
            problem = f"no such folder, but data set {self.name} reads its clips from it"
            fix = "Put the clips there, or give the folder that contains it with --config mocap=FOLDER."
            raise InputError(path, problem, fix=fix)
        return path

    def source(self, clip: str) -> str:
        """Path of the clip's BVH file. Raises HobbleError if there is no such clip or no file."""
        if self.is_generated(clip):
            return f"{self._generated_stem(clip)}.bvh"
        name = self.entry(clip).file or clip
        if name in self._files:
            return str(require_single_file(name, self._files[name]))
        if name in self._checksums:
            return str(self.base / "data" / "downloaded" / self.source_name / f"{name}.bvh")
        nor = ", and it is not in the download list" if self._checksums else ""
        problem = f"no such file, but data set {self.name} lists this clip{nor}"
        fix = "Put the file there, or take the clip out of the data set."
        raise InputError(self.folder / f"{name}.bvh", problem, fix=fix)

    def _generated_stem(self, clip: str) -> str:
        """Path of the files of a generated clip, without suffixes."""
        return f"{DATASETS}/{self.source_name}/synthetic/{clip}"

    def download(self, clip: str) -> dict[str, str]:
        """How to download a clip, as a mapping with three keys.

        url: the address of its BVH file. sha256: the checksum of this file. folder: the user's folder, which
        does not hold this clip.
        """
        assert self.settings.download is not None, "only clips that `source` finds there are downloaded"
        subject = quote(clip.partition("_")[0])
        return {
            "url": self.settings.download.url.format(clip=quote(clip), subject=subject),
            "sha256": self._checksums[clip],
            "folder": str(self.mocap / (self.settings.folder or "")),
        }

    @functools.cache  # noqa: B019 - a data set lives as long as the process
    def label_files(self, clip: str) -> list[str]:
        """Paths of the label files beside the clip: hand-made files, or the files of a generated clip."""
        has_files = self.is_generated(clip) or self.settings.labels.files
        return self._side_files(clip, *LABEL_SUFFIXES) if has_files else []

    def _side_files(self, clip: str, *suffixes: str) -> list[str]:
        """Paths of the existing files <clip><suffix> beside a clip, for the given suffixes.

        Files of a generated clip need not exist yet, because a rule makes them.
        """
        if self.is_generated(clip):
            return [f"{self._generated_stem(clip)}{end}" for end in suffixes if end in WRITTEN_LABEL_SUFFIXES]
        stem = self._files[clip][0].with_suffix("") if clip in self._files else self.folder / clip
        return [file for file in (f"{stem}{end}" for end in suffixes) if Path(file).is_file()]

    @property
    def heightmap_files(self) -> list[str]:
        """Paths of the heightmaps of kind `file`, in the order of the data set."""
        files = [self.mocap / each.path for each in self.settings.terrain.heightmaps if each.path]
        for file in filter(Path.exists, files):
            check_regular(file)
        return [str(file) for file in files]

    @property
    def skeleton_file(self) -> str:
        """Path of the data set's skeleton."""
        return self._skeleton(self.settings.skeleton)

    @functools.cache  # noqa: B019
    def clip_skeleton_files(self, clip: str) -> list[str]:
        """The file of the clip's own skeleton, in a list; [] if this is the data set's skeleton.

        A clip's own skeleton (its rig) is the known one that has the most joints of the clip's BVH file.
        """
        target = self.settings.skeleton
        if self.is_generated(clip):
            rig = self.catalogue.dataset(self.source_name).skeleton
        else:
            joints = joint_names(Path(self.source(clip)))
            rigs = sorted(path.stem for path in (self.base / "config/skeletons").glob("*.yaml"))
            shared = {rig: len(joints & set(self.catalogue.skeleton(rig).joints)) for rig in rigs}
            nearest = max(rigs, key=lambda rig: shared[rig])
            rig = nearest if shared[nearest] > shared[target] else target
        return [self._skeleton(rig)] if rig != target else []

    def _skeleton(self, name: str) -> str:
        return str(self.base / "config" / "skeletons" / f"{name}.yaml")

    def _scanned(self) -> list[str]:
        """The names of the clips in the user's folder.

        A mirror is left out if its original is in the folder. Raises InputError if there are no clips, or if
        a clip has a bad name or two files.
        """
        for name in sorted(self._files):
            if not is_valid_clip_name(name):
                fix = f"Rename it. Allowed: {CLIP_NAME_RULE}."
                raise InputError(self.folder, f"a clip is called {name!a:.80}", fix=fix)
            require_single_file(name, self._files[name])
        if not self._files:
            raise InputError(self.folder, "no .bvh files here", fix="Put clips there.")
        return sorted(set(self._files) - set(self._mirrors()))

    def _mirrors(self) -> list[str]:
        """Names of files NAME_mirror.bvh for which there is a NAME.bvh."""
        return sorted(name + MIRROR_SUFFIX for name in self._files if name + MIRROR_SUFFIX in self._files)

    def notes_on_unused_files(self) -> list[str]:
        """Sentences that say which files in the user's folder are not used, and why."""
        if self.settings.folder is None or not self.folder.is_dir():
            return []
        notes = unused_file_notes(self.folder, {*self._files, *self._checksums})
        mirrors = [] if self.settings.clips or self.settings.mirror else self._mirrors()
        if mirrors:
            what = f"{len(mirrors)} files in {self.folder} are mirrors of other clips ({mirrors[0]}.bvh, ...)"
            fix = "With `mirror: true` Hobble makes mirrors of all clips, with labels."
            notes.insert(0, f"{what} and are not used. {fix}")
        more = [f"{len(notes) - MAX_NOTES} more files belong to no clip."] if len(notes) > MAX_NOTES else []
        return [*notes[:MAX_NOTES], *more]

    @cached_property
    def _checksums(self) -> dict[str, str]:
        """Clip -> SHA-256 from the download list; {} if the data set has no downloads.

        Without a list, all clips of the data set can be downloaded, and their sums are "".
        """
        if self.settings.download is None:
            return {}
        if (checksums := self.settings.download.checksums) is not None:
            return read_checksums(self.base / "config" / "datasets" / checksums)
        return {entry.file or clip if entry else clip: "" for clip, entry in self.settings.clips.items()}

    @cached_property
    def _files(self) -> dict[str, list[Path]]:
        """Clip -> its BVH files in the user's folder."""
        if self.settings.folder is None or not self.folder.is_dir():
            return {}
        return find_clips(self.folder)

    # The channels, and the sources of their values.

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """The channels of the data set: those with a section in its file, and those that need no section."""
        sections = self.settings.channels
        return tuple(name for name in CHANNEL_NAMES if name in sections or channel(name).Options is None)

    def channel_files(self, clip: str, name: str) -> list[str]:
        """The files that channel `name` reads for a clip.

        They are the file beside the clip, and the tables of all clips that the channel's options name. The
        file beside the clip is left out if the clip's entry in the data set has a value for the channel.
        """
        suffix, value = channel(name).suffix, self.entry(clip).channels.get(name)
        files = self._side_files(clip, suffix) if suffix and value is None else []
        return [*files, *self._tables(name)]

    def channel_source(self, clip: str, name: str) -> dict[str, Any]:
        """What the data set says about the values of channel `name` in a clip, as plain data.

        The keys are the fields of `hobble.channels.channel.ClipSource`, without `files`.
        """
        return {
            "clip": original(clip),
            "value": self.entry(clip).channels.get(name),
            "options": self.settings.channels.get(name, {}),
        }

    @functools.cache  # noqa: B019
    def is_neutral(self, clip: str, name: str) -> bool:
        """Whether all values of channel `name` are 0 in a clip."""
        if is_hurt_version(clip) and name == HURT_CHANNEL:
            return False
        # The file beside a generated clip is not read, because it need not exist yet.
        files = self._tables(name) if self.is_generated(clip) else self.channel_files(clip, name)
        definition = channel(name)
        return definition.is_neutral(definition.make_source(self.channel_source(clip, name), files))

    def check_channels(self) -> None:
        """Raise HobbleError if the clips' entries or the options are wrong about channels."""
        rig = self.catalogue.skeleton(self.settings.skeleton)
        for clip, entry in self.listed.items():
            if unknown := set(entry.channels) - set(self.channels):
                raise HobbleError(
                    f"data set {self.name}: clips.{clip}.channels: the data set has no channel "
                    f"{', '.join(sorted(unknown))}; it has {', '.join(self.channels) or 'none'}"
                )
            for name in self.channels:
                # Error messages show "clip", so it names the place in the data set's file.
                fields = {**self.channel_source(clip, name), "clip": f"data set {self.name}: clips.{clip}"}
                definition = channel(name)
                definition.check(definition.make_source(fields, self._tables(name)), rig)

    def _tables(self, name: str) -> list[str]:
        """Paths of the tables in the options of channel `name`. Raises InputError if a table is missing."""
        definition = channel(name)
        tables = definition.table_files(definition.options_of(self.settings.channels.get(name, {})))
        for file in (files := [self.mocap / file for file in tables]):
            if not file.is_file():
                fix = "Put it there, or name the folder that holds it with --config mocap=FOLDER."
                raise InputError(file, f"no such file, but data set {self.name} reads it", fix=fix)
        return [str(file) for file in files]

    # The options, the batches and the splits.

    def motion_options(self, clip: str) -> dict[str, Any]:
        """The section `motion`, changed by the values in the clip's entry, and with the entry's `ground`."""
        keys = {"source_fps", "loops", "heading", "ground", "frames"}
        return {
            **plain(self.settings, "motion"),
            **self.entry(clip).model_dump(mode="json", include=keys, exclude_none=True),
        }

    def frames(self, clip: str) -> int:
        """Number of frames, at 60 Hz, of a generated clip: its share of all generated frames."""
        assert self.settings.synthetic is not None
        all_shares = sum(entry.share for name, entry in self.listed.items() if self.is_generated(name))
        return round(self.settings.synthetic.frames * self.entry(clip).share / all_shares)

    @cached_property
    def batches(self) -> dict[str, ClipBatch]:
        """Name -> batch: first the batches of clips, then those of their hurt versions."""
        count = batch_count(len(self.listed))
        digits = len(str(count - 1))  # all numbers get as many, such as 03 in 00 to 11
        own = count == len(self.listed)  # each clip has a batch of its own
        members: dict[str, list[str]] = defaultdict(list)
        for clip in self.listed:
            members[clip if own else f"{batch_of(clip, count):0{digits}}"].append(clip)
        versions = defaultdict(list)
        for version in self.hurt_versions:
            versions[original(version)].append(version)
        mirrored, channels = self.settings.mirror, self.channels
        names = list(members) if own else sorted(members)
        batches = {name: ClipBatch(name, tuple(members[name]), mirrored, channels) for name in names}
        # The stage `hurt` makes the severities of hurt versions.
        others = tuple(name for name in channels if name != HURT_CHANNEL)
        for name in names:
            if hurt := tuple(version for clip in members[name] for version in versions[clip]):
                key = f"{name}_hurt"
                batches[key] = ClipBatch(key, hurt, mirrored, others, hurt=True)
        return batches

    def batch(self, name: str) -> ClipBatch:
        """One batch. Raises HobbleError if the data set has no batch with this name."""
        if name not in self.batches:
            there = ", ".join(self.batches)
            raise HobbleError(f"data set {self.name} has no batch {name:.80}; it has {there}")
        return self.batches[name]

    def folders(self, names: Iterable[str], *stages: str) -> list[str]:
        """The folders with the files that some stages make of some clips.

        names: of clips, mirrors and hurt versions. The stage `hurt` makes the motion, labels and severities
        of hurt versions.
        """
        clips = [clip.removesuffix(MIRROR_SUFFIX) for clip in names]
        if unknown := [clip for clip in clips if clip not in self._batch_of_clip]:
            raise HobbleError(f"data set {self.name} has no clip {unknown[0]!r:.80}")
        found: dict[str, None] = {}
        for batch in dict.fromkeys(self._batch_of_clip[clip] for clip in clips):
            for stage in stages:
                of_hurt = batch.hurt and stage in ("motion", "labels", "channels")
                is_own = batch.channels if stage == "channels" else not of_hurt
                made_by = ["hurt"] * of_hurt + [stage] * bool(is_own)
                found.update(dict.fromkeys(f"{self.root}/batches/{each}/{batch.name}" for each in made_by))
        return list(found)

    @cached_property
    def _batch_of_clip(self) -> dict[str, ClipBatch]:
        """Clip or hurt version -> its batch."""
        return {clip: batch for batch in self.batches.values() for clip in batch.clips}

    def splits(self, channels: Sequence[str]) -> dict[str, str]:
        """Clip -> "train" or "held_out", for the clips that a network can learn from.

        channels: the channels of the network. If the network lacks a channel of the data set, it cannot learn
        from clips in which this channel is not 0, so they are left out. A mirror is in the split of its
        original. Raises HobbleError if the data set lacks one of `channels`, if `held_out` names a clip that
        does not exist, or if no clip is left for training.
        """
        if lacking := [name for name in channels if name not in self.channels]:
            raise HobbleError(
                f"data set {self.name} has no channel {', '.join(lacking)}. Give it a section "
                f"`channels: {{{lacking[0]}: ...}}`, or use another data set"
            )
        held_out = set(self.settings.held_out)
        if missing := held_out - set(self.listed):
            raise HobbleError(
                f"data set {self.name}: held_out names clips that do not exist: "
                f"{', '.join(sorted(missing))}. Correct the names, or take them out of held_out"
            )
        splits, without = {}, set()
        for clip in self.entries:
            unknown = [n for n in self.channels if n not in channels and not self.is_neutral(clip, n)]
            without |= set(unknown)
            for name in () if unknown else (clip, clip + MIRROR_SUFFIX)[: 1 + self.settings.mirror]:
                splits[name] = "held_out" if original(clip) in held_out else "train"
        if "train" not in splits.values():
            suited = f" without {' or '.join(sorted(without))}" if without else ""
            raise HobbleError(
                f"data set {self.name}: no clip{suited} is left to train on. Add clips, or shorten held_out"
            )
        return splits

    def clips_to_compare(self, channels: Sequence[str]) -> list[str]:
        """The clips that a job compares to find copies, so that no motion is both trained on and held out.

        Mirrors, hurt versions and generated clips are not compared. The list is empty if no clip is held out.
        """
        splits = self.splits(channels)
        if len(set(splits.values())) < 2:
            return []
        return [clip for clip in splits if clip == original(clip) and not self.is_generated(clip)]

    @property
    def autoencoder(self) -> list[str]:
        """Path of the autoencoder that finds the local phases, in a list; [] if none does."""
        used = self.settings.database.local_phases == "autoencoder"
        return [f"{self.root}/autoencoder/weights.npz"] if used else []

    @property
    def autoencoder_clips(self) -> list[str]:
        """The clips from which the autoencoder learns: without mirrors, hurt versions and held-out clips."""
        return [clip for clip in self.listed if clip not in self.settings.held_out]

    def row_step(self, clip: str) -> int:
        """The number n such that training uses every n-th row of the clip: 1, except for a hurt version."""
        return self.hurt_options(clip).every if is_hurt_version(clip) else 1


def healthy_originals(clips: Iterable[str]) -> dict[str, str]:
    """Hurt version -> its healthy original, for the hurt versions among some clips.

    The mirror of a hurt version gets the mirror of the original.
    """
    ends = {clip: MIRROR_SUFFIX if clip.endswith(MIRROR_SUFFIX) else "" for clip in clips}
    return {clip: original(clip) + end for clip, end in ends.items() if is_hurt_version(clip)}


def batch_count(clips: int) -> int:
    """The number of batches of a data set with this number of clips; see the module's docstring."""
    count = min(clips, LEAST_BATCHES)
    while clips > count * MOST_CLIPS_OF_A_BATCH:
        count *= 2
    return count


def batch_of(clip: str, count: int) -> int:
    """The number of the clip's batch, from 0 to `count` - 1. It does not depend on other clips."""
    digest = hashlib.sha256(clip.encode(errors="surrogateescape")).digest()
    return int.from_bytes(digest[:8], "big") % count


LOCAL_PHASES = "local_phases"  # the last part of the name of a database that has them


def database_folder(channels: Sequence[str], local_phases: bool) -> str:
    """The name of the folder that holds the database with these channels, with local phases or without."""
    return "+".join([*channels, *[LOCAL_PHASES] * local_phases]) or NO_CHANNEL


def has_local_phases(folder_name: str) -> bool:
    """Whether the database in the folder with this name has local phases."""
    return folder_name.split("+")[-1] == LOCAL_PHASES


def channels_of_folder(folder_name: str) -> tuple[str, ...]:
    """The channels of the database in a folder, from the folder's name: the inverse of `database_folder`.

    Raises HobbleError for a name that no database can have.
    """
    names = () if folder_name == NO_CHANNEL else tuple(folder_name.split("+"))
    names = names[:-1] if has_local_phases(folder_name) else names
    if names != tuple(name for name in CHANNEL_NAMES if name in names):
        raise HobbleError(
            f"no database can be called {folder_name}. It is called `{NO_CHANNEL}`, or by its channels with "
            f"+ between them, in the order {', '.join(CHANNEL_NAMES)}"
        )
    return names
