"""The toolbox, arrays in and arrays out: it knows no heart, and no file or image either."""
