"""The version is stated alike everywhere; benchmarks/release.py builds and tries the archives."""

from pathlib import Path

import pytest
import release


def test_all_files_state_one_version() -> None:
    """pyproject.toml, CITATION.cff and the newest section of the changelog."""
    assert len(set(release.stated_versions(release.ROOT).values())) == 1


def test_files_that_differ_are_named(tmp_path: Path) -> None:
    """One file of another version, and one without any, stop a release."""
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "2.0"\n')
    (tmp_path / "CITATION.cff").write_text("title: x\nversion: 2.0\n")
    (tmp_path / "CHANGELOG.md").write_text("## [Unreleased]\n\n## [2.0] - 2026-01-01\n\n## [1.0]\n")
    assert release.one_version(tmp_path) == "2.0"
    (tmp_path / "CHANGELOG.md").write_text("## [Unreleased]\n")
    with pytest.raises(SystemExit, match=r"'CHANGELOG\.md': 'none'"):
        release.one_version(tmp_path)
