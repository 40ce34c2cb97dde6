"""What other people's controllers show themselves with: files that are given away, and need no NeuroVis."""
