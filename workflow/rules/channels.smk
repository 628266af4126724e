rule channel_clip:
    """The values of one channel in each frame of a clip."""
    input:
        clip="results/datasets/{dataset}/motion/{clip}.npz",
        report="results/datasets/{dataset}/motion/{clip}.json",
        files=lambda w: keep_local(
            datasets.channel_sources.files(w.dataset, w.clip, w.channel)
        ),
    output:
        values="results/datasets/{dataset}/channels/{channel}/{clip}.npz",
        report="results/datasets/{dataset}/channels/{channel}/{clip}.json",
    log:
        "results/datasets/{dataset}/logs/channels/channel_clip/{channel}/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/channels/channel_clip/{channel}/{clip}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: w.clip,
        channel=lambda w: w.channel,
        source=lambda w: datasets.channel_sources.source(w.dataset, w.clip, w.channel),
        code=lambda w: package.code("channel_clip", f"hobble.channels.{w.channel}"),
    script:
        "../scripts/channel_clip.py"


rule channel_mirror:
    """The values of one channel in each frame of a mirrored clip."""
    input:
        values="results/datasets/{dataset}/channels/{channel}/{clip}.npz",
        report="results/datasets/{dataset}/channels/{channel}/{clip}.json",
        clip="results/datasets/{dataset}/motion/{clip}_mirror.npz",
    output:
        values="results/datasets/{dataset}/channels/{channel}/{clip}_mirror.npz",
        report="results/datasets/{dataset}/channels/{channel}/{clip}_mirror.json",
    log:
        "results/datasets/{dataset}/logs/channels/channel_mirror/{channel}/{clip}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/channels/channel_mirror/{channel}/{clip}.tsv"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: demands.memory(w.dataset, w.clip, 4, attempt),
        runtime=lambda w, attempt: demands.minutes(w.dataset, w.clip, 0.1, attempt),
    params:
        clip=lambda w: f"{w.clip}_mirror",
        channel=lambda w: w.channel,
        code=lambda w: package.code("channel_mirror", f"hobble.channels.{w.channel}"),
    script:
        "../scripts/channel_mirror.py"
