"""What decks of all formats share: names of sets, parts, fibres, units, material, springs, numbers as text."""
