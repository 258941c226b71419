"""The pages: of a subject, of phases, of a cohort, of a mesh alone."""
