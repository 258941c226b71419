"""The run's records, figures and summary."""
