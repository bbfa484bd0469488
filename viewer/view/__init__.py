"""The thin layer over Open3D's GUI: it draws what `viewer.state` says, and hands it the window's events."""
