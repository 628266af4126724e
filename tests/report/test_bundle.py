"""The page's scripts: from a lock file, always the same bytes, and a message if they cannot be made."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.report.bundle import bundle_page_scripts, install_npm_packages


def test_the_bundle_needs_nothing_else_and_comes_out_the_same(
    script: str, modules: Path, wasm: Path, tmp_path: Path
) -> None:
    if not script:
        pytest.skip("the npm registry cannot be reached, so the page has no scripts")
    bundle_page_scripts(modules, wasm, tmp_path / "again.js")
    assert (tmp_path / "again.js").read_text(encoding="utf-8") == script
    assert not re.search(r"^\s*(import|export)\b", script, re.MULTILINE)
    assert "</script" not in script.lower()
    assert "three.js" in script.lower() or "Three.js" in script


def test_a_script_that_is_wrong_is_named(script: str, modules: Path, wasm: Path, tmp_path: Path) -> None:
    if not script:
        pytest.skip("the npm registry cannot be reached, so the page has no scripts")
    (tmp_path / "index.js").write_text("const a = ;")
    with pytest.raises(HobbleError, match=r"index\.js:1"):
        bundle_page_scripts(modules, wasm, tmp_path / "out.js", tmp_path)
    assert not (tmp_path / "out.js").exists()


@pytest.mark.slow
def test_without_the_registry_the_message_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("npm_config_registry", "http://127.0.0.1:9/")
    monkeypatch.setenv("npm_config_cache", str(tmp_path / "cache"))
    monkeypatch.setenv("npm_config_fetch_retries", "0")
    with pytest.raises(HobbleError, match=r"could not download .* from the npm registry") as error:
        install_npm_packages(tmp_path / "page")
    assert "Traceback" not in str(error.value)
