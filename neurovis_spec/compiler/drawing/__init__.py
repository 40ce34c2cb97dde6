"""The sections ``layout`` and ``render``, references resolved."""
