"""What the user does with a face: one module a mode, all with the small interface of `viewer.modes.base.Mode`."""
