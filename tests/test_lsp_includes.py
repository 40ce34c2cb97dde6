"""Included files as an editor sees them: a real client, several documents."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from lsp_session import session
from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pytest_lsp import LanguageClient
from test_lsp_modules import KNEES, LEGS, SPEC

BROKEN = LEGS.replace("activation: soft, desc", "activation: sofd, desc")


class Workspace:
    """A folder with a spec and what it includes, and a client."""

    def __init__(self, client: LanguageClient, folder: Path) -> None:
        self.client = client
        self.folder = folder
        self.texts: dict[str, str] = {}
        self.version = 0
        (folder / "library").mkdir()
        for name, text in (("spec.yaml", SPEC), ("library/legs.yaml", LEGS), ("library/knees.yaml", KNEES)):
            self.write(name, text)

    def write(self, name: str, text: str) -> None:
        """Write a file, which is not the same as to change an open document."""
        (self.folder / name).write_text(text, encoding="utf-8")

    def uri(self, name: str) -> str:
        return (self.folder / name).as_uri()

    def document(self, name: str) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.uri(name))

    def open(self, name: str, text: str | None = None) -> None:
        self.texts[name] = (self.folder / name).read_text(encoding="utf-8") if text is None else text
        item = types.TextDocumentItem(self.uri(name), "yaml", self.version, self.texts[name])
        self.client.text_document_did_open(types.DidOpenTextDocumentParams(item))

    def type(self, name: str, text: str) -> None:
        self.texts[name], self.version = text, self.version + 1
        change = types.TextDocumentContentChangeWholeDocument(text)
        where = types.VersionedTextDocumentIdentifier(version=self.version, uri=self.uri(name))
        self.client.text_document_did_change(types.DidChangeTextDocumentParams(where, [change]))

    def close(self, name: str) -> None:
        self.client.text_document_did_close(types.DidCloseTextDocumentParams(self.document(name)))

    def save(self, name: str) -> None:
        self.client.text_document_did_save(types.DidSaveTextDocumentParams(self.document(name)))

    def codes(self, name: str) -> list[tuple[object, int]] | None:
        """Codes and lines (from 0) of what is known of a file; None before anything has been said of it."""
        found = self.client.diagnostics.get(self.uri(name))
        return None if found is None else [(item.code, item.range.start.line) for item in found]

    async def until(self, **wanted: list[tuple[object, int]] | None) -> None:
        """Wait until this is what is known of the files."""
        names = {"spec": "spec.yaml", "legs": "library/legs.yaml", "knees": "library/knees.yaml"}
        for _ in range(40):
            if all(self.codes(names[name]) == codes for name, codes in wanted.items()):
                return
            try:
                await asyncio.wait_for(self.client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS), 20)
            except TimeoutError:
                break
        assert {name: self.codes(names[name]) for name in wanted} == wanted

    def at(self, name: str, needle: str, offset: int = 0) -> types.Position:
        text = self.texts[name] if name in self.texts else (self.folder / name).read_text(encoding="utf-8")
        before = text[: text.index(needle) + offset]
        line = before[before.rfind("\n") + 1 :]
        return types.Position(before.count("\n"), len(line.encode("utf-16-le")) // 2)

    async def labels(self, name: str, where: types.Position) -> set[str]:
        params = types.CompletionParams(self.document(name), where)
        found = await self.client.text_document_completion_async(params)
        assert isinstance(found, types.CompletionList)
        return {item.label for item in found.items}


def work(
    folder: Path,
    scenario: Callable[[Workspace], Awaitable[None]],
    *,
    rooted: bool = True,
    watched: list[types.Registration] | None = None,
) -> None:
    """Run a scenario in a workspace with a server that begins for it and ends after it. ``watched``: the client watches
    files for the server, and this is what it is asked for."""

    async def run() -> None:
        folders = [types.WorkspaceFolder(folder.as_uri(), "work")] if rooted else None
        capabilities = types.ClientCapabilities()
        async with session() as client:
            if watched is not None:
                watches = types.DidChangeWatchedFilesClientCapabilities(dynamic_registration=True)
                capabilities.workspace = types.WorkspaceClientCapabilities(did_change_watched_files=watches)

                def register(params: types.RegistrationParams) -> None:
                    watched.extend(params.registrations)

                feature: Callable[[str], Callable[[object], object]] = client.feature  # has no annotations of its own
                feature(types.CLIENT_REGISTER_CAPABILITY)(register)
            await client.initialize_session(types.InitializeParams(capabilities, workspace_folders=folders))
            await scenario(Workspace(client, folder))

    asyncio.run(run())


def test_findings_of_an_included_file_stand_in_that_file_and_go_away(tmp_path: Path) -> None:
    watched: list[types.Registration] = []

    async def scenario(space: Workspace) -> None:
        space.write("library/legs.yaml", BROKEN)
        space.open("spec.yaml")
        await space.until(legs=[("unknown-activation", 6)], spec=[("unknown-activation", 2)])
        (told,) = space.client.diagnostics[space.uri("spec.yaml")]
        assert told.message.startswith("'legs.yaml' has an error in line 7: ")
        assert told.range.start == space.at("spec.yaml", "library/legs")
        (told,) = space.client.diagnostics[space.uri("library/legs.yaml")]
        assert told.range.start == space.at("library/legs.yaml", "sofd")
        assert "did you mean 'soft'?" in told.message
        space.write("library/legs.yaml", LEGS)
        space.save("spec.yaml")
        await space.until(legs=[], spec=[])
        space.write("library/knees.yaml", KNEES.replace("S -> J", "S -> Jay"))
        change = types.FileEvent(space.uri("library/knees.yaml"), types.FileChangeType.Changed)
        space.client.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams([change]))
        await space.until(knees=[("unknown-neuron", 6)], spec=[("unknown-neuron", 2)])
        space.close("spec.yaml")
        await space.until(legs=[], spec=[], knees=[])
        assert [registration.method for registration in watched] == [types.WORKSPACE_DID_CHANGE_WATCHED_FILES]

    work(tmp_path, scenario, watched=watched)


def test_what_is_typed_in_an_included_file_is_seen_by_the_spec(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        space.open("spec.yaml")
        await space.until(spec=[])
        space.open("library/legs.yaml")
        await space.until(legs=[])
        space.type("library/legs.yaml", LEGS.replace("K: {count: 3,", "Kay: {count: 3,"))
        await space.until(
            legs=[("bad-range", 9)],
            spec=[("unknown-neuron", 15), ("bad-range", 2)],
        )
        assert "Kay" in await space.labels("spec.yaml", space.at("spec.yaml", "left.K ->", 5))
        space.close("library/legs.yaml")  # without being saved
        await space.until(legs=[], spec=[])
        space.write("library/legs.yaml", LEGS.replace("soft", "softer"))
        space.type("spec.yaml", SPEC.replace("activation: soft", "activation: softer"))
        await space.until(spec=[])

    work(tmp_path, scenario)


def test_an_included_file_is_no_defective_spec(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        space.open("library/legs.yaml")
        await space.until(legs=[])
        space.type("library/legs.yaml", BROKEN)
        await space.until(legs=[("unknown-activation", 6)])
        space.open("spec.yaml")
        await space.until(legs=[("unknown-activation", 6)], spec=[("unknown-activation", 2)])
        space.type("library/legs.yaml", LEGS)
        await space.until(legs=[], spec=[])
        space.type("library/legs.yaml", BROKEN)
        await space.until(legs=[("unknown-activation", 6)], spec=[("unknown-activation", 2)])
        space.close("spec.yaml")
        await space.until(legs=[("unknown-activation", 6)], spec=[])
        space.type("library/legs.yaml", LEGS)
        await space.until(legs=[])

    work(tmp_path, scenario)


def test_a_file_that_was_missing_is_found_when_it_is_there(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        (space.folder / "library" / "knees.yaml").unlink()
        space.open("spec.yaml")
        await space.until(legs=[("file-missing", 1)], spec=[("file-missing", 2)])
        space.write("library/knees.yaml", KNEES)
        space.save("spec.yaml")
        await space.until(legs=[], spec=[])
        assert "J" in await space.labels("spec.yaml", space.at("spec.yaml", "right.knee.J", 11))

    work(tmp_path, scenario)


def test_definition_and_hover_across_files(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        space.write("library/knees.yaml", KNEES.replace("    neurons: {J", "    title: 😀\n    neurons: {J"))
        space.open("spec.yaml")
        await space.until(spec=[])

        async def leads(where: types.Position) -> types.Location:
            found = await space.client.text_document_definition_async(
                types.DefinitionParams(space.document("spec.yaml"), where)
            )
            assert isinstance(found, types.Location)
            return found

        start = space.at("library/knees.yaml", "J: {count")
        found = await leads(space.at("spec.yaml", "right.knee.J", 12))
        end = types.Position(start.line, start.character + 1)
        assert found == types.Location(space.uri("library/knees.yaml"), types.Range(start, end))
        found = await leads(space.at("spec.yaml", "library/legs", 9))
        assert (found.uri, found.range.start) == (space.uri("library/legs.yaml"), types.Position(0, 0))
        space.open("library/legs.yaml", "# above\n" + LEGS)
        found = await leads(space.at("spec.yaml", "left.K", 6))
        assert (found.uri, found.range.start) == (
            space.uri("library/legs.yaml"),
            space.at("library/legs.yaml", "K: {count"),
        )
        params = types.HoverParams(space.document("spec.yaml"), space.at("spec.yaml", "left.K", 6))
        hover = await space.client.text_document_hover_async(params)
        assert hover is not None
        assert isinstance(hover.contents, types.MarkupContent)
        assert hover.contents.value.startswith("**left.K**: 3 neurons (K1 … K3) of the module `leg` (in legs.yaml)")

    work(tmp_path, scenario)


def test_a_group_of_a_module_is_renamed_in_spec_and_library(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        (space.folder / "other.yaml").write_text(SPEC.replace("walker", "other"))
        space.open("spec.yaml")
        await space.until(spec=[])
        params = types.RenameParams(space.document("spec.yaml"), space.at("spec.yaml", "left.K", 6), "Kernel")
        result = await space.client.text_document_rename_async(params)
        assert result is not None
        assert result.changes is not None
        counts = {uri: len(edits) for uri, edits in result.changes.items()}
        assert counts == {
            space.uri("spec.yaml"): 7,
            space.uri("other.yaml"): 7,
            space.uri("library/legs.yaml"): 4,
        }
        first = space.at("library/legs.yaml", "K: {count")
        assert result.changes[space.uri("library/legs.yaml")][0] == types.TextEdit(
            types.Range(first, types.Position(first.line, first.character + 1)), "Kernel"
        )

    work(tmp_path, scenario)


def test_without_a_workspace_only_open_files_are_renamed(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        space.open("spec.yaml")
        await space.until(spec=[])
        params = types.RenameParams(space.document("spec.yaml"), space.at("spec.yaml", "left.K", 6), "Kernel")
        with pytest.raises(JsonRpcException, match=r"'legs\.yaml', which has this name too, is not in the workspace"):
            await space.client.text_document_rename_async(params)
        space.open("library/legs.yaml")
        result = await space.client.text_document_rename_async(params)
        assert result is not None
        assert result.changes is not None
        assert set(result.changes) == {space.uri("spec.yaml"), space.uri("library/legs.yaml")}

    work(tmp_path, scenario, rooted=False)


def test_completion_within_an_included_file(tmp_path: Path) -> None:
    async def scenario(space: Workspace) -> None:
        space.open("library/legs.yaml", LEGS + "mod")
        where = types.Position(LEGS.count("\n"), 3)
        assert {"models", "modules", "rules", "neurovis"} - await space.labels("library/legs.yaml", where) == {
            "modules",
            "neurovis",
        }
        space.type("library/legs.yaml", LEGS.replace("knee.J -> K: ", "knee."))
        where = space.at("library/legs.yaml", "knee.{", 5)
        assert {"J", "S"} <= await space.labels("library/legs.yaml", where)

    work(tmp_path, scenario)
