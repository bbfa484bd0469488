"""What the viewer shows and what happens on each gesture: plain objects, tested without a display."""
