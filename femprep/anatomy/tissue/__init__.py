"""Other images' tissue on the wall: sampled along the wall's own coordinates, as regions or as values."""
