# What the rules share. In functions of rules, `w` holds the job's wildcards. `project` is made in the Snakefile.
from hobble.channels import display_modules
from hobble.measures.measure import all_measures, measure_named
from hobble.workflow import demands
from hobble.workflow.datasets import (
    channels_of_folder,
    has_local_phases,
    healthy_originals,
    plain,
)
from hobble.workflow.fingerprint import Contents, Package
from hobble.workflow.project import PUBLISHED

package = Package(project.base)
DOWNLOADED = project.base / "data" / "downloaded"
contents = Contents(DOWNLOADED)
SHOWN = [
    one.module for one in all_measures()
]  # modules that show and compare measurements
# Templates and styles of the pages, and the published results that they show. A change makes only the pages again.
PAGES = package.files(*(f"report/*.{kind}" for kind in ("j2", "css", "js", "yaml")))


def dataset(w):
    """The data set that a job's wildcards name."""
    return project.dataset(w.dataset)


def configuration(w):
    """The configuration that a job's wildcards name."""
    return project.configuration(w.configuration)


def network_file(name):
    """An input function: a file in the folder of the configuration's network."""
    return lambda w: configuration(w).network(name)


def section(name):
    """A param function: a section of the configuration."""
    return lambda w: plain(configuration(w).settings, name)


def network_code(script, *modules):
    """A param function: hash of a script's code, with that of the configuration's kind of network."""
    return lambda w: package.code(script, configuration(w).model_package, *modules)


def contents_of(files):
    """A param function: hashes of the user's files, see hobble.workflow.fingerprint. files: an input function.

    (Snakemake does not compare params that are made from `input`.)
    """
    return lambda w: contents.of(files(w))


def local_files(files):
    """An input function: what the input function `files` returns, marked as local."""
    return lambda w: keep_local(files(w))


def motion_files(w, clip):
    """The clip's BVH file, and the file of its rig if this is not the data set's skeleton."""
    return {
        "bvh": dataset(w).source(clip),
        "rigs": dataset(w).clip_skeleton_files(clip),
    }


def motion_inputs(w):
    """The BVH files of a batch's clips, and the files of their rigs."""
    files = [motion_files(w, clip) for clip in batch_of(w).clips]
    return [file for each in files for file in (each["bvh"], *each["rigs"])]


def label_inputs(w):
    """The label files of a batch's clips."""
    return [f for clip in batch_of(w).clips for f in dataset(w).label_files(clip)]


def channel_inputs(w):
    """The files that a batch's channels read."""
    return [
        file
        for channel in batch_of(w).channels
        for clip in batch_of(w).clips
        for file in dataset(w).channel_files(clip, channel)
    ]


def heightmap_inputs(w):
    """The heightmaps of a data set that are files."""
    return dataset(w).heightmap_files


wildcard_constraints:
    configuration="|".join(project.catalogue.names()),
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
    """The clips or hurt versions that one job of a stage processes, see hobble.workflow.datasets."""
    return dataset(w).batch(w.batch)


def folders(*stages):
    """An input function: the folders with the files that earlier stages have made of the batch's clips."""
    return lambda w: dataset(w).folders(batch_of(w).clips, *stages)


def memory(stage):
    """A resource function: the MB of a job, see hobble.workflow.demands."""
    return lambda w, attempt: request_of(stage, w, attempt).mem_mb


def minutes(stage):
    """A resource function: the minutes of a job."""
    return lambda w, attempt: request_of(stage, w, attempt).runtime


def request_of(stage, w, attempt):
    """What a job requests, from its stage and its wildcards."""
    if stage == "measure":
        return demands.measure_request(configuration(w), w.measure, attempt)
    if stage == "training":
        return demands.training_request(configuration(w), attempt)
    data = dataset(w) if w.get("dataset") else configuration(w).dataset
    clip = w.get("clip")
    names = batch_of(w).clips if w.get("batch") else [clip] if clip else None
    return demands.job_request(stage, data, names, attempt)


def splits_of(w):
    """Clip -> "train" or "held_out", for the clips of a database."""
    return dataset(w).splits(channels_of_folder(w.channels))


def compared_clips(w):
    """The clips that are compared with the others, so that no motion is both trained on and held out."""
    return dataset(w).clips_to_compare(channels_of_folder(w.channels))


def rows_and_compared(w):
    """The folders with the rows of a database's clips, and those with the motion that is compared."""
    return [
        *dataset(w).folders(splits_of(w), "database"),
        *dataset(w).folders(compared_clips(w), "motion"),
    ]


def comparison_files():
    """Kind of file -> paths for the compared configurations, in their order."""
    compared = project.compared
    return {
        "configuration": [
            f"results/{each.name}/configuration.yaml" for each in compared
        ],
        "pipeline": [f"results/{each.name}/pipeline.json" for each in compared],
        "history": [each.network("history.csv") for each in compared],
        "measurements": [file for each in compared for file in each.result_files()],
    }
