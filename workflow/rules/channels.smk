rule channel_clips:
    """The values of the data set's channels in each frame of clips and of their mirrors."""
    input:
        batches=folders("motion"),
        files=local_files(channel_inputs),
    output:
        batch=directory("results/datasets/{dataset}/batches/channels/{batch}"),
    log:
        "results/datasets/{dataset}/logs/channels/channel_clips/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/channels/channel_clips/{batch}.tsv"
    resources:
        mem_mb=memory("channels"),
        runtime=minutes("channels"),
    params:
        # One dictionary for each pair of a channel and a clip.
        clips=lambda w: [
            {
                "clip": clip,
                "channel": channel,
                "source": dataset(w).channel_source(clip, channel),
                "code": package.code("channel_clips", f"hobble.channels.{channel}"),
                "files": {"files": dataset(w).channel_files(clip, channel)},
            }
            for channel in batch_of(w).channels
            for clip in batch_of(w).clips
        ],
        contents=contents_of(channel_inputs),
        mirrored=lambda w: batch_of(w).mirrored,
    script:
        "../scripts/channel_clips.py"
