"""What the language has to offer, as values to look up: its keys, built-ins, functions and patterns.

In: the models, the library files and the tables that the compiler works with. Out: Topics, which ``neurovis docs``
prints, ``docs/language.md`` lists and an editor shows; so none of them can say anything else than what is so.
"""
