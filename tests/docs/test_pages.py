"""The pages hold together: contents, links, pictures, and the site that is built of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.docs.pages import DOCS, PAGES, READ_BY_PEOPLE, without_blocks

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[\w-]+)?\)")
MOST_BYTES = 160_000
"""Of a picture: the console carries them all."""


def test_every_page_stands_in_the_contents_once() -> None:
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]
    assert sorted(re.findall(r"([\w-]+\.md)", nav)) == [page.name for page in PAGES]


@pytest.mark.parametrize("page", READ_BY_PEOPLE, ids=lambda page: page.name)
def test_what_a_page_links_to_is_there(page: Path) -> None:
    targets = [target for target in LINK.findall(without_blocks(page)) if "://" not in target]
    assert [target for target in targets if not (page.parent / target).is_file()] == []
    if page in PAGES:  # the site and the console's Help hold nothing else
        assert [target for target in targets if "/" in target] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_headings_of_a_page_differ_so_that_links_into_it_hold(page: Path) -> None:
    headings = re.findall(r"^#+ (.+)$", without_blocks(page), re.MULTILINE)
    assert headings
    assert len(headings) == len(set(headings))


def test_every_picture_is_small_and_shown_somewhere() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    pictures = sorted(DOCS.glob("*.webp"))
    assert pictures
    assert [picture.name for picture in pictures if f"({picture.name})" not in text] == []
    assert [picture.name for picture in pictures if picture.stat().st_size > MOST_BYTES] == []


def test_the_site_is_built_without_a_warning_and_needs_no_network(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr
    for page in PAGES:
        html = (tmp_path / f"{page.stem}.html").read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|link|img|iframe)\b[^>]*?\b(?:src|href)=\"?([^\"\s>]+)", html)
        assert loaded
        assert [address for address in loaded if "://" in address] == []
