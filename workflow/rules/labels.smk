rule labels_clips:
    """Contacts, phase and gait of clips and their mirrors. Label files beside a clip are used if there are any."""
    input:
        batches=folders("motion"),
        files=local_files(label_inputs),
    output:
        batch=directory("results/datasets/{dataset}/batches/labels/{batch}"),
    log:
        "results/datasets/{dataset}/logs/labels/labels_clips/{batch}.log",
    benchmark:
        "results/datasets/{dataset}/benchmarks/labels/labels_clips/{batch}.tsv"
    resources:
        mem_mb=memory("labels"),
        runtime=minutes("labels"),
    params:
        clips=lambda w: [
            {
                "clip": clip,
                "gait": dataset(w).entry(clip).gait,
                "ground": dataset(w).entry(clip).ground,
                "files": {"files": dataset(w).label_files(clip)},
            }
            for clip in batch_of(w).clips
        ],
        contents=contents_of(label_inputs),
        mirrored=lambda w: batch_of(w).mirrored,
        options=lambda w: plain(dataset(w).settings, "labels"),
        code=lambda w: package.code("labels_clips"),
    script:
        "../scripts/labels_clips.py"


rule look_page:
    """A page with one line for each clip of a data set: rig, frame rate, cadence, gaits, warnings."""
    input:
        # The page does not show channels. They are inputs so that a user who asks for the page learns of mistakes in
        # their files.
        batches=lambda w: dataset(w).folders(
            dataset(w).listed, "motion", "labels", "channels"
        ),
    output:
        html=report(
            "results/datasets/{dataset}/look.html",
            caption="../report/look.rst",
            category="Data sets",
            labels={"data set": "{dataset}"},
        ),
    log:
        "results/datasets/{dataset}/logs/labels/look_page.log",
    resources:
        mem_mb=memory("look"),
        runtime=minutes("look"),
    params:
        dataset=lambda w: w.dataset,
        clips=lambda w: list(dataset(w).listed),
        code=lambda w: package.code("look_page"),
    script:
        "../scripts/look_page.py"
