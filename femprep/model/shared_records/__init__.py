"""Records that several rooms share, as the JSON files have them: fidelity, solution, tissue, transfer."""
