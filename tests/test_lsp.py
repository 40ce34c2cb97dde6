"""The language server as an editor sees it: a real client, which speaks its protocol."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path

import pytest
from lsp_session import process, session
from lsprotocol import types
from pygls.exceptions import JsonRpcException
from pytest_lsp import LanguageClient
from test_lsp_answers import BASE, REST

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.canonical import format_text
from neurovis_spec.lsp import server
from neurovis_spec.lsp.check import Checked, check
from neurovis_spec.lsp.document import Document

SPEC = BASE + REST


class Editor:
    """One document in a client, whose changes wait until the server has said what it finds."""

    def __init__(self, client: LanguageClient, path: Path) -> None:
        self.client = client
        self.uri = path.as_uri()
        self.text = ""
        self.version = 0

    @property
    def document(self) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.uri)

    async def findings(self) -> list[types.Diagnostic]:
        """What the server publishes next."""
        await asyncio.wait_for(self.client.wait_for_notification(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS), 20)
        return list(self.client.diagnostics[self.uri])

    async def open(self, text: str) -> list[types.Diagnostic]:
        self.text = text
        item = types.TextDocumentItem(self.uri, "yaml", self.version, text)
        self.client.text_document_did_open(types.DidOpenTextDocumentParams(item))
        return await self.findings()

    def type(self, text: str) -> None:
        """Change the text, without waiting."""
        self.text, self.version = text, self.version + 1
        change = types.TextDocumentContentChangeWholeDocument(text)
        where = types.VersionedTextDocumentIdentifier(version=self.version, uri=self.uri)
        self.client.text_document_did_change(types.DidChangeTextDocumentParams(where, [change]))

    def at(self, needle: str, offset: int = 0) -> types.Position:
        """The position of a text, in units of UTF-16, counted without any of our code."""
        before = self.text[: self.text.index(needle) + offset]
        line = before[before.rfind("\n") + 1 :]
        return types.Position(before.count("\n"), len(line.encode("utf-16-le")) // 2)


def edit(
    folder: Path,
    scenario: Callable[[Editor], Awaitable[None]],
    capabilities: types.ClientCapabilities | None = None,
    begin: Callable[[], AbstractAsyncContextManager[LanguageClient]] = session,
) -> None:
    """Run a scenario with a server that begins for it and ends after it."""

    async def run() -> None:
        async with begin() as client:
            given = types.InitializeParams(capabilities=capabilities or types.ClientCapabilities())
            result = await client.initialize_session(given)
            assert result.server_info is not None
            assert result.server_info.name == "neurovis"
            await scenario(Editor(client, folder / "spec.yaml"))

    asyncio.run(run())


def test_findings_follow_what_is_typed(tmp_path: Path) -> None:
    async def scenario(editor: Editor) -> None:
        assert await editor.open(SPEC) == []
        for wrong in ("tanh1", "tanh2", "tahn"):  # typed quickly: only the last is looked at
            editor.type(SPEC.replace("activation: swish", f"activation: {wrong}"))
        (finding,) = await editor.findings()
        assert finding.code == "unknown-activation"
        assert "did you mean 'tanh'?" in finding.message
        assert finding.severity == types.DiagnosticSeverity.Error
        assert finding.source == "neurovis"
        assert finding.range.start == editor.at("tahn")
        assert finding.range.end == editor.at("tahn", 4)
        editor.type(SPEC + "layout: [")
        assert [finding.code for finding in await editor.findings()] == ["duplicate-key", "yaml-syntax"]
        editor.type(SPEC)
        assert await editor.findings() == []
        editor.client.text_document_did_close(types.DidCloseTextDocumentParams(editor.document))
        assert await editor.findings() == []

    edit(tmp_path, scenario, begin=process)


ODD_URIS = ("file:///tmp/a%00b.yaml", "file:///" + 3000 * "a/", "file:", "file:///%ff", "file:///a%2520b.yaml")


def test_a_uri_that_no_file_can_have_is_a_document_like_others(tmp_path: Path) -> None:
    wrong = SPEC.replace("activation: swish", "activation: tahn")

    async def scenario(editor: Editor) -> None:
        odd = [Editor(editor.client, tmp_path / "odd.yaml") for _ in ODD_URIS]
        for one, uri in zip(odd, ODD_URIS, strict=True):
            one.uri = uri
            (finding,) = await one.open(wrong)
            assert finding.code == "unknown-activation"
        assert await editor.open(SPEC) == []
        for one in (*odd, editor):
            where = types.HoverParams(one.document, one.at("count"))
            assert await editor.client.text_document_hover_async(where) is not None
        editor.type(wrong)
        assert [finding.code for finding in await editor.findings()] == ["unknown-activation"]

    edit(tmp_path, scenario)


def test_a_mistake_of_the_compiler_is_said_and_leaves_no_old_findings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stumbling(document: Document) -> Checked:
        if "stumble" in document.text.text:
            raise IndexError("a mistake")
        return check(document)

    monkeypatch.setattr(server, "check", stumbling)

    async def scenario(editor: Editor) -> None:
        (finding,) = await editor.open(SPEC.replace("activation: swish", "activation: tahn"))
        assert finding.code == "unknown-activation"
        editor.type(SPEC + "# stumble\n")
        (finding,) = await editor.findings()
        assert finding.code == "internal"
        assert finding.severity == types.DiagnosticSeverity.Error
        assert finding.range.start == types.Position(0, 0)
        editor.type(SPEC)
        assert await editor.findings() == []

    edit(tmp_path, scenario)


def test_an_unsaved_document_reads_the_data_files_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text("1,2\n3,4\n")
    text = "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 1}}\nconnections: {A -> A: {matrix: {file: w.csv}}}\n"

    async def scenario(editor: Editor) -> None:
        assert await editor.open(text) == []
        editor.type(text.replace("w.csv", "v.csv"))
        (finding,) = await editor.findings()
        assert finding.code == "file-missing"

    edit(tmp_path, scenario)
    assert not (tmp_path / "spec.yaml").exists()


def test_places_count_utf_16_units(tmp_path: Path) -> None:
    text = 'neurovis: 1\nname: x\nneurons: {A: {label: "𝜎😀", activation: tahn}, B: {label: "😀"}}\n'
    text += "connections: {A -> B: 1}\n"

    async def scenario(editor: Editor) -> None:
        (finding,) = await editor.open(text)
        assert (finding.range.start, finding.range.end) == (editor.at("tahn"), editor.at("tahn", 4))
        where = editor.at("B: {label")
        hover = await editor.client.text_document_hover_async(types.HoverParams(editor.document, where))
        assert hover is not None
        assert isinstance(hover.contents, types.MarkupContent)
        assert hover.contents.value.startswith("**B**: a single neuron")
        assert hover.range == types.Range(where, types.Position(where.line, where.character + 1))
        result = await editor.client.text_document_rename_async(types.RenameParams(editor.document, where, "C"))
        assert result is not None
        assert result.changes is not None
        ranges = [change.range for change in result.changes[editor.uri]]
        places = [editor.at("B: {label"), editor.at("B: 1")]
        assert ranges == [types.Range(p, types.Position(p.line, p.character + 1)) for p in places]

    edit(tmp_path, scenario)


def test_a_client_that_counts_code_points_is_answered_in_them(tmp_path: Path) -> None:
    general = types.GeneralClientCapabilities(position_encodings=[types.PositionEncodingKind.Utf32])

    async def scenario(editor: Editor) -> None:
        (finding,) = await editor.open('neurovis: 1\nname: x\nneurons: {A: {label: "𝜎😀", activation: tahn}}\n')
        assert finding.range.start.character == editor.text.splitlines()[2].index("tahn")

    edit(tmp_path, scenario, types.ClientCapabilities(general=general))


def test_completion_hover_definition_and_symbols(tmp_path: Path) -> None:
    async def scenario(editor: Editor) -> None:
        client, document = editor.client, editor.document
        await editor.open(SPEC)
        where = editor.at("K1 + K3..K5", 6)
        location = await client.text_document_definition_async(types.DefinitionParams(document, where))
        start = editor.at("K: {count")
        assert location == types.Location(
            editor.uri, types.Range(start, types.Position(start.line, start.character + 1))
        )
        shipped = await client.text_document_definition_async(types.DefinitionParams(document, editor.at("{delta", 2)))
        assert isinstance(shipped, types.Location)
        assert shipped.uri.endswith("/library/rules.yaml")
        hover = await client.text_document_hover_async(types.HoverParams(document, editor.at("rate: beta", 7)))
        assert hover is not None
        assert isinstance(hover.contents, types.MarkupContent)
        assert "= 3" in hover.contents.value
        symbols = await client.text_document_document_symbol_async(types.DocumentSymbolParams(document))
        assert symbols is not None
        assert "connections" in [symbol.name for symbol in symbols]
        editor.type(SPEC + "render: {theme: d")  # broken: completion is asked for in the middle of a word
        where = editor.at("theme: d", 8)
        found = await client.text_document_completion_async(types.CompletionParams(document, where))
        assert isinstance(found, types.CompletionList)
        assert [item.label for item in found.items] == ["default", "dark", "print", "paper"]
        replaced = types.Range(types.Position(where.line, where.character - 1), where)
        assert found.items[0].text_edit == types.TextEdit(replaced, "default")

    edit(tmp_path, scenario)


def test_a_refused_rename_says_why(tmp_path: Path) -> None:
    async def scenario(editor: Editor) -> None:
        client, document = editor.client, editor.document
        await editor.open(SPEC)
        where = editor.at("K3..K5", 5)
        prepared = await client.text_document_prepare_rename_async(types.PrepareRenameParams(document, where))
        assert isinstance(prepared, types.PrepareRenamePlaceholder)
        assert prepared.placeholder == "K"
        with pytest.raises(JsonRpcException, match="'O' is declared already, in line 12"):
            await client.text_document_rename_async(types.RenameParams(document, where, "O"))
        nothing = types.PrepareRenameParams(document, editor.at("name: small", 7))
        with pytest.raises(JsonRpcException, match="no name here"):
            await client.text_document_prepare_rename_async(nothing)

    edit(tmp_path, scenario)


def test_a_refused_rename_writes_nothing() -> None:
    uri = "untitled:one"
    opened = {"uri": uri, "languageId": "yaml", "version": 1, "text": "neurovis: 1\nname: x\nneurons: {A: {}, B: {}}\n"}
    asked = {"textDocument": {"uri": uri}, "position": {"line": 2, "character": 10}, "newName": "B"}
    spoken = (
        message(id=1, method="initialize", params={"capabilities": {}, "processId": None, "rootUri": None})
        + message(method="initialized", params={})
        + message(method="textDocument/didOpen", params={"textDocument": opened})
        + message(id=2, method="textDocument/rename", params=asked)
        + message(id=3, method="shutdown")
        + message(method="exit")
    )
    command = [sys.executable, "-m", "neurovis_spec", "lsp"]
    done = subprocess.run(command, input=spoken, capture_output=True, timeout=60, check=False)
    assert b"'B' is declared already" in done.stdout
    assert (done.returncode, done.stderr) == (0, b"")


def test_references_and_quick_fixes(tmp_path: Path) -> None:
    async def scenario(editor: Editor) -> None:
        client, document = editor.client, editor.document
        text = SPEC.replace("{gaussian: {sigma: 4}}", "tahn")
        found = await editor.open(text)
        uses = await client.text_document_references_async(
            types.ReferenceParams(types.ReferenceContext(False), document, editor.at("K: {count"))
        )
        assert uses is not None
        lines = [one.range.start.line for one in uses]
        assert {one.uri for one in uses} == {editor.uri}
        assert len(lines) == len([line for line in text.splitlines() for _ in line.split("K")[1:]]) - 1
        action = types.CodeActionParams(document, found[0].range, types.CodeActionContext(found))
        actions = await client.text_document_code_action_async(action) or []
        (fix,) = [one for one in actions if one.title == "Write 'tanh'"]
        assert isinstance(fix, types.CodeAction)
        assert fix.is_preferred
        assert fix.edit is not None
        assert fix.edit.changes is not None
        (change,) = fix.edit.changes[editor.uri]
        start = editor.at("tahn")
        end = types.Position(start.line, start.character + 4)
        assert change == types.TextEdit(types.Range(start, end), "tanh")

    edit(tmp_path, scenario)


def message(**content: object) -> bytes:
    body = json.dumps({"jsonrpc": "2.0", **content}).encode()
    return b"Content-Length: %d\r\n\r\n%s" % (len(body), body)


def test_it_ends_quietly() -> None:
    start = message(id=1, method="initialize", params={"capabilities": {}, "processId": None, "rootUri": None})
    spoken = start + message(method="initialized", params={}) + message(id=2, method="shutdown")
    for said in (spoken + message(method="exit"), b""):
        command = [sys.executable, "-m", "neurovis_spec", "lsp"]
        done = subprocess.run(command, input=said, capture_output=True, timeout=60, check=False)
        assert (done.returncode, done.stderr) == (0, b"")
        assert (b"neurovis" in done.stdout) == (said != b"")


def test_formatting_is_that_of_fmt(tmp_path: Path) -> None:
    options = types.FormattingOptions(tab_size=4, insert_spaces=True)

    async def scenario(editor: Editor) -> None:
        text = "neurovis:   1\nname: x\nneurons: {A:   {label: 😀}}   # one\n"
        await editor.open(text)
        params = types.DocumentFormattingParams(editor.document, options)
        (change,) = await editor.client.text_document_formatting_async(params) or ()
        assert change.range == types.Range(types.Position(0, 0), types.Position(3, 0))
        assert change.new_text == format_text(text, "x", Findings()) != text
        editor.type(change.new_text)
        assert not await editor.client.text_document_formatting_async(params)
        editor.type("neurons: [")
        assert not await editor.client.text_document_formatting_async(params)

    edit(tmp_path, scenario)


def test_without_pygls_it_says_what_to_install() -> None:
    code = (
        "import sys\n"
        "sys.modules['pygls'] = None\n"
        "sys.argv = ['neurovis', 'lsp']\n"
        "from neurovis_spec.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        "error: the language server needs pygls; in a clone of the repository: pip install '.[lsp]'"
    ]
