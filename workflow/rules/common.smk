# What the rules share. In functions of rules, `w` holds the job's wildcards. `project` is made in the Snakefile.
from hobble.channels import channel_packages, display_modules
from hobble.measures.measure import all_measures
from hobble.workflow.clips import channels_of_folder
from hobble.workflow.contents import Contents
from hobble.workflow.demands import Demands

catalogue, clips, datasets = project.catalogue, project.clips, project.datasets
batches, demands, package = project.batches, Demands(project), project.package
configurations, measurements = project.configurations, project.measurements
comparison = project.comparison
contents = Contents(project.base / "data" / "downloaded")


def contents_of(files):
    """A param function: hashes of the user's files, see hobble.workflow.contents. files: an input function.

    (Snakemake does not compare params that are made from `input`.)
    """
    return lambda w: contents.of(files(w))


def local_files(files):
    """An input function: what the input function `files` returns, marked as local."""
    return lambda w: keep_local(files(w))


def motion_inputs(w):
    """The BVH files of a batch's clips, and the files of their rigs."""
    return [
        file
        for clip in batch_of(w).clips
        for file in [
            clips.source(w.dataset, clip),
            *clips.clip_skeleton_files(w.dataset, clip),
        ]
    ]


def label_inputs(w):
    """The label files of a batch's clips."""
    return [
        file
        for clip in batch_of(w).clips
        for file in clips.label_files(w.dataset, clip)
    ]


def channel_inputs(w):
    """The files that a batch's channels read."""
    return [
        file
        for channel in batches.channels(batch_of(w))
        for clip in batch_of(w).clips
        for file in channel_files(w.dataset, clip, channel)
    ]


def heightmap_inputs(w):
    """The heightmaps of a data set that are files."""
    return clips.heightmap_files(w.dataset)


wildcard_constraints:
    configuration="|".join(catalogue.names()),
    dataset=r"[^/]+",
    clip=r"[^/]+",
    batch=r"[^/]+",
    channels=r"plain|[a-z_+]+(?<!clips)",
    measure="|".join(each.name for each in all_measures()),


def keep_local(files):
    """Mark the files that are not results as local: they stay on disk if results are in an object store.

    files: a path, a list of paths, or a dictionary with such values. The return value has the same form.
    """
    if isinstance(files, dict):
        return {name: keep_local(value) for name, value in files.items()}
    paths = [files] if isinstance(files, str) else files
    marked = [path if path.startswith("results/") else local(path) for path in paths]
    return marked[0] if isinstance(files, str) else marked


def batch_of(w):
    """The clips or hurt versions that one job of a stage processes, see hobble.workflow.batches."""
    return batches.named(w.dataset, w.batch)


def folders(*stages):
    """An input function: the folders with the files that earlier stages have made of the batch's clips."""
    return lambda w: batches.folders(w.dataset, batch_of(w).clips, *stages)


def memory(stage):
    """A resource function: the MB of a job, see hobble.workflow.demands."""
    return lambda w, attempt: request_of(stage, w, attempt).mem_mb


def minutes(stage):
    """A resource function: the minutes of a job."""
    return lambda w, attempt: request_of(stage, w, attempt).runtime


def request_of(stage, w, attempt):
    """What a job requests, from its stage and its wildcards."""
    if stage == "measure":
        return demands.measure(w.configuration, w.measure, attempt)
    if stage == "training":
        return demands.training(w.configuration, attempt)
    dataset = w.get("dataset") or configurations.dataset(w.configuration)
    clip = w.get("clip")
    names = batch_of(w).clips if w.get("batch") else [clip] if clip else None
    return demands.job(stage, dataset, names, attempt)


def motion_files(dataset, clip):
    """The clip's BVH file, and the file of its rig if this is not the data set's skeleton."""
    return {
        "bvh": clips.source(dataset, clip),
        "rigs": clips.clip_skeleton_files(dataset, clip),
    }


def channel_files(dataset, clip, channel):
    """The files that a channel reads for a clip."""
    return datasets.channel_sources.files(dataset, clip, channel)


def splits_of(w):
    """Clip -> "train" or "held_out", for the clips of a database."""
    return datasets.splits(w.dataset, channels_of_folder(w.channels))


def compared_clips(w):
    """The clips that are compared with the others, so that no motion is both trained on and held out."""
    names = datasets.clips_to_compare(w.dataset, channels_of_folder(w.channels))
    splits = splits_of(w)
    return [name for name in names if name in splits]


def rows_and_compared(w):
    """The folders with the rows of a database's clips, and those with the motion that is compared."""
    return [
        *batches.folders(w.dataset, splits_of(w), "database"),
        *batches.folders(w.dataset, compared_clips(w), "motion"),
    ]
