"""Anyone's surface in: mended where that is safe or refused with the place, closed beyond its rims, laid out anew."""
