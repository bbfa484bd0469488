"""The parts of the pose edit mode: its draft as plain values, its rows, its marks."""
