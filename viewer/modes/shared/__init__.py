"""What several modes need: a brush on the surface, dragging in the view plane, drafts that outlive a kill."""
