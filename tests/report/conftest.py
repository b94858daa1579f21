"""The documents of the small kit, in a folder, and a browser to open them in."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from drkid.kit import Kit
from drkid.report.scene import Scene, scene_of

FLAGS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


@pytest.fixture(scope="session")
def scene(kit) -> Scene:
    """The small kit as its documents see it."""
    return scene_of(kit)


@pytest.fixture(scope="session")
def odd_kit(kit) -> Kit:
    """The small kit, made of a file whose name is markup."""
    return replace(kit, source=replace(kit.source, name="</script><img src=x onerror=alert(1)>&.stl"))


@pytest.fixture(scope="session")
def documents(odd_kit, tmp_path_factory) -> Path:
    """A folder with the documents of that kit."""
    folder = tmp_path_factory.mktemp("documents")
    for name, content in odd_kit.documents(odd_kit, lambda _what, _fraction: None).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium, the system's own."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("no chromium to open pages in: apt-get install chromium")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 — only where there is a browser

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield opened
        opened.close()


class Watched:
    """A page, and what went wrong on it or left it."""

    def __init__(self, page):
        self.page, self.errors, self.requests = page, [], []
        page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("dialog", lambda dialog: (self.errors.append(dialog.message), dialog.dismiss()))
        page.on("request", lambda request: self.requests.append(request.url))


@pytest.fixture
def watched(browser):
    page = browser.new_page(viewport={"width": 900, "height": 700})
    yield Watched(page)
    page.close()
