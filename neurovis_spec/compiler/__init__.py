"""The compiler: from a Spec to a Network of frozen arrays and an update program."""
