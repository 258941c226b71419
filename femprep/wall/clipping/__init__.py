"""A closed template surface and planes in, an open piece of it with a clean rim out."""
