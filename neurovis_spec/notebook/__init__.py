"""Notebook: the live view in a cell, as a widget (the extra ``jupyter``, which is anywidget).

In: a compiled network, perhaps a recording of it. Out: a widget that shows the page of the live view in a frame; what
goes between them is the protocol of docs/live.md, over the notebook's own connection in place of a websocket.
"""
