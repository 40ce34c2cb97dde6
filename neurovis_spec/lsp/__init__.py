"""The language server: what an editor asks while somebody writes a spec.

In: the text of an open document, broken or not. Out: findings, completions, explanations, places, edits. All but
``server`` and ``protocol`` is plain functions of a text and a place, which know nothing of the protocol.
"""
