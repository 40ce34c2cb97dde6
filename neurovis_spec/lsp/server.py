"""The server: answers an editor over standard input and output.

In: requests and notifications of the language server protocol. Out: answers, and findings a moment after each change.
One thread compiles, one document at a time; what has been overtaken by a later change is not published.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.canonical import format_text
from neurovis_spec.lsp import protocol as wire
from neurovis_spec.lsp.check import Checked, check, stumbled
from neurovis_spec.lsp.completion import complete
from neurovis_spec.lsp.definition import definition, references
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import Edit, RenameError, prepare, rename
from neurovis_spec.lsp.symbols import symbols
from neurovis_spec.lsp.text import Text
from neurovis_spec.lsp.workspace import Desk
from neurovis_spec.real_paths import real_path
from neurovis_spec.version import __version__

#: Seconds without a change until findings are looked for.
PAUSE: Final = 0.3
_log = logging.getLogger(__name__)


class Refusal(JsonRpcInvalidParams):
    """A sentence for the one who asks, and no mistake: nothing is written of it."""


def _is_worth_a_line(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], Refusal))


class SpecServer(LanguageServer):
    """The open documents: what they last compiled to, and the checks that are under way."""

    def __init__(self, pause: float = PAUSE) -> None:
        # Whole texts: pygls counts the lines of changes in a way of its own.
        super().__init__("neurovis", __version__, text_document_sync_kind=types.TextDocumentSyncKind.Full)
        self._pause = pause
        self._desk = Desk(_path_of)
        self._checks: dict[str, asyncio.Task[None]] = {}
        self._compiler = ThreadPoolExecutor(max_workers=1)

    def document(self, uri: str) -> Document:
        """An open document as it is now; the same object until it, or a file that it includes, changes."""
        roots = [_path_of(folder.uri) for folder in self.workspace.folders.values()]
        if not roots and self.workspace.root_uri:
            roots = [_path_of(self.workspace.root_uri)]
        self._desk.update(self._texts, tuple(root for root in roots if root is not None), self._encoding)
        return self._desk.document(uri, self.workspace.get_text_document(uri).source)

    @property
    def _texts(self) -> dict[str, str]:
        """The open texts by their URIs as the client writes them; pygls keeps them with what is escaped resolved."""
        return {document.uri: document.source for document in self.workspace.text_documents.values()}

    @property
    def _encoding(self) -> str:
        encoding = self.workspace.position_encoding
        return encoding.value if isinstance(encoding, types.PositionEncodingKind) else encoding or "utf-16"

    def changed(self, uri: str, pause: float | None = None) -> None:
        """Look for findings, once nothing has changed for a moment; also in those who include it."""
        for other in dict.fromkeys((uri, *self._desk.readers(self._desk.place(uri)))):
            self._check_soon(other, pause)

    def check_again(self) -> None:
        """Look at all that include files: one of these may have changed, or may be there now."""
        including = self._desk.including()
        self._desk.refresh()
        for uri in including:
            self._check_soon(uri, 0.0)

    async def watch(self) -> None:
        """Ask to be told when a file changes that may be included, where the client can be asked."""
        workspace = self.client_capabilities.workspace
        watching = None if workspace is None else workspace.did_change_watched_files
        if watching is not None and watching.dynamic_registration:
            method = types.WORKSPACE_DID_CHANGE_WATCHED_FILES
            files = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher("**/*.{yaml,yml}")])
            await self.client_register_capability_async(
                types.RegistrationParams([types.Registration("neurovis-files", method, files)])
            )

    def closed(self, uri: str) -> None:
        """Forget a document, and take its findings away."""
        self._forget_check(uri)
        path, read = self._desk.place(uri), self._desk.read_by(uri)
        for left in self._desk.close(uri):
            if left != path:
                self._publish(left)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, []))
        for other in (*self._desk.readers(path), *self._desk.libraries(read)):
            self._check_soon(other, 0.0)

    def uri_of(self, path: Path) -> str | None:
        """The URI of a file, that by which it is open if it is."""
        return next(self._desk.uris(path), None) or from_fs_path(str(path))

    def text_of(self, path: Path, document: Document) -> Text:
        """The text of a file near a document; empty where it cannot be read (then only lines are right)."""
        page = document.files.page(path)
        return Text("", document.encoding) if page is None else page.text

    def placed(self, file: str, uri: str, document: Document) -> list[tuple[str, Text]]:
        """The URI and the text of a file that a span names, perhaps that of the document; none where it has no URI."""
        if file == document.file:
            return [(uri, document.text)]
        other = self.uri_of(Path(file))
        return [] if other is None else [(other, self.text_of(Path(file), document))]

    def _check_soon(self, uri: str, pause: float | None) -> None:
        self._forget_check(uri)
        wait = self._pause if pause is None else pause
        self._checks[uri] = asyncio.get_running_loop().create_task(self._check(uri, wait))

    def _forget_check(self, uri: str) -> None:
        task = self._checks.pop(uri, None)
        if task is not None:
            task.cancel()

    async def _check(self, uri: str, pause: float) -> None:
        await asyncio.sleep(pause)
        document = self.document(uri)
        version = self.workspace.get_text_document(uri).version
        try:
            if document.page.library and self._desk.readers(document.path):
                checked = Checked((), None)  # what is said of it where it is included is all
            else:
                checked = await asyncio.get_running_loop().run_in_executor(self._compiler, check, document)
        except Exception:  # a mistake of ours must not end the server: the editor would restart it for ever
            _log.exception("the check of %s has failed", uri)
            checked = stumbled(document)  # what was found before is of another text
        for path in self._desk.keep(uri, document, checked):
            self._publish(path)
        self._publish(document.path, uri, version)

    def _publish(self, path: Path, uri: str | None = None, version: int | None = None) -> None:
        """Say what is known of a file."""
        uri = uri or self.uri_of(path)
        if uri is None:
            return
        found = self._desk.findings(path)
        if uri in self._texts:
            document = self.document(uri)
            told = wire.diagnostics(document.text, found)
            told += wire.included_faults(document, self._desk.around(uri, path))
        else:
            page = self._desk.page(path)
            told = [] if page is None else wire.diagnostics(page.text, found)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, told, version))


def _path_of(uri: str) -> Path | None:
    """The path of a URI; None where it names no file, as of a text that was never saved, or that no file can have."""
    try:
        path = to_fs_path(uri) if uri.startswith("file:") else None
        return real_path(path) if path else None
    except ValueError:  # NUL, a lone surrogate
        return None


def make_server(pause: float = PAUSE) -> SpecServer:
    """A server with all that it answers."""
    server = SpecServer(pause)
    _follow(server)
    _answer(server)
    _edit(server)
    return server


def _follow(server: SpecServer) -> None:
    """Open, change, close; files that change outside of the editor."""

    @server.feature(types.INITIALIZED)
    async def initialized(params: types.InitializedParams) -> None:
        await server.watch()

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def did_open(params: types.DidOpenTextDocumentParams) -> None:
        server.changed(params.text_document.uri, 0.0)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def did_change(params: types.DidChangeTextDocumentParams) -> None:
        server.changed(params.text_document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    async def did_save(params: types.DidSaveTextDocumentParams) -> None:
        server.changed(params.text_document.uri, 0.0)
        server.check_again()

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def did_change_files(params: types.DidChangeWatchedFilesParams) -> None:
        server.check_again()

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def did_close(params: types.DidCloseTextDocumentParams) -> None:
        server.closed(params.text_document.uri)


def _answer(server: SpecServer) -> None:
    """Completion, hover, definition, references, symbols."""

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=list(" {[,.>+(:")))
    def completion(params: types.CompletionParams) -> types.CompletionList:
        document = server.document(params.text_document.uri)
        return wire.completion_list(document, complete(document, wire.place_of(document, params.position)))

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def on_hover(params: types.HoverParams) -> types.Hover | None:
        document = server.document(params.text_document.uri)
        found = hover(document, wire.place_of(document, params.position))
        return None if found is None else wire.hover_of(document, found)

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def on_definition(params: types.DefinitionParams) -> types.Location | None:
        document = server.document(params.text_document.uri)
        found = definition(document, wire.place_of(document, params.position))
        if found is None:
            return None
        if found.path is None:
            return types.Location(params.text_document.uri, wire.range_of(document.text, found.span))
        uri = server.uri_of(found.path)
        if uri is None:
            return None
        return types.Location(uri, wire.range_of(server.text_of(found.path, document), found.span))

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def on_references(params: types.ReferenceParams) -> list[types.Location]:
        document = server.document(params.text_document.uri)
        place = wire.place_of(document, params.position)
        found = references(document, place, declaration=params.context.include_declaration)
        return [
            types.Location(uri, wire.range_of(text, span))
            for span in found
            for uri, text in server.placed(span.file, params.text_document.uri, document)
        ]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def document_symbol(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        document = server.document(params.text_document.uri)
        return [wire.symbol_of(document, symbol) for symbol in symbols(document)]


def _edit(server: SpecServer) -> None:
    """Rename, mend and format. A refusal is an error with a sentence, which editors show."""

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare_rename(params: types.PrepareRenameParams) -> types.PrepareRenamePlaceholder:
        document = server.document(params.text_document.uri)
        try:
            span, name = prepare(document, wire.place_of(document, params.position))
        except RenameError as error:
            raise Refusal(str(error)) from None
        return types.PrepareRenamePlaceholder(wire.range_of(document.text, span), name)

    @server.feature(types.TEXT_DOCUMENT_RENAME)
    def on_rename(params: types.RenameParams) -> types.WorkspaceEdit:
        document = server.document(params.text_document.uri)
        try:
            edits = rename(document, wire.place_of(document, params.position), params.new_name)
        except RenameError as error:
            raise Refusal(str(error)) from None
        changes = []
        for file in dict.fromkeys(edit.span.file for edit in edits):
            own = [edit for edit in edits if edit.span.file == file]
            changes += [(uri, text, own) for uri, text in server.placed(file, params.text_document.uri, document)]
        return wire.workspace_edit(changes)

    @server.feature(
        types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix])
    )
    def on_code_action(params: types.CodeActionParams) -> list[types.CodeAction]:
        document = server.document(params.text_document.uri)
        own = [one for one in params.context.diagnostics if one.source == "neurovis"]
        return wire.fixes(params.text_document.uri, document.text, own)

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def on_formatting(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        document = server.document(params.text_document.uri)
        text = document.text
        written = format_text(text.text, document.file, Findings())
        whole = text.span(document.file, 0, len(text.text))
        return wire.text_edits(text, [] if written in (None, text.text) else [Edit(whole, written)])


def serve() -> None:
    """Answer on standard input and output until the client ends it.

    What anybody else prints goes to standard error: between the answers it would end the conversation.
    """
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    logging.getLogger("pygls.protocol.json_rpc").addFilter(_is_worth_a_line)
    make_server().start_io(stdout=answers)
