"""The page of ``neurovis analyze`` in Chromium: it opens from a file, alone, on wide windows and narrow ones."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from chromium import chromium

import neurovis_spec as nv
from neurovis_spec.analysis.report import ReportOptions, analyze

pytestmark = pytest.mark.browser

SPECS = Path(__file__).parents[1] / "specs"


def test_it_shows_all_pictures_and_asks_nobody(tmp_path: Path) -> None:
    analyze(nv.compile(SPECS / "cpg_rbf.yaml"), tmp_path / "out", options=ReportOptions(start=9_428))
    (tmp_path / "alone").mkdir()
    alone = tmp_path / "alone" / "index.html"  # nothing is beside it
    alone.write_bytes((tmp_path / "out" / "index.html").read_bytes())

    async def main() -> None:
        async with chromium(tmp_path) as page:
            for width in (390, 1200):
                await page.size(width, 900)
                await page.call("Page.navigate", url=alone.as_uri())
                await page.until("document.readyState === 'complete' && document.images.length >= 12")
                assert await page.ask("[...document.images].every(image => image.complete && image.naturalWidth > 100)")
                assert await page.ask("[...document.images].every(image => image.alt.length > 5)")
                assert await page.ask("document.documentElement.scrollWidth <= innerWidth")
                assert await page.ask("performance.getEntriesByType('resource').every(x => x.name.startsWith('data:'))")
            assert page.errors == []

    asyncio.run(main())
