"""What can be set and what events change in a run."""
