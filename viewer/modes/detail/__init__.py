"""The parts of the detail edit mode: its draft as plain values, its rows, its marks, its gestures."""
