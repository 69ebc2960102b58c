"""CITATION.cff follows the Citation File Format 1.2.0 and agrees with the package's metadata."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from deadwood_algorithms.params.tool import VERSION

yaml = pytest.importorskip("yaml")
ROOT = Path(__file__).parents[2]
# The schema's keys of a software record; it allows no others.
KEYS = {
    "abstract", "authors", "cff-version", "commit", "contact", "date-released", "doi", "identifiers", "keywords",
    "license", "license-url", "message", "preferred-citation", "references", "repository", "repository-artifact",
    "repository-code", "title", "type", "url", "version",
}  # fmt: skip
REQUIRED = {"authors", "cff-version", "message", "title"}
ENTITY = {"address", "alias", "city", "country", "date-end", "date-start", "email", "fax", "location", "name", "orcid",
          "post-code", "region", "tel", "website"}  # fmt: skip
REFERENCE = {
    "type",
    "title",
    "authors",
    "year",
    "status",
    "journal",
    "url",
    "notes",
    "doi",
}  # of its keys, those used here
STATUS = {"abstract", "advance-online", "in-preparation", "in-press", "preprint", "submitted"}
PERSON = (ENTITY - {"name", "location", "date-end", "date-start"}) | {
    "affiliation",
    "family-names",
    "given-names",
    "name-particle",
    "name-suffix",
}


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    return yaml.load((ROOT / "CITATION.cff").read_text(encoding="utf-8"), yaml.BaseLoader)  # texts as they stand


def test_the_schemas_rules(citation):
    assert set(citation) <= KEYS
    assert set(citation) >= REQUIRED
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] in ("software", "dataset")
    for name in ("message", "title", "abstract", "version", "license"):
        assert isinstance(citation[name], str)
        assert citation[name]
    assert citation["authors"]
    for author in citation["authors"]:
        assert set(author) <= (ENTITY if "name" in author else PERSON)
    assert len(citation["keywords"]) == len(set(citation["keywords"])) > 0
    for each in citation.get("references", ()):
        assert {"type", "title", "authors"} <= set(each) <= REFERENCE
        assert each.get("status", "preprint") in STATUS
    if "date-released" in citation:
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", citation["date-released"])
    for name in ("url", "repository", "repository-code", "repository-artifact", "license-url"):
        assert citation.get(name, "https://x").startswith(("https://", "http://", "ftp://", "sftp://"))


def test_it_is_the_package_that_is_cited(citation):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["version"] == VERSION
    assert citation["license"] == project["license"]  # an SPDX expression
    assert citation["authors"] == project["authors"]
    assert set(citation["keywords"]) <= set(project["keywords"])
    assert citation["abstract"].startswith(project["description"])
    holder = re.search(r"Copyright \(c\) \d+, (.+)", (ROOT / "LICENSE").read_text(encoding="utf-8"))
    assert holder is not None
    assert holder[1].lower() in [author["name"].lower() for author in citation["authors"]]
