"""config/README.md and the JSON schemas are those of the models."""

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from hobble.config.describe import readme, schemas


def test_the_page_and_the_schemas_are_up_to_date(root: Path) -> None:
    remedy = "run python -m hobble.config.describe"
    assert (root / "config/README.md").read_text() == readme(), remedy
    for kind, schema in schemas().items():
        assert json.loads((root / f"config/schema/{kind}.json").read_text()) == json.loads(
            json.dumps(schema)
        ), remedy


@pytest.mark.parametrize(
    ("kind", "files"), [("configuration", "*"), ("dataset", "datasets/*"), ("skeleton", "skeletons/*")]
)
def test_shipped_files_fit_their_schema_and_a_wrong_key_does_not(root: Path, kind: str, files: str) -> None:
    check = jsonschema.Draft202012Validator(schemas()[kind])
    paths = sorted((root / "config").glob(f"{files}.yaml"))
    assert len(paths) > 3
    for path in paths:
        values = yaml.safe_load(path.read_text()) or {}
        assert [f"{path}: {error.message}" for error in check.iter_errors(values)] == []
        assert list(check.iter_errors({**values, "trainnig": 1}))
