def channels_of(batch):
    """The channels whose values are read for a batch. The severities of hurt versions are made with the versions."""
    there = datasets.channel_sources.channels(batch.dataset)
    return [name for name in there if not (batch.hurt and name == clips.hurt_channel)]


def of_channels(batch, paths):
    """Paths with {channel}, for each channel of a batch."""
    return [
        path.replace("{channel}", name) for name in channels_of(batch) for path in paths
    ]


def channel_files(batch):
    """The files that each channel reads for each clip: one list for each channel and clip."""
    return [
        datasets.channel_sources.files(batch.dataset, clip, name)
        for name in channels_of(batch)
        for clip in batch.clips
    ]


for batch in filter(channels_of, [*batches_of_clips, *batches_of_versions]):

    rule:
        """The values of the data set's channels in each frame of the clips and their mirrors."""
        name:
            batch.rule("channel_clips")
        input:
            clip=of_channels(batch, batch.of_clips("motion/{clip}.npz")),
            report=of_channels(batch, batch.of_clips("motion/{clip}.json")),
            mirror=of_channels(batch, batch.of_mirrors("motion/{clip}.npz")),
            files=lambda w, batch=batch: keep_local(
                [file for files in channel_files(batch) for file in files]
            ),
        output:
            values=of_channels(batch, batch.of_clips("channels/{channel}/{clip}.npz")),
            report=of_channels(batch, batch.of_clips("channels/{channel}/{clip}.json")),
            mirror=of_channels(batch, batch.of_mirrors("channels/{channel}/{clip}.npz")),
            mirror_report=of_channels(
                batch, batch.of_mirrors("channels/{channel}/{clip}.json")
            ),
        log:
            batch.log("channels", "channel_clips"),
        benchmark:
            batch.benchmark("channels", "channel_clips")
        threads: 1
        resources:
            mem_mb=lambda w, attempt, batch=batch: demands.batch_memory(
                batch, 4, attempt
            ),
            runtime=lambda w, attempt, batch=batch: demands.batch_minutes(
                batch, 0.2 * len(channels_of(batch)), attempt
            ),
        params:
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
            files_per_clip=lambda w, batch=batch: {
                "files": [len(files) for files in channel_files(batch)]
            },
        script:
            "../scripts/channel_clips.py"
