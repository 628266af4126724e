# Objects such as `clips`, `datasets` and `demands` are made in the Snakefile.


def channels_of(batch):
    """The channels whose values the rule `channel_clips` reads for a batch.

    A channel is a set of network inputs besides motion and ground. The channel of severities is left out for hurt
    versions, because the rule `hurt_clips` makes its values.
    """
    names = datasets.channel_sources.channels(batch.dataset)
    return [name for name in names if not (batch.hurt and name == clips.hurt_channel)]


def for_channels(batch, paths):
    """All `paths` with {channel} replaced by the batch's first channel, then all with its second channel, ..."""
    return [
        path.replace("{channel}", name) for name in channels_of(batch) for path in paths
    ]


def channel_files(batch):
    """The files that a channel reads for a clip, as one list for each pair of channel and clip.

    The pairs of the first channel with all clips come first, then those of the second channel, ...
    """
    return [
        datasets.channel_sources.files(batch.dataset, clip, name)
        for name in channels_of(batch)
        for clip in batch.clips
    ]


# A batch is a set of clips that one job processes. Each batch has its own rule.
for batch in filter(channels_of, [*batches_of_clips, *batches_of_hurt_versions]):

    rule:
        """The values of the data set's channels in each frame of clips and of their mirrors."""
        name:
            batch.rule("channel_clips")
        input:
            clip=for_channels(batch, batch.of_clips("motion/{clip}.npz")),
            report=for_channels(batch, batch.of_clips("motion/{clip}.json")),
            mirror=for_channels(batch, batch.of_mirrors("motion/{clip}.npz")),
            files=lambda w, batch=batch: keep_local(
                [file for files in channel_files(batch) for file in files]
            ),
        output:
            values=for_channels(batch, batch.of_clips("channels/{channel}/{clip}.npz")),
            report=for_channels(batch, batch.of_clips("channels/{channel}/{clip}.json")),
            mirror=for_channels(
                batch, batch.of_mirrors("channels/{channel}/{clip}.npz")
            ),
            mirror_report=for_channels(
                batch, batch.of_mirrors("channels/{channel}/{clip}.json")
            ),
        log:
            batch.log("channels", "channel_clips"),
        benchmark:
            batch.benchmark("channels", "channel_clips")
        threads: 1
        resources:
            # The numbers below are MB and seconds for each thousand frames.
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 4, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.2 * len(channels_of(batch)), attempt
            ),
        params:
            # One dictionary for each pair of channel and clip. A pair is a piece of the job, see
            # hobble.workflow.batch_job.
            per_clip=lambda w, batch=batch: [
                {
                    "clip": clip,
                    "channel": name,
                    "source": datasets.channel_sources.source(
                        batch.dataset, clip, name
                    ),
                    "code": package.code("channel_clips", f"hobble.channels.{name}"),
                }
                for name in channels_of(batch)
                for clip in batch.clips
            ],
            # Name of an input -> the number of its files for each piece.
            files_per_clip=lambda w, batch=batch: {
                "files": [len(files) for files in channel_files(batch)]
            },
        script:
            "../scripts/channel_clips.py"
