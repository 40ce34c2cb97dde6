"""Live: a network in the browser while it runs.

In: a Source (a simulator, a recording) and how it is drawn. Out: one page and a stream of frames, over aiohttp (the
extra ``live``). A thread drives the source and never waits for anybody; the server hands each client the latest frame
that it has room for.
"""
