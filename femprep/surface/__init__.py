"""fit_surface(): image, harmonic and template put together; triangle quality; distances; reference methods."""
