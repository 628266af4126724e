rule generate:
    """Motion of the character in scripted scenarios (walk, jog, crouch, limp), as one npz file and as BVH files."""
    input:
        weights=network_file("weights.npz"),
    output:
        scenarios="results/{configuration}/runtime/scenarios.npz",
        bvh=directory("results/{configuration}/runtime/bvh"),
    log:
        "results/{configuration}/logs/runtime/generate.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/generate.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        runtime=section("runtime"),
        code=network_code("generate", *display_modules()),
    script:
        "../scripts/generate.py"


rule export_onnx:
    """The network as an ONNX file, checked with onnxruntime. `mode`: how its weights are computed from the phase."""
    input:
        weights=network_file("weights.npz"),
    output:
        onnx="results/{configuration}/export/{mode}.onnx",
    log:
        "results/{configuration}/logs/runtime/export_onnx_{mode}.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/export_onnx_{mode}.tsv"
    wildcard_constraints:
        mode="constant|linear|cubic",
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        mode=lambda w: w.mode,
        code=network_code("export_onnx"),
    script:
        "../scripts/export_onnx.py"


rule export_release:
    """The network as .bin files like those of Holden et al. (2017), for their demo and its ports."""
    input:
        weights=network_file("weights.npz"),
    output:
        folder=directory("results/{configuration}/export/pfnn"),
    log:
        "results/{configuration}/logs/runtime/export_release.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/export_release.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=network_code("export_release"),
    script:
        "../scripts/export_release.py"


rule export_glb:
    """The character for a game engine as a glTF 2.0 file: body, skeleton, loops of each gait."""
    input:
        weights=network_file("weights.npz"),
    output:
        glb="results/{configuration}/export/character.glb",
    log:
        "results/{configuration}/logs/runtime/export_glb.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/export_glb.tsv"
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        runtime=section("runtime"),
        code=network_code("export_glb", *display_modules()),
    script:
        "../scripts/export_glb.py"


rule engine_wasm:
    """The runtime in C as WebAssembly, compiled by zig. It is the same for all configurations."""
    input:
        sources=keep_local(package.files("engine/c/*.[ch]")),
    output:
        wasm="results/page/engine.wasm",
    log:
        "results/page/logs/runtime/engine_wasm.log",
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=package.code("engine_wasm"),
    script:
        "../scripts/engine_wasm.py"


rule export_engine:
    """The character for any game engine: a runtime in C, character.hob, examples, and traces to check ports against."""
    input:
        weights=network_file("weights.npz"),
        sources=keep_local(package.files("engine/c/**/*", "engine/examples/**/*")),
        wasm=rules.engine_wasm.output.wasm,
    output:
        folder=directory("results/{configuration}/export/engine"),
    log:
        "results/{configuration}/logs/runtime/export_engine.log",
    benchmark:
        "results/{configuration}/benchmarks/runtime/export_engine.tsv"
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        runtime=section("runtime"),
        code=network_code("export_engine", *display_modules()),
    script:
        "../scripts/export_engine.py"


rule engine_libraries:
    """The runtime in C as shared libraries for Windows, macOS and Linux, the same for all configurations."""
    input:
        sources=rules.engine_wasm.input.sources,
    output:
        folder=directory("results/page/engine_libraries"),
    log:
        "results/page/logs/runtime/engine_libraries.log",
    resources:
        mem_mb=1500,
        runtime=10,
    params:
        code=package.code("engine_libraries"),
    script:
        "../scripts/engine_libraries.py"


rule blender_addon:
    """An add-on for Blender that walks the character along a curve, with the runtime in C and the body."""
    input:
        engine=rules.export_engine.output.folder,
        body=rules.export_glb.output.glb,
        libraries=rules.engine_libraries.output.folder,
        addon=keep_local(
            [
                str(project.base / "workflow" / "blender" / "hobble_blender" / name)
                for name in ("__init__.py", "blender_manifest.toml")
            ]
        ),
    output:
        addon="results/{configuration}/export/hobble_blender.zip",
    log:
        "results/{configuration}/logs/runtime/blender_addon.log",
    resources:
        mem_mb=500,
        runtime=5,
    params:
        code=package.code("blender_addon"),
    script:
        "../scripts/blender_addon.py"
